//! An FMU in a process of its own does what it does in this one.
#![cfg(target_os = "linux")]

use crate::spring;
use host::{Call, Fmu, HostError, Instance, Isolation, Limits, Status};
use std::time::Duration;

fn isolation() -> Isolation {
    Isolation::Process(Limits { program: env!("CARGO_BIN_EXE_touchdown").into(), ..Limits::new() })
}

fn apart(xml: &str) -> Fmu {
    let dir = tempfile::TempDir::new().unwrap();
    Fmu::open_in(&spring::write(dir.path(), xml), &isolation()).unwrap()
}

fn able() -> Fmu {
    apart(&spring::description(spring::ALL, r#"dependencies="1 2""#))
}

fn ready(fmu: &Fmu, manners: i32) -> Instance {
    let mut i = fmu.instantiate("it", true).unwrap();
    i.setup_experiment(Some(1e-6), 0.0, None).unwrap();
    i.set_real(&[6], &[0.01]).unwrap();
    i.set_integer(&[0], &[manners]).unwrap();
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    i
}

/// Everything that an instance can be asked, in words.
fn life(fmu: &Fmu) -> Vec<String> {
    let mut i = ready(fmu, 0);
    let mut said = Vec::new();
    i.set_boolean(&[0], &[true]).unwrap();
    i.set_string(&[0], &["Feder ü"]).unwrap();
    said.push(format!("{:?} {:?}", i.get_boolean(&[0]).unwrap(), i.get_string(&[0, 0]).unwrap()));
    i.set_debug_logging(true, &["logStatusError"]).unwrap();
    let mut n = [7];
    i.get_integer(&[0], &mut n).unwrap();
    said.push(format!("{n:?}"));
    let s = i.save().unwrap();
    for k in 0..20 {
        i.set_real(&[0, 1], &[(f64::from(k) * 0.37).sin(), 0.1]).unwrap();
        i.set_real_input_derivatives(&[0], &[1], &[3.0]).unwrap();
        i.do_step(f64::from(k) * 1e-3, 1e-3).unwrap();
        said.push(format!("{:x} {:x}", i.real(2).unwrap().to_bits(), i.real(3).unwrap().to_bits()));
    }
    let mut d = [0.0];
    i.get_real_output_derivatives(&[2], &[1], &mut d).unwrap();
    i.get_directional_derivative(&[2], &[0, 1], &[3.0, 1.0], &mut d).unwrap();
    said.push(format!("{d:?}"));
    let t = i.save().unwrap();
    said.push(format!("{:?}", i.serialize(&t).unwrap()));
    i.restore(&s).unwrap();
    said.push(format!("{:?}", i.real(3).unwrap()));
    let bytes = i.serialize(&t).unwrap();
    let u = i.deserialize(&bytes).unwrap();
    i.restore(&u).unwrap();
    i.save_into(&s).unwrap();
    i.free(t).unwrap();
    said.push(format!("{:?} {}", i.real(3).unwrap(), i.real(99).unwrap_err()));
    said.push(format!("{}", i.deserialize(&bytes[1..]).unwrap_err()));
    i.terminate().unwrap();
    i.reset().unwrap();
    said.push(format!("{:?} {:?}", i.get_string(&[0]).unwrap(), i.log()));
    said
}

#[test]
fn a_whole_life_has_the_same_bits_words_and_log_as_in_this_process() {
    let fmu = able();
    let i = fmu.instantiate("it", false).unwrap();
    assert!(fmu.is_apart() && i.is_apart());
    drop(i);
    let here = life(&spring::direct());
    assert_eq!(life(&fmu), here);
    assert_eq!(fmu.complaints(), Vec::<String>::new());
}

#[test]
fn steps_that_are_discarded_or_pend_end_alike() {
    for manners in [1, 2, 3, 5, 7, 8, 9, 10] {
        let tried = |fmu: &Fmu| {
            let mut i = ready(fmu, manners);
            match i.do_step(1.0, 0.5) {
                Ok(()) => format!("done, {:?}", i.log()),
                Err(e) => format!("{e} {:?}", e.call().unwrap()),
            }
        };
        assert_eq!(tried(&able()), tried(&spring::direct()), "{manners}");
    }
    let mut i = ready(&able(), 4);
    i.set_patience(Duration::from_millis(20)).unwrap();
    let e = i.do_step(0.0, 1e-3).unwrap_err();
    assert_eq!(e.status(), Some(Status::Pending));
    assert!(e.to_string().contains("0.02 s, it was cancelled"), "{e}");
}

#[test]
fn fatal_ends_one_instance_and_no_other() {
    let fmu = able();
    let (mut dying, mut other) = (ready(&fmu, 6), ready(&fmu, 0));
    assert_eq!(dying.do_step(0.0, 1e-3).unwrap_err().status(), Some(Status::Fatal));
    assert!(matches!(dying.do_step(0.0, 1e-3), Err(HostError::Use { .. })));
    other.do_step(0.0, 1e-3).unwrap();
}

#[test]
fn what_is_wrong_with_a_binary_is_told_where_it_is_seen() {
    let fmu = apart(&spring::description("", "").replace("5b1c0e5e", "00000000"));
    let e = fmu.instantiate("it", false).unwrap_err().to_string();
    assert!(e.contains("it logged \"GUID {00000000-spring}, not {5b1c0e5e-spring}\""), "{e}");
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("x.fmu");
    let xml = spring::description("", "");
    spring::archive(&path, &[("modelDescription.xml", xml.as_bytes()), ("binaries/linux64/spring.so", b"no library")]);
    let e = Fmu::open_in(&path, &isolation()).unwrap_err().to_string();
    assert!(e.contains("x.fmu: its binary does not load"), "{e}");
}

/// A step of 1 ms from 1 s in two halves, as the coupling of systems makes it.
fn halves(x: f64) -> [Call<'static>; 4] {
    let set = |x: f64| Call::SetReal(vec![0, 1].into(), vec![x, 0.1].into());
    let step = |time: f64| Call::DoStep { time, step: 5e-4 };
    [set(x), step(1.0), set(2.0 * x), step(1.0005)]
}

#[test]
fn calls_together_do_what_they_do_one_by_one() {
    let together = |fmu: &Fmu| {
        let (mut i, mut y) = (ready(fmu, 0), [0.0; 2]);
        i.batch(&halves(0.3), &[2, 3], &mut y).unwrap();
        let slope = Call::SetRealInputDerivatives(vec![0].into(), vec![3.0].into());
        i.batch(&[slope, Call::DoStep { time: 1.001, step: 1e-3 }], &[], &mut []).unwrap();
        [y[0], y[1], i.real(2).unwrap(), i.real(3).unwrap()].map(f64::to_bits)
    };
    let mut i = ready(&able(), 0);
    i.set_real(&[0, 1], &[0.3, 0.1]).unwrap();
    i.do_step(1.0, 5e-4).unwrap();
    i.set_real(&[0, 1], &[0.6, 0.1]).unwrap();
    i.do_step(1.0005, 5e-4).unwrap();
    let y = [i.real(2).unwrap(), i.real(3).unwrap()];
    i.set_real_input_derivatives(&[0], &[1], &[3.0]).unwrap();
    i.do_step(1.001, 1e-3).unwrap();
    let alone = [y[0], y[1], i.real(2).unwrap(), i.real(3).unwrap()].map(f64::to_bits);
    assert_eq!(together(&able()), alone);
    assert_eq!(together(&spring::direct()), alone);
}

#[test]
fn what_fails_among_calls_together_is_named_as_alone() {
    for manners in [1, 2, 3, 7] {
        let tried = |fmu: &Fmu| {
            let e = ready(fmu, manners).batch(&halves(0.3), &[2], &mut [0.0]);
            e.map_err(|e| format!("{e}")).map_err(|e| e.split("; it logged").next().unwrap_or_default().to_string())
        };
        assert_eq!(tried(&able()), tried(&spring::direct()), "{manners}");
    }
    let said = |calls: &[Call], references: &[u32], values: &mut [f64]| {
        ready(&able(), 0).batch(calls, references, values).unwrap_err().to_string()
    };
    assert!(said(&halves(0.3), &[99], &mut [0.0]).contains("fmi2GetReal"));
    assert!(said(&halves(0.3), &[2, 3], &mut [0.0]).contains("2 value references and 1 values"));
    let uneven = Call::SetReal(vec![0, 1].into(), vec![0.3].into());
    assert!(said(&[uneven], &[], &mut []).contains("2 value references and 1 values"));
    let unknown = Call::SetReal(vec![99].into(), vec![0.3].into());
    assert!(said(&[unknown], &[], &mut []).contains("fmi2SetReal"));
}

#[test]
fn our_own_stay_in_this_process_by_their_bytes_and_not_by_their_name() {
    let dir = tempfile::TempDir::new().unwrap();
    let path = pack::into_folder(dir.path(), &[("stiffness".into(), 2e6)]).unwrap();
    let fmu = Fmu::open_in(&path, &isolation()).unwrap();
    assert!(!fmu.is_apart());
    let file = fmu.folder().join("binaries/linux64/HysteresisContact.so");
    let mut library = std::fs::read(file).unwrap();
    // a byte behind everything that is loaded
    library.push(0);
    let xml = std::fs::read(fmu.folder().join("modelDescription.xml")).unwrap();
    spring::archive(&path, &[("modelDescription.xml", &xml), ("binaries/linux64/HysteresisContact.so", &library)]);
    let other = Fmu::open_in(&path, &isolation()).unwrap();
    assert!(other.is_apart());
    let mut i = other.instantiate("it", false).unwrap();
    assert!(i.real(0).is_ok());
}
