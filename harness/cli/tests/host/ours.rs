//! Our own FMU through the host.

use host::{Coupling, Direct, Element, Fmu, FmuElement, Instance, Names, Status};
use law::Parameters;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::OnceLock;

const PENETRATION: u32 = 0;
const VELOCITY: u32 = 1;
const FORCE: u32 = 2;
const OUTPUTS: [u32; 6] = [2, 4, 5, 6, 7, 8];

/// The element as it is packed here, once a process.
fn fmu() -> Fmu {
    static FMU: OnceLock<Fmu> = OnceLock::new();
    FMU.get_or_init(|| {
        let dir = tempfile::TempDir::new().unwrap();
        Fmu::open(&pack::into_folder(dir.path(), &[]).unwrap()).unwrap()
    })
    .clone()
}

/// A law with every mechanism that has memory switched on.
fn law(exponent: f64) -> Parameters {
    let values = [
        ("stiffness", 2e8),
        ("exponent", exponent),
        ("hysteresis_damping", 1e8),
        ("viscous_damping", 20.0),
        ("yield_penetration", 1e-4),
        ("plastic_ratio", 0.2),
        ("adhesion_force", 3.0),
        ("adhesion_range", 2e-5),
        ("adhesion_form", 2.0),
        ("relaxation_stiffness", 3e7),
        ("relaxation_time", 2e-4),
        ("relaxation_spread", 1.0),
        ("secondary_stiffness", 1e8),
        ("secondary_depth", 4e-4),
    ];
    Parameters::from_names(values).unwrap()
}

/// `law` with another stiffness, N/m^p.
fn with_stiffness(law: Parameters, stiffness: f64) -> Parameters {
    let mut law = law;
    law.elastic.stiffness = stiffness;
    law
}

/// The same as names and values.
fn named(p: &Parameters) -> Vec<(String, f64)> {
    p.values().map(|(p, x)| (p.name.to_string(), x)).collect()
}

/// Running, with that law.
fn running(law: &Parameters) -> Instance {
    let f = fmu();
    let mut i = f.instantiate("it", true).unwrap();
    for (name, value) in named(law) {
        let reference = [f.description().variable(&name).unwrap().value_reference];
        if name.ends_with("form") {
            i.set_integer(&reference, &[value as i32]).unwrap();
        } else {
            i.set_real(&reference, &[value]).unwrap();
        }
    }
    i.setup_experiment(None, 0.0, None).unwrap();
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    i
}

/// Steps in and out of contact; the bits of every output after each.
fn in_and_out(i: &mut Instance, first: u32, steps: u32) -> Vec<u64> {
    let mut bits = Vec::new();
    let h = 1e-5;
    for n in first..first + steps {
        let phase = f64::from(n) * 0.05;
        i.set_real(&[PENETRATION, VELOCITY], &[3e-4 * phase.sin() + 1e-4, 1.5 * phase.cos()]).unwrap();
        i.do_step(f64::from(n) * h, h).unwrap();
        let mut out = [0.0; OUTPUTS.len()];
        i.get_real(&OUTPUTS, &mut out).unwrap();
        bits.extend(out.map(f64::to_bits));
    }
    bits
}

#[test]
fn it_is_coupled_directly() {
    let e = FmuElement::new(&fmu(), &[], &Names::default()).unwrap();
    assert_eq!(e.coupling(), Coupling::Direct);
}

#[test]
fn as_an_element_it_is_the_law_bit_for_bit() {
    for p in [1.0, 1.5, 2.79] {
        let law = law(p);
        let mut through = FmuElement::new(&fmu(), &named(&law), &Names::default()).unwrap();
        let mut direct = Direct::new(law);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut at, mut deepest) = ((-1e-4, 0.0), 0.0f64);
        for n in 0..400 {
            // trials that must leave no trace
            for _ in 0..3 {
                let (x, v) = (rng.random_range(-2e-4..9e-4), rng.random_range(-2.0..2.0));
                assert_eq!(through.force(x, v).unwrap().to_bits(), direct.force(x, v).unwrap().to_bits());
                assert_eq!(through.derivatives(x, v).unwrap(), direct.derivatives(x, v).unwrap());
            }
            let dt = rng.random_range(1e-7..2e-5);
            let phase = f64::from(n) * 0.1;
            let to = (4e-4 * phase.sin() + 1e-4, 2.0 * phase.cos());
            through.advance(at, to, dt).unwrap();
            direct.advance(at, to, dt).unwrap();
            assert_eq!(through.energies().unwrap(), direct.energies().unwrap(), "p {p}, step {n}");
            at = to;
            deepest = deepest.max(at.0);
        }
        assert_eq!(through.real("deepest_penetration").unwrap(), deepest);
        assert!(through.real("permanent_set").unwrap() > 0.0);
    }
}

#[test]
fn a_state_restored_or_serialized_goes_on_bit_for_bit() {
    let law = law(1.5);
    let mut i = running(&law);
    in_and_out(&mut i, 0, 150);
    let s = i.save().unwrap();
    let bytes = i.serialize(&s).unwrap();
    let on = in_and_out(&mut i, 150, 200);
    // restoring twice, with reuse between
    for _ in 0..2 {
        i.restore(&s).unwrap();
        assert_eq!(in_and_out(&mut i, 150, 200), on);
        i.restore(&s).unwrap();
        i.save_into(&s).unwrap();
    }
    // into an instance with other parameters and another past
    let mut other = running(&with_stiffness(law, 1e6));
    in_and_out(&mut other, 0, 30);
    let t = other.deserialize(&bytes).unwrap();
    other.restore(&t).unwrap();
    assert_eq!(in_and_out(&mut other, 150, 200), on);
    // the bytes are the state's, wherever they went through
    assert_eq!(other.serialize(&t).unwrap(), bytes);
    let mut bad = bytes.clone();
    bad[40] ^= 1;
    assert!(i.deserialize(&bad).is_err());
    i.free(s).unwrap();
}

#[test]
fn directional_derivatives_are_those_of_differences() {
    let mut law = Parameters::power_law(2e8, 1.8, 1e8);
    law.viscous_damping.coefficient = 30.0;
    let mut i = running(&law);
    let mut force = |x: f64, v: f64| {
        i.set_real(&[PENETRATION, VELOCITY], &[x, v]).unwrap();
        let mut d = [0.0; 2];
        for k in [PENETRATION, VELOCITY] {
            i.get_directional_derivative(&[FORCE], &[k], &[1.0], &mut d[k as usize..][..1]).unwrap();
        }
        (i.real(FORCE).unwrap(), d)
    };
    for x in [-1e-4, 1e-6, 1e-4, 7e-4] {
        for v in [-5.0, -0.3, 0.0, 1.0] {
            let (f, d) = force(x, v);
            let (hx, hv) = (1e-5 * x, 1e-4);
            let fx = (force(x + hx, v).0 - force(x - hx, v).0) / (2.0 * hx);
            let fv = (force(x, v + hv).0 - force(x, v - hv).0) / (2.0 * hv);
            if f == 0.0 {
                assert_eq!(d, [0.0, 0.0]);
                continue;
            }
            assert!((fx - d[0]).abs() <= 1e-6 * d[0].abs().max(f / x), "x {x} v {v}: {fx} for {}", d[0]);
            assert!((fv - d[1]).abs() <= 1e-6 * d[1].abs(), "x {x} v {v}: {fv} for {}", d[1]);
        }
    }
}

#[test]
fn input_derivatives_take_a_step_where_set_inputs_would() {
    let law = law(1.5);
    let (from, to, h) = ((1e-4, 1.0), (1.2e-4, 0.9), 2e-5);
    let mut set = running(&law);
    let mut sloped = running(&law);
    for i in [&mut set, &mut sloped] {
        i.set_real(&[PENETRATION, VELOCITY], &[from.0, from.1]).unwrap();
        i.do_step(0.0, h).unwrap();
    }
    set.set_real(&[PENETRATION, VELOCITY], &[to.0, to.1]).unwrap();
    let rates = [(to.0 - from.0) / h, (to.1 - from.1) / h];
    sloped.set_real_input_derivatives(&[PENETRATION, VELOCITY], &[1, 1], &rates).unwrap();
    for i in [&mut set, &mut sloped] {
        i.do_step(h, h).unwrap();
    }
    for out in OUTPUTS {
        let (a, b) = (set.real(out).unwrap(), sloped.real(out).unwrap());
        assert!((a - b).abs() <= 1e-12 * a.abs(), "output {out}: {a} and {b}");
    }
    let mut rate = [0.0];
    sloped.get_real_output_derivatives(&[FORCE], &[1], &mut rate).unwrap();
    assert!(rate[0].is_finite() && rate[0] != 0.0);
}

#[test]
fn what_is_not_finite_is_refused_by_name() {
    let mut i = running(&law(1.5));
    let e = i.set_real(&[PENETRATION], &[f64::NAN]).unwrap_err();
    assert_eq!(e.status(), Some(Status::Discard));
    assert!(e.to_string().contains("penetration is NaN"), "{e}");
    let e = i.do_step(0.0, 1e-5).unwrap_err();
    assert_eq!(e.status(), Some(Status::Discard));
    assert_eq!(e.call().unwrap().discarded.unwrap().last_successful_time, Some(0.0));
    i.set_real(&[PENETRATION], &[1e-4]).unwrap();
    i.do_step(0.0, 1e-5).unwrap();
    let e = i.do_step(7.0, 1e-5).unwrap_err();
    assert!(e.to_string().contains("currentCommunicationPoint is 7 s"), "{e}");
    assert!(i.real(4711).unwrap_err().to_string().contains("4711"));
    // still good
    i.do_step(1e-5, 1e-5).unwrap();
}

#[test]
fn two_hundred_instances_on_eight_threads_share_nothing() {
    let stiffness = |n: usize| 1e7 * (1.0 + n as f64);
    let alone = |n: usize| in_and_out(&mut running(&with_stiffness(law(1.5), stiffness(n))), 0, 60);
    let got: Vec<(usize, Vec<u64>)> = std::thread::scope(|s| {
        let threads: Vec<_> = (0..8)
            .map(|t| {
                s.spawn(move || {
                    let of = |k| with_stiffness(law(1.5), stiffness(25 * t + k));
                    let mut all: Vec<Instance> = (0..25).map(|k| running(&of(k))).collect();
                    let mut bits = vec![Vec::new(); 25];
                    // a step each in turn, so that they lie across one another
                    for n in 0..60 {
                        for (i, b) in all.iter_mut().zip(&mut bits) {
                            b.extend(in_and_out(i, n, 1));
                        }
                    }
                    bits.into_iter().enumerate().map(move |(k, b)| (25 * t + k, b)).collect::<Vec<_>>()
                })
            })
            .collect();
        threads.into_iter().flat_map(|t| t.join().unwrap()).collect()
    });
    assert_eq!(got.len(), 200);
    for (n, bits) in got {
        assert_eq!(bits, alone(n), "instance {n}");
    }
}

/// The bytes of the packed element.
fn packed() -> Vec<u8> {
    let dir = tempfile::TempDir::new().unwrap();
    std::fs::read(pack::into_folder(dir.path(), &[]).unwrap()).unwrap()
}

#[test]
fn a_life_goes_from_instantiation_to_the_end_and_again() {
    let mut i = running(&law(1.5));
    let first = in_and_out(&mut i, 0, 80);
    assert!(i.setup_experiment(None, 0.0, None).is_err(), "set up while it steps");
    i.terminate().unwrap();
    assert!(i.do_step(80e-5, 1e-5).is_err(), "stepped after its end");
    // a reset brings the start values back, parameters included
    i.reset().unwrap();
    let f = fmu();
    let stiffness = f.description().variable("stiffness").unwrap();
    assert_eq!(
        i.real(stiffness.value_reference).unwrap(),
        running(&Parameters::default()).real(stiffness.value_reference).unwrap()
    );
    for (name, value) in named(&law(1.5)) {
        let reference = [f.description().variable(&name).unwrap().value_reference];
        if name.ends_with("form") {
            i.set_integer(&reference, &[value as i32]).unwrap();
        } else {
            i.set_real(&reference, &[value]).unwrap();
        }
    }
    i.setup_experiment(Some(1e-6), 0.0, Some(80e-5)).unwrap();
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    assert_eq!(in_and_out(&mut i, 0, 80), first);
    let e = i.do_step(80e-5, 1e-5).unwrap_err().to_string();
    assert!(e.contains("stop time"), "{e}");
    // it lives on while the FMU it came from is gone
    drop(f);
    assert!(i.real(FORCE).unwrap().is_finite());
}

#[test]
fn it_is_never_pending_and_says_so_when_cancelled() {
    let mut i = running(&law(1.5));
    i.set_patience(std::time::Duration::ZERO).unwrap();
    in_and_out(&mut i, 0, 20);
    let e = i.cancel_step().unwrap_err();
    assert_eq!(e.status(), Some(Status::Error));
}

#[test]
fn a_damaged_archive_is_refused_and_never_a_panic() {
    let whole = packed();
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("damaged.fmu");
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let e = Fmu::open(&path).unwrap_err().to_string();
        assert!(e.contains("damaged.fmu") && e.contains("; "), "no file or no cure: {e}");
        e
    };
    // cut short anywhere, it has no directory of its contents
    for share in [0, 1, 7, 31, 63] {
        let e = refused(&whole[..whole.len() * share / 64]);
        assert!(e.contains("not a zip archive"), "{e}");
    }
    let xml = {
        let mut z = zip::ZipArchive::new(std::io::Cursor::new(&whole)).unwrap();
        let mut s = String::new();
        std::io::Read::read_to_string(&mut z.by_name("modelDescription.xml").unwrap(), &mut s).unwrap();
        s
    };
    let with = |xml: &str, binary: &str| {
        crate::spring::archive(&path, &[("modelDescription.xml", xml.as_bytes()), (binary, b"no binary")]);
        std::fs::read(&path).unwrap()
    };
    let linux = "binaries/linux64/HysteresisContact.so";
    // its description cut short, in another version, of another GUID
    for share in [0, 1, 8, 31] {
        refused(&with(&xml[..xml.len() * share / 32], linux));
    }
    assert!(refused(&with(&xml.replacen("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\"", 1), linux)).contains("FMI 1.0"));
    assert!(refused(&with(&xml, "binaries/win32/HysteresisContact.dll")).contains("only win32"));
    assert!(refused(&with(&xml, linux)).contains("does not load"));
}

#[test]
fn another_guid_makes_no_instance() {
    let whole = packed();
    let mut from = zip::ZipArchive::new(std::io::Cursor::new(&whole)).unwrap();
    let mut files = Vec::new();
    for n in 0..from.len() {
        let mut f = from.by_index(n).unwrap();
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut f, &mut bytes).unwrap();
        files.push((f.name().unwrap().into_owned(), bytes));
    }
    let guid = fmu().description().guid.clone();
    for (name, bytes) in &mut files {
        if name == "modelDescription.xml" {
            *bytes = String::from_utf8(bytes.clone()).unwrap().replace(&guid, "{another}").into_bytes();
        }
    }
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("another.fmu");
    let list: Vec<(&str, &[u8])> = files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    crate::spring::archive(&path, &list);
    let e = Fmu::open(&path).unwrap().instantiate("it", true).map(|_| ()).unwrap_err().to_string();
    assert!(e.contains("{another}"), "{e}");
}
