//! An FMU in a process of its own does what it does in this one.
#![cfg(target_os = "linux")]

use crate::spring;
use host::{Fmu, HostError, Instance, Isolation, Limits, Status};
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
