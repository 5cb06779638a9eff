//! What rings on after the contact: the strongest line of a channel once the body has left.

use crate::problem::Data;
use record::Channel;
use std::f64::consts::PI;

/// Times the middle power of all frequencies from which a line stands out.
const STANDS_OUT: f64 = 40.0;
/// Samples a flight has to have.
const LEAST: usize = 40;

/// Angular frequency of the strongest line of `channel` in the flights after the first contact, rad/s, pooled over
/// the recordings (Schuster 1898's periodogram); None where none stands out of the noise.
pub fn line(data: &Data, channel: Channel) -> Option<f64> {
    let dt = data.scales.dt;
    let flights: Vec<(Vec<f64>, f64)> = data
        .records
        .iter()
        .filter_map(|r| {
            let y = r.y[channel.index()].as_ref()?;
            let top = (0..y.len()).max_by(|a, b| y[*a].abs().total_cmp(&y[*b].abs()))?;
            let peak = y[top].abs();
            let from = (top..y.len()).find(|i| y[*i].abs() < 0.02 * peak)?;
            // a line that dies out is clearest while it is young
            let most = (4.0 * data.scales.duration / dt) as usize;
            let flight = &y[from..(from + most.max(LEAST)).min(y.len())];
            if flight.len() < LEAST || peak.is_nan() || peak <= 0.0 {
                return None;
            }
            let mean = flight.iter().sum::<f64>() / flight.len() as f64;
            Some((flight.iter().map(|v| (v - mean) / peak).collect(), dt))
        })
        .collect();
    let longest = flights.iter().map(|f| f.0.len()).max()?;
    // from two periods a flight to the highest frequency sampled, two steps a natural width
    let step = PI / longest as f64;
    let powers: Vec<(f64, f64)> = (8..longest)
        .map(|k| {
            let w = step * k as f64;
            let power = flights
                .iter()
                .map(|(f, _)| {
                    let (mut c, mut s) = (0.0, 0.0);
                    for (i, v) in f.iter().enumerate() {
                        let (b, a) = (w * i as f64).sin_cos();
                        c += v * a;
                        s += v * b;
                    }
                    (c * c + s * s) / f.len() as f64
                })
                .sum();
            (w / dt, power)
        })
        .collect();
    let mut sorted: Vec<f64> = powers.iter().map(|p| p.1).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = *sorted.get(sorted.len() / 2)?;
    let best = powers.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 > STANDS_OUT * middle).then_some(best.0)
}

#[cfg(test)]
mod tests {
    use crate::problem::Data;
    use plant::simulate::Setup;
    use rand::{RngExt, SeedableRng};
    use record::Channel;

    fn data(ringing: f64) -> Data {
        let (n, dt, w) = (600, 1e-5, 9000.0);
        let time: Vec<f64> = (0..n).map(|i| i as f64 * dt).collect();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        // a pulse of 1 ms, then what rings on, and noise
        let y: Vec<f64> = time
            .iter()
            .map(|t| {
                let pulse = if *t < 1e-3 { (std::f64::consts::PI * t / 1e-3).sin() } else { 0.0 };
                let rings = if *t < 1e-3 { 0.0 } else { (-300.0 * t).exp() * (w * t).sin() };
                pulse + ringing * rings + 2e-3 * (rng.random::<f64>() - 0.5)
            })
            .collect();
        let setup = Setup::drop_test(time, 1e-3, 1.0, 1e-3);
        Data::of_force(setup, 1.0, 1.0, y)
    }

    #[test]
    fn finds_what_rings_and_nothing_where_nothing_does() {
        let w = super::line(&data(0.05), Channel::Force).unwrap();
        assert!((w / 9000.0 - 1.0).abs() < 0.05, "{w}");
        assert_eq!(super::line(&data(0.0), Channel::Force), None);
        assert_eq!(super::line(&data(0.05), Channel::Acceleration), None);
    }
}
