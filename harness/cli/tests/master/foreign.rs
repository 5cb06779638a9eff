//! Somebody else's FMU, in C and in millimetres, beside our bar.

#[allow(dead_code)]
#[path = "../host/spring.rs"]
mod spring;

use host::master::{build, export_ssp, run, System};
use std::path::Path;

/// The bar of 1 kg at 0.5 m/s against a spring of 2000 N/m: a sine.
fn system(folder: &Path, output: &str, master: &str) -> System {
    spring::write(folder, &spring::description(spring::ALL, output));
    let path = folder.join("system.toml");
    let text = format!(
        r#"
[[fmu]]
name = "spring"
file = "spring.fmu"
[fmu.set]
rate = 2000
label = "soft"
direct = {}
[[fmu]]
name = "bar"
file = "touchdown:moving-bar"
[fmu.set]
start_velocity = 0.5
[[connect]]
from = "bar.penetration"
to = "spring.depth"
[[connect]]
from = "bar.velocity"
to = "spring.speed"
[[connect]]
from = "spring.push"
to = "bar.force"
[master]
{master}
"#,
        output.contains('1')
    );
    std::fs::write(&path, text).unwrap();
    System::load(&path).unwrap()
}

/// Largest departure of the bar from its sine, m, whose height is 11 mm.
fn off(s: &System) -> f64 {
    let mut b = build(s).unwrap();
    let w = 2000.0f64.sqrt();
    let bar = b.network.parts.iter().position(|p| p.name == "bar").unwrap();
    let mut worst = 0.0f64;
    run(&mut b.network, &b.options, b.start, &mut |n, m| {
        let x = n.parts[bar].slave.read(host::Kind::Real, 1)?;
        worst = worst.max((x - 0.5 / w * (w * m.time).sin()).abs());
        Ok(true)
    })
    .unwrap();
    worst
}

#[test]
fn metres_become_millimetres_and_the_step_is_what_the_fmu_prefers() {
    let folder = tempfile::tempdir().unwrap();
    for output in [r#"dependencies="1 2""#, r#"dependencies="""#] {
        let s = system(folder.path(), output, "method = \"iterated\"\nshape = \"linear\"\nstop = 0.1");
        let b = build(&s).unwrap();
        assert_eq!(b.options.step, 1e-5, "the bar prefers the shorter one");
        assert!(b.notes.is_empty(), "{:?}", b.notes);
        drop(b);
        assert!(off(&s) < 1e-8, "{}", off(&s));
    }
}

#[test]
fn every_master_comes_near_and_the_better_ones_nearer() {
    let folder = tempfile::tempdir().unwrap();
    let at = |master: &str| {
        let s = system(folder.path(), r#"dependencies="1 2""#, &format!("{master}\nstep = 2e-4\nstop = 0.14"));
        off(&s)
    };
    let plain = at("method = \"gauss-seidel\"");
    let parallel = at("method = \"jacobi\"");
    let implicit = at("method = \"implicit\"");
    assert!(plain < 5e-4 && parallel < 2e-3 && plain < parallel, "{plain} {parallel}");
    assert!(implicit < 0.02 * plain, "{implicit} {plain}");
    for inputs in ["gauss-seidel", "jacobi"] {
        let better = at(&format!("method = \"{inputs}\"\ninputs = \"extrapolated\""));
        assert!(better < 0.1 * plain, "{inputs} {better}");
    }
}

#[test]
fn an_archive_keeps_the_values_of_an_fmu_that_is_not_ours() {
    let folder = tempfile::tempdir().unwrap();
    let s = system(folder.path(), r#"dependencies="1 2""#, "step = 1e-4\nstop = 0.05");
    let ssp = folder.path().join("x.ssp");
    export_ssp(&s, &ssp).unwrap();
    let again = System::load(&ssp).unwrap();
    assert_eq!(off(&again), off(&s));
    assert!(off(&again) < 1e-3);
}
