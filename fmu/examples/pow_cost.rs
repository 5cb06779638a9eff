//! What the power function of the law costs beside the platform's pow, an exponent each.
//!
//! `cargo run --release --example pow_cost -p touchdown-fmu`

#![allow(clippy::incompatible_msrv)] // black_box is of 1.66: examples are built by today's compiler only

use hysteresis_contact::law::elementary::pow;
use std::hint::black_box;
use std::time::Instant;

/// Nanoseconds a call, the least of several rounds; every call waits for the one before (`chained`) or not.
fn cost(chained: bool, xs: &[f64], p: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let mut least = f64::INFINITY;
    let mut kept = 0.0;
    for _ in 0..15 {
        let start = Instant::now();
        for _ in 0..20 {
            for &x in xs {
                // 0 times the last result changes nothing, but has to be known first
                let y = f(if chained { x + 0.0 * kept } else { x }, black_box(p));
                kept = if chained { y } else { kept + y };
            }
        }
        least = least.min(start.elapsed().as_secs_f64());
        black_box(kept);
    }
    least * 1e9 / (20 * xs.len()) as f64
}

fn main() {
    let mut state = 88172645463325252u64;
    let xs: Vec<f64> = (0..4096)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            // penetrations, 1e-6 to 1e-2 m, and a few near 1
            10f64.powf(-6.0 + 4.0 * (state >> 11) as f64 / 9007199254740992.0)
        })
        .collect();
    println!("ns a call: one after another, and independent; ratio = ours/platform's");
    println!(
        "{:>8} {:>8} {:>8} {:>6}   {:>8} {:>8} {:>6}",
        "p", "ours", "platform", "ratio", "ours", "platform", "ratio"
    );
    for p in [1.0, 1.5, 2.0, 3.0, 0.5, 2.5, 3.5, 4.0, 1.1, 1.96, 2.2, 2.79, 5.0] {
        let r: Vec<f64> = [true, false]
            .iter()
            .flat_map(|&c| {
                let (ours, theirs) = (cost(c, &xs, p, pow), cost(c, &xs, p, f64::powf));
                vec![ours, theirs, ours / theirs]
            })
            .collect();
        println!("{p:>8} {:>8.2} {:>8.2} {:>6.2}   {:>8.2} {:>8.2} {:>6.2}", r[0], r[1], r[2], r[3], r[4], r[5]);
    }
}
