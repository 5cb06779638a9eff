//! Order, loops, time and convergence, on slaves with closed forms.

use crate::slaves::{Model, Toy};
use host::master::{run, Adapt, Inputs, Method, Network, Options, Shape, Touch};

fn network(parts: Vec<host::master::Part>) -> (Network, Vec<f64>) {
    let mut n = Network::new(parts).unwrap();
    let mut y = vec![0.0; n.count()];
    n.propagate(&mut y).unwrap();
    (n, y)
}

/// x' = -x as an integrator fed by a gain of -1; outputs: gain, x.
fn decay() -> (Network, Vec<f64>) {
    network(vec![Toy::new(Model::Gain(-1.0, 0.0)).part("minus", 1), Toy::new(Model::Integrator(1.0)).part("x", 0)])
}

/// x'' = -x; outputs: minus x, v, x.
fn swing() -> (Network, Vec<f64>) {
    network(vec![
        Toy::new(Model::Gain(-1.0, 0.0)).part("minus", 2),
        Toy::new(Model::Integrator(0.0)).part("v", 0),
        Toy::new(Model::Integrator(1.0)).part("x", 1),
    ])
}

fn end(make: fn() -> (Network, Vec<f64>), o: &Options, output: usize) -> f64 {
    let (mut n, y) = make();
    let mut last = f64::NAN;
    run(&mut n, o, y, &mut |_, m| {
        last = m.y[output];
        Ok(true)
    })
    .unwrap();
    last
}

#[test]
fn parts_that_feed_through_are_stepped_after_what_feeds_them_however_they_are_listed() {
    let (n, _) = decay();
    assert_eq!(n.stepping_order(), ["x", "minus"]);
    let chain = vec![
        Toy::new(Model::Gain(2.0, 0.0)).part("c", 1),
        Toy::new(Model::Gain(3.0, 0.0)).part("b", 2),
        Toy::new(Model::Integrator(5.0)).part("a", 2),
    ];
    let (n, y) = network(chain);
    assert_eq!(n.stepping_order(), ["a", "b", "c"]);
    assert_eq!(y, [30.0, 15.0, 5.0]);
    assert!(n.loops().is_empty());
}

#[test]
fn algebraic_loops_are_found_and_solved_or_named() {
    // y = 0.5 z + 1, z = 3 y: y = -2, z = -6
    let (n, y) =
        network(vec![Toy::new(Model::Gain(0.5, 1.0)).part("a", 1), Toy::new(Model::Gain(3.0, 0.0)).part("b", 0)]);
    assert_eq!(n.loops(), [["a.y", "b.y"]]);
    assert!((y[0] + 2.0).abs() < 1e-12 && (y[1] + 6.0).abs() < 1e-12, "{y:?}");
    // y = z^2 - 2, z = y: one of its two roots, 2 or -1
    let (_, y) = network(vec![Toy::new(Model::Square(2.0)).part("a", 1), Toy::new(Model::Gain(1.0, 0.0)).part("b", 0)]);
    assert!((y[0] * y[0] - y[0] - 2.0).abs() < 1e-9, "{y:?}");
    // y = z^2 + 1, z = y: none
    let mut n =
        Network::new(vec![Toy::new(Model::Square(-1.0)).part("a", 1), Toy::new(Model::Gain(1.0, 0.0)).part("b", 0)])
            .unwrap();
    let e = n.propagate(&mut [0.0, 0.0]).unwrap_err().to_string();
    assert!(e.contains("a.y, b.y"), "{e}");
    // y = z, z = y: any
    let mut n =
        Network::new(vec![Toy::new(Model::Gain(1.0, 1.0)).part("a", 1), Toy::new(Model::Gain(1.0, 0.0)).part("b", 0)])
            .unwrap();
    let e = n.propagate(&mut [0.0, 0.0]).unwrap_err().to_string();
    assert!(e.contains("singular") && e.contains("a.y, b.y"), "{e}");
}

#[test]
fn a_loop_by_declaration_alone_is_answered_however_far_apart_its_sizes_are() {
    // a body 0.1 mm inside a stop that declares no dependencies: its position does not answer to the force
    let mut x = Toy::new(Model::Integrator(1e-4)).part("x", 1);
    x.outputs[0].depends = vec![0];
    let (n, y) = network(vec![x, Toy::new(Model::Power(1e7, 1.2)).part("force", 0)]);
    assert_eq!(n.loops(), [["x.y", "force.y"]]);
    assert_eq!(y, [1e-4, 1e7 * 1e-4f64.powf(1.2)]);
}

#[test]
fn errors_fall_with_the_order_each_master_has() {
    let exact = (-1.0f64).exp();
    let error = |method, inputs, shape, n: f64| {
        let o = Options { method, inputs, shape, step: 1.0 / n, stop: 1.0, ..Options::default() };
        (end(decay, &o, 1) - exact).abs()
    };
    use Inputs::{Extrapolated, Held};
    for (method, inputs, shape, order) in [
        (Method::GaussSeidel, Held, Shape::Mean, 1.0),
        (Method::Jacobi, Held, Shape::Mean, 1.0),
        (Method::GaussSeidel, Extrapolated, Shape::Mean, 2.0),
        (Method::Implicit, Held, Shape::Mean, 2.0),
        (Method::Iterated, Held, Shape::Mean, 2.0),
        (Method::Iterated, Held, Shape::Linear, 2.0),
    ] {
        let (coarse, fine) = (error(method, inputs, shape, 50.0), error(method, inputs, shape, 100.0));
        let seen = (coarse / fine).log2();
        assert!((seen - order).abs() < 0.15, "{method:?} {inputs:?} {shape:?}: order {seen}");
    }
}

#[test]
fn an_implicit_or_iterated_mean_neither_gains_nor_loses_energy() {
    for method in [Method::Implicit, Method::Iterated] {
        let o = Options { method, shape: Shape::Mean, step: 0.5, stop: 500.0, ..Options::default() };
        let (mut n, y) = swing();
        let mut worst = 0.0f64;
        run(&mut n, &o, y, &mut |_, m| {
            worst = worst.max((m.y[1] * m.y[1] + m.y[2] * m.y[2] - 1.0).abs());
            Ok(true)
        })
        .unwrap();
        assert!(worst < 1e-6, "{method:?} {worst}");
    }
}

#[test]
fn an_input_that_is_held_is_neither_extrapolated_nor_iterated_for() {
    let held = || {
        let mut parts =
            vec![Toy::new(Model::Gain(-1.0, 0.0)).part("minus", 1), Toy::new(Model::Integrator(1.0)).part("x", 0)];
        parts[1].inputs[0].held = true;
        network(parts)
    };
    // Euler's method, whatever the master
    let euler = 0.9f64.powi(10);
    for (method, inputs) in [
        (Method::GaussSeidel, Inputs::Held),
        (Method::GaussSeidel, Inputs::Extrapolated),
        (Method::Implicit, Inputs::Held),
        (Method::Iterated, Inputs::Held),
    ] {
        let o = Options { method, inputs, step: 0.1, stop: 1.0, ..Options::default() };
        let x = end(held, &o, 1);
        assert!((x - euler).abs() < 1e-12, "{method:?} {inputs:?}: {x}");
    }
}

#[test]
fn doubling_meets_its_tolerance_and_refuses_the_impossible() {
    let exact = (-1.0f64).exp();
    for (tolerance, within) in [(1e-4, 1e-2), (1e-8, 1e-6)] {
        let o = Options {
            method: Method::Iterated,
            shape: Shape::Linear,
            step: 0.5,
            stop: 1.0,
            adapt: Some(Adapt::Doubling { tolerance }),
            ..Options::default()
        };
        let e = (end(decay, &o, 1) - exact).abs();
        assert!(e < within, "{tolerance}: {e}");
    }
    let o =
        Options { shortest: 0.1, step: 0.5, adapt: Some(Adapt::Doubling { tolerance: 1e-12 }), ..Options::default() };
    let (mut n, y) = decay();
    let e = run(&mut n, &o, y, &mut |_, _| Ok(true)).unwrap_err().to_string();
    assert!(e.contains("do not meet the tolerance"), "{e}");
}

#[test]
fn time_is_i_h_to_the_last_bit_after_a_million_steps() {
    let (mut n, y) = decay();
    let o = Options { step: 1e-3, stop: 1000.0, ..Options::default() };
    let (mut i, mut off) = (0u64, 0u64);
    let done = run(&mut n, &o, y, &mut |_, m| {
        off += u64::from(m.time != i as f64 * 1e-3);
        i += 1;
        Ok(true)
    })
    .unwrap();
    assert_eq!((done.steps, off, done.time), (1_000_000, 0, 1_000_000.0 * 1e-3));
}

#[test]
fn a_touch_is_landed_on_and_no_step_straddles_it() {
    // x = cos t passes 0.3 at acos 0.3 and, rising, at 2 pi - acos 0.3
    let (mut n, y) = swing();
    let o = Options {
        method: Method::Iterated,
        shape: Shape::Linear,
        step: 0.01,
        stop: 6.0,
        touches: vec![Touch { output: 2, level: 0.3 }],
        ..Options::default()
    };
    let mut landed = Vec::new();
    let done = run(&mut n, &o, y, &mut |_, m| {
        if m.touch {
            landed.push(m.y[2]);
        }
        Ok(true)
    })
    .unwrap();
    let first = 0.3f64.acos();
    assert_eq!(done.touches.len(), 2);
    assert!((done.touches[0] - first).abs() < 2e-5 && (done.touches[1] - (std::f64::consts::TAU - first)).abs() < 1e-4);
    assert!(landed.iter().all(|x| (x - 0.3).abs() < 1e-11), "{landed:?}");
}

#[test]
fn a_slave_that_cannot_is_named_with_the_way_out() {
    let mut toy = Toy::new(Model::Integrator(1.0));
    toy.able.rollback = false;
    let (mut n, y) = network(vec![toy.part("stiff", 0)]);
    let o = Options { method: Method::Iterated, ..Options::default() };
    let e = run(&mut n, &o, y, &mut |_, _| Ok(true)).unwrap_err().to_string();
    assert!(e.contains("stiff") && e.contains("canGetAndSetFMUstate") && e.contains("gauss-seidel"), "{e}");
}

#[test]
fn a_run_that_is_stopped_says_so_and_how_far_it_came() {
    let (mut n, y) = decay();
    let o = Options { step: 0.1, stop: 1.0, ..Options::default() };
    let done = run(&mut n, &o, y, &mut |_, m| Ok(m.time < 0.45)).unwrap();
    assert!(done.interrupted && (done.time - 0.5).abs() < 1e-12);
}
