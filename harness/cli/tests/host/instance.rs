//! The host against somebody else's FMU: a C spring with one state and, on request, bad manners.

use crate::spring;
use host::{Causality, Fmu, HostError, Instance, Kind, Start, Status, Variability};
use std::time::Duration;

const DEPTH: u32 = 0;
const SPEED: u32 = 1;
const PUSH: u32 = 2;
const CREEP: u32 = 3;
const TAU: u32 = 6;

/// Initialized, with a time constant of 10 ms and the manners of spring.c.
fn running(fmu: &Fmu, manners: i32) -> Instance {
    let mut i = fmu.instantiate("it", true).unwrap();
    i.setup_experiment(Some(1e-6), 0.0, None).unwrap();
    i.set_real(&[TAU], &[0.01]).unwrap();
    i.set_integer(&[0], &[manners]).unwrap();
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    i
}

#[test]
fn a_description_with_unknown_attributes_is_read() {
    let f = spring::able();
    let d = f.description();
    assert_eq!((d.model_name.as_str(), d.guid.as_str()), ("Acme.Spring", "{5b1c0e5e-spring}"));
    assert_eq!(d.generation_tool, "Acme & Sons");
    assert_eq!(d.step_size, Some(1e-3));
    assert_eq!(d.log_categories, ["logStatusError", "logStatusWarning"]);
    let v = d.variable("depth").unwrap();
    assert_eq!((v.value_reference, v.causality, v.kind), (0, Causality::Input, Kind::Real));
    assert_eq!((v.unit.as_deref(), &v.start), (Some("mm"), &Some(Start::Real(0.0))));
    let v = d.variable("label").unwrap();
    assert_eq!((v.kind, v.variability), (Kind::String, Variability::Tunable));
    assert_eq!(v.start, Some(Start::String("spring".into())));
    assert_eq!(d.variable("creep").unwrap().causality, Causality::Local);
    assert_eq!(d.names(Causality::Input), ["depth", "speed"]);
    let c = f.capabilities();
    assert!(c.can_get_and_set_fmu_state && c.can_interpolate_inputs && !c.needs_execution_tool);
    assert_eq!(c.max_output_derivative_order, 1);
}

#[test]
fn no_list_of_dependencies_is_not_an_empty_one() {
    let feedthrough =
        |output| spring::open(&spring::description("", output)).description().feedthrough("push", "depth");
    assert_eq!(feedthrough(""), None);
    assert_eq!(feedthrough(r#"dependencies="""#), Some(false));
    assert_eq!(feedthrough(r#"dependencies="1""#), Some(true));
}

#[test]
fn what_is_no_fmu_is_refused_with_a_cure() {
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("x.fmu");
    let refused = |cure: &str| {
        let e = Fmu::open(&path).unwrap_err().to_string();
        assert!(e.contains("x.fmu") && e.contains(cure), "{e}");
    };
    refused("cannot be read");
    std::fs::write(&path, "PK, but not a zip").unwrap();
    refused("not a zip archive");
    spring::archive(&path, &[("resources/a.txt", b"a")]);
    refused("no modelDescription.xml");
    let pack = |xml: &str, other: &str| {
        spring::archive(&path, &[("modelDescription.xml", xml.as_bytes()), (other, b"x")]);
    };
    let good = spring::description("", "");
    let me = good.replace("CoSimulation", "ModelExchange");
    pack(&me, "binaries/linux64/spring.so");
    refused("only model exchange");
    pack(&good, "sources/spring.c");
    refused("no binaries at all");
    pack(&good, "binaries/win64/spring.dll");
    refused("only win64");
    pack(&good, "binaries/linux64/other.so");
    refused("holds no spring.so");
    pack(&good, "binaries/linux64/spring.so");
    refused("its binary does not load");
    pack(&good.replace(r#"fmiVersion="2.0""#, r#"fmiVersion="3.0""#), "a");
    refused("FMI 3.0");
    pack(&good.replace(r#"valueReference="3""#, r#"valueReference="three""#), "a");
    refused("modelDescription.xml:18: valueReference=\"three\"");
    pack(&good.replace("</ModelStructure>", ""), "a");
    refused("not well formed");
    pack(&good[..good.len() / 2], "a");
    refused("modelDescription.xml:");
    pack(&good.replace(r#"index="3""#, r#"index="30""#), "a");
    refused("names variable 30, there are 10");
}

#[test]
fn a_wrong_guid_makes_no_instance_and_says_so() {
    let f = spring::open(&spring::description("", "").replace("5b1c0e5e", "00000000"));
    let e = f.instantiate("it", false).unwrap_err().to_string();
    assert!(e.contains("GUID {00000000-spring}, not {5b1c0e5e-spring}"), "{e}");
}

#[test]
fn values_of_every_type_go_in_and_out() {
    let mut i = running(&spring::able(), 0);
    i.set_boolean(&[0], &[true]).unwrap();
    assert_eq!(i.get_boolean(&[0]).unwrap(), [true]);
    i.set_string(&[0], &["Feder ü"]).unwrap();
    assert_eq!(i.get_string(&[0, 0]).unwrap(), ["Feder ü", "Feder ü"]);
    let mut n = [7];
    i.get_integer(&[0], &mut n).unwrap();
    assert_eq!(n, [0]);
    i.set_real(&[DEPTH, SPEED], &[2.0, 0.5]).unwrap();
    assert_eq!(i.real(PUSH).unwrap(), 2.0);
    let mut two = [0.0; 2];
    i.get_real(&[SPEED, DEPTH], &mut two).unwrap();
    assert_eq!(two, [0.5, 2.0]);
    // back to how it was made
    i.terminate().unwrap();
    i.reset().unwrap();
    assert_eq!(i.get_string(&[0]).unwrap(), ["spring"]);
}

#[test]
fn misuse_is_an_error_and_never_a_panic() {
    let mut i = running(&spring::able(), 0);
    assert!(i.set_real(&[0, 1], &[1.0]).unwrap_err().to_string().contains("2 value references and 1 values"));
    assert!(i.set_string(&[0], &["a\0b"]).unwrap_err().to_string().contains("zero byte"));
    assert!(i.get_real_output_derivatives(&[PUSH], &[2], &mut [0.0]).is_err());
    let e = i.real(99).unwrap_err();
    assert_eq!(e.status(), Some(Status::Error));
    assert_eq!(e.to_string(), "fmi2GetReal of it answered fmi2Error; it logged \"no Real 99\"");
    // an FMU that declares nothing is asked for nothing
    let mut i = running(&spring::open(&spring::description("", "")), 0);
    for e in [
        i.save().unwrap_err(),
        i.deserialize(&[0]).unwrap_err(),
        i.set_real_input_derivatives(&[DEPTH], &[1], &[1.0]).unwrap_err(),
        i.get_directional_derivative(&[PUSH], &[DEPTH], &[1.0], &mut [0.0]).unwrap_err(),
    ] {
        assert!(matches!(&e, HostError::Use { why, .. } if why.contains("declares no")), "{e}");
    }
}

#[test]
fn steps_follow_the_model() {
    let mut i = running(&spring::able(), 0);
    i.set_real(&[DEPTH], &[1.0]).unwrap();
    for n in 0..10 {
        i.do_step(f64::from(n) * 1e-3, 1e-3).unwrap();
    }
    let creep = 1e-3 * (1.0 - (-1.0f64).exp());
    assert!((i.real(CREEP).unwrap() - creep).abs() < 1e-16);
    assert!((i.real(PUSH).unwrap() - 1e3 * (1e-3 - creep)).abs() < 1e-12);
}

#[test]
fn derivatives_of_inputs_and_outputs_pass() {
    let mut i = running(&spring::able(), 0);
    // the depth rises by 1 mm in 1 ms: the exact response of the creep to a ramp
    i.set_real_input_derivatives(&[DEPTH], &[1], &[1000.0]).unwrap();
    i.do_step(0.0, 1e-3).unwrap();
    let ramp = 1e-3 - 0.01 * (1.0 - (-0.1f64).exp());
    assert!((i.real(CREEP).unwrap() - ramp).abs() < 1e-15);
    assert!((i.real(DEPTH).unwrap() - 1.0).abs() < 1e-15);
    i.set_real(&[SPEED], &[0.25]).unwrap();
    let mut d = [0.0];
    i.get_real_output_derivatives(&[PUSH], &[1], &mut d).unwrap();
    assert_eq!(d, [250.0]);
    i.get_directional_derivative(&[PUSH], &[DEPTH, SPEED], &[3.0, 1.0], &mut d).unwrap();
    assert_eq!(d, [3.0]);
}

#[test]
fn a_state_comes_back_bit_for_bit() {
    let f = spring::able();
    let mut i = running(&f, 0);
    let path = |i: &mut Instance, first: u32| {
        let mut seen = Vec::new();
        for n in first..first + 20 {
            i.set_real(&[DEPTH, SPEED], &[(f64::from(n) * 0.37).sin(), 0.1]).unwrap();
            i.do_step(f64::from(n) * 1e-3, 1e-3).unwrap();
            seen.push((i.real(PUSH).unwrap().to_bits(), i.real(CREEP).unwrap().to_bits()));
        }
        seen
    };
    path(&mut i, 0);
    let s = i.save().unwrap();
    let first = path(&mut i, 20);
    i.restore(&s).unwrap();
    assert_eq!(path(&mut i, 20), first);
    // as bytes in another instance, which outlives the FMU's own handle
    let bytes = i.serialize(&s).unwrap();
    let mut other = f.instantiate("other", false).unwrap();
    drop(f);
    other.enter_initialization().unwrap();
    other.exit_initialization().unwrap();
    let t = other.deserialize(&bytes).unwrap();
    other.restore(&t).unwrap();
    assert_eq!(path(&mut other, 20), first);
    // saving over it keeps the later state
    i.restore(&s).unwrap();
    path(&mut i, 20);
    i.save_into(&s).unwrap();
    let later = path(&mut i, 40);
    i.restore(&s).unwrap();
    assert_eq!(path(&mut i, 40), later);
    assert_ne!(later, first);
    // another's state and broken bytes are refused
    assert!(i.restore(&t).unwrap_err().to_string().contains("another instance"));
    let e = i.deserialize(&bytes[1..]).unwrap_err();
    assert!(e.to_string().contains("bytes are no state"), "{e}");
    i.free(s).unwrap();
    let u = i.save().unwrap();
    i.restore(&u).unwrap();
}

#[test]
fn a_discarded_step_says_how_far_it_came() {
    let mut i = running(&spring::able(), 1);
    let e = i.do_step(1.0, 0.5).unwrap_err();
    let c = e.call().unwrap();
    assert_eq!((c.function, c.status), ("fmi2DoStep", Status::Discard));
    let d = c.discarded.unwrap();
    assert_eq!((d.last_successful_time, d.terminated), (Some(1.25), true));
    assert_eq!(c.log.last().unwrap().message, "a step of 0.5 s is too long");
}

#[test]
fn messages_come_formatted_and_with_their_call() {
    let mut i = running(&spring::able(), 2);
    let e = i.do_step(0.25, 0.5).unwrap_err();
    assert_eq!(
        e.to_string(),
        "fmi2DoStep of it answered fmi2Error; it logged \"step of 0.5 s at 0.25 s: trouble number 42\""
    );
    assert_eq!(e.call().unwrap().log[0].category, "logStatusError");
    // only the lines of the call that failed
    let e = i.real(50).unwrap_err();
    assert_eq!(e.call().unwrap().log.len(), 1);
    assert_eq!(i.log().len(), 2);
    i.set_integer(&[0], &[9]).unwrap();
    let e = i.do_step(0.0, 1.0).unwrap_err();
    let m = &e.call().unwrap().log[0].message;
    assert!(m.len() == 5003 && m.ends_with("xend"));
    i.set_debug_logging(true, &["logStatusError"]).unwrap();
    assert_eq!(i.log().last().unwrap().message, "logging of 1 category");
}

#[test]
fn a_warning_does_not_stop_and_stays_in_the_log() {
    let mut i = running(&spring::able(), 8);
    i.do_step(0.0, 1.0).unwrap();
    let log = i.log();
    assert_eq!((log[0].status, log[0].message.as_str()), (Status::Warning, "100% sure, but slow"));
}

#[test]
fn pending_steps_are_waited_for() {
    let f = spring::able();
    for manners in [3, 5] {
        let mut i = running(&f, manners);
        i.set_real(&[DEPTH], &[1.0]).unwrap();
        for n in 0..3 {
            i.do_step(f64::from(n), 1.0).unwrap();
        }
        assert!((i.real(CREEP).unwrap() - 1e-3).abs() < 1e-15);
    }
    let mut i = running(&f, 10);
    assert_eq!(i.do_step(0.0, 1.0).unwrap_err().status(), Some(Status::Error));
    let mut i = running(&f, 4);
    i.set_patience(Duration::from_millis(20)).unwrap();
    let e = i.do_step(0.0, 1.0).unwrap_err();
    assert_eq!(e.status(), Some(Status::Pending));
    assert!(e.to_string().contains("was cancelled"), "{e}");
    // nothing to cancel here: the FMU says so, and that is an error like any
    assert_eq!(running(&f, 0).cancel_step().unwrap_err().status(), Some(Status::Error));
}

#[test]
fn a_status_that_is_none_is_an_error() {
    let mut i = running(&spring::able(), 7);
    assert_eq!(i.do_step(0.0, 1.0).unwrap_err().status(), Some(Status::Unknown(17)));
}

#[test]
fn after_a_fatal_answer_nothing_is_called() {
    let f = spring::able();
    let mut bystander = running(&f, 0);
    let mut i = running(&f, 6);
    assert_eq!(i.do_step(0.0, 1.0).unwrap_err().status(), Some(Status::Fatal));
    for e in [i.do_step(1.0, 1.0).unwrap_err(), bystander.real(PUSH).map(|_| ()).unwrap_err()] {
        assert!(e.to_string().contains("fmi2Fatal"), "{e}");
    }
    assert!(f.instantiate("late", false).is_err());
    // the same file opened afresh is another FMU
    running(&spring::able(), 0).do_step(0.0, 1.0).unwrap();
}

#[test]
fn an_fmu_that_allows_one_instance_gets_one() {
    let f = spring::open(&spring::description(r#"canBeInstantiatedOnlyOncePerProcess="true""#, ""));
    let one = f.instantiate("one", false).unwrap();
    assert!(f.instantiate("two", false).unwrap_err().to_string().contains("allows one instance"));
    drop(one);
    f.instantiate("three", false).unwrap();
}

#[test]
fn two_hundred_instances_on_eight_threads_share_nothing() {
    let f = spring::able();
    let sums = |thread: u32| {
        let mut all: Vec<Instance> = (0..25).map(|_| running(&f, 0)).collect();
        for n in 0..20 {
            for (k, i) in all.iter_mut().enumerate() {
                i.set_real(&[DEPTH], &[f64::from(thread * 25 + k as u32)]).unwrap();
                i.do_step(f64::from(n) * 1e-3, 1e-3).unwrap();
            }
        }
        all.iter_mut().map(|i| i.real(CREEP).unwrap()).collect::<Vec<f64>>()
    };
    let got: Vec<f64> = std::thread::scope(|s| {
        let threads: Vec<_> = (0..8).map(|t| s.spawn(move || sums(t))).collect();
        threads.into_iter().flat_map(|t| t.join().unwrap()).collect()
    });
    for (k, creep) in got.iter().enumerate() {
        let exact = k as f64 * 1e-3 * (1.0 - (-2.0f64).exp());
        assert!((creep - exact).abs() <= 1e-12, "{k}: {creep} for {exact}");
    }
}

#[test]
fn the_folder_goes_with_the_last_instance() {
    let f = spring::able();
    let folder = f.folder().to_path_buf();
    let mut i = running(&f, 0);
    drop(f);
    i.do_step(0.0, 1.0).unwrap();
    assert!(folder.join("binaries").is_dir());
    drop(i);
    assert!(!folder.exists());
}
