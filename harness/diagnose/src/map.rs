//! Where the misfit sits: level by phase by channel, in multiples of noise.

use super::phases::phases;
use estimate::fitted::Fitted;
use plant::simulate::Trace;
use record::Channel;

/// Lengths, in samples, over which a misfit may add up before it is compared with noise.
const BLOCKS: [usize; 3] = [1, 5, 24];

/// One cell of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Index into `Campaign::levels`.
    pub level: usize,
    /// Index into `phases::PHASES`.
    pub phase: usize,
    pub channel: Channel,
    /// Misfit over noise (1: noise alone) without and with the mechanisms found.
    pub before: f64,
    pub after: f64,
    /// Fall of chi^2 that this cell contributes.
    pub gain: f64,
    /// Samples in the cell.
    pub samples: usize,
}

/// Sums over blocks of one cell: for each block length the sum of squared block sums over length, and the count.
#[derive(Clone, Copy, Default)]
struct Sums {
    over: [(f64, f64); 3],
    chi2: f64,
    samples: usize,
}

impl Sums {
    fn add(&mut self, w: &[f64]) {
        self.samples += w.len();
        self.chi2 += w.iter().map(|v| v * v).sum::<f64>();
        for (b, o) in BLOCKS.iter().zip(&mut self.over) {
            for part in w.chunks_exact(*b) {
                let m: f64 = part.iter().sum();
                o.0 += m * m / *b as f64;
                o.1 += 1.0;
            }
        }
    }
    fn misfit(&self) -> f64 {
        // a length counts from four blocks on: fewer say little
        self.over.iter().filter(|o| o.1 >= 4.0).map(|o| (o.0 / o.1).sqrt()).fold(0.0, f64::max)
    }
}

/// The map of a campaign: `base` before, `chosen` after; cells without samples are left out.
pub fn map(base: &Fitted, chosen: &Fitted) -> Vec<Cell> {
    let data = &base.data;
    let levels = data.records.iter().map(|r| r.level).max().unwrap_or(0) + 1;
    let sums = |c: &Fitted, frame: Option<&[Trace]>| -> Option<(Vec<Sums>, Vec<Trace>)> {
        let problem = c.problem();
        let mut cells = vec![Sums::default(); levels * 12];
        let mut traces = Vec::new();
        for (r, rec) in data.records.iter().enumerate() {
            let (trace, w) = problem.residual(&c.fit.point, r)?;
            // one set of phases for both, so that cells hold the same samples
            let frame = frame.map_or(&trace, |f| &f[r]);
            let phases = phases(frame, data);
            for (ch, w) in data.compared(r).map(Channel::index).zip(w.chunks(phases.len())) {
                for p in 0..4 {
                    let own: Vec<f64> = w.iter().zip(&phases).filter(|(_, q)| **q == p).map(|(w, _)| *w).collect();
                    cells[(rec.level * 4 + p) * 3 + ch].add(&own);
                }
            }
            traces.push(trace);
        }
        Some((cells, traces))
    };
    let Some((after, frame)) = sums(chosen, None) else { return Vec::new() };
    let Some((before, _)) = sums(base, Some(&frame)) else { return Vec::new() };
    let mut out = Vec::new();
    for (i, (b, a)) in before.iter().zip(&after).enumerate() {
        if b.samples >= 8 {
            out.push(Cell {
                level: i / 12,
                phase: i / 3 % 4,
                channel: Channel::ALL[i % 3],
                before: b.misfit(),
                after: a.misfit(),
                gain: b.chi2 - a.chi2,
                samples: b.samples,
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_misfit_far_below_the_noise_shows_in_long_blocks() {
        let noise = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let mut quiet = Sums::default();
        quiet.add(&(0..480).map(noise).collect::<Vec<f64>>());
        let mut slow = Sums::default();
        slow.add(&(0..480).map(|i| noise(i) + 0.6).collect::<Vec<f64>>());
        assert!((quiet.misfit() - 1.0).abs() < 1e-12);
        assert!(slow.misfit() > 2.5, "{}", slow.misfit());
    }
}
