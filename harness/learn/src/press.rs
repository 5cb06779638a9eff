//! Recordings of an imposed motion, as the classes see them: depth below a surface, rate, direction, and what came before.

use record::largest;

/// One recording of an imposed motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// s, increasing.
    pub time: Vec<f64>,
    /// Penetration as imposed, m, from wherever its scale has its zero; and its rate, m/s.
    pub depth: Vec<f64>,
    pub rate: Vec<f64>,
    /// Force as read, N.
    pub force: Vec<f64>,
    /// Whether each sample's force counts; empty: all do.
    pub counts: Vec<bool>,
    /// Place in the order in which the recordings were taken.
    pub order: f64,
    /// Index of its level, and the value of that where levels have values.
    pub level: usize,
    pub value: Option<f64>,
}

/// Length of a mean after a motion, share of the time since.
const GROW: f64 = 0.1;
/// Share of the way in by which its time is told, for it may begin and end slowly.
const MIDDLE: f64 = 0.8;
/// Share of a recording's samples, at its start, that may show what the force reads where nothing touches.
const START: usize = 50;
/// Half range of the force there, share of the discrepancy expected, up to which it is at rest.
const AT_REST: f64 = 1.5;

impl Recording {
    /// Means of samples that follow each other, in which a class sees as much as it can explain: each over a share of one of `most` of
    /// the time, or of the way in and back where that is sooner; and where the motion has just ended shorter ones, that grow with the
    /// time since, for what relaxes does so by decades. So a fast way in before a long hold is seen as well as the hold. `most` of
    /// them at a steady rate, some three times as many at most.
    pub fn in_means(&self, most: usize) -> Recording {
        let n = self.time.len();
        if n == 0 {
            return self.clone();
        }
        let share = 1.0 / most.max(1) as f64;
        let lasts = (self.time[n - 1] - self.time[0]) * share;
        let way = 2.0 * record::range(&self.depth) * share;
        let mut starts = vec![0];
        // when the last mean over a way ended, and how long it lasted, s
        let (mut moved, mut within) = (self.time[0], lasts);
        for i in 1..n {
            let from = starts[starts.len() - 1];
            let over = self.time[i] - self.time[from];
            let has_moved = (self.depth[i] - self.depth[from]).abs() >= way;
            if has_moved {
                (moved, within) = (self.time[i], over);
            }
            if has_moved || over >= lasts.min(within.max(GROW * (self.time[from] - moved))) {
                starts.push(i);
            }
        }
        let chunks = || starts.iter().zip(starts.iter().skip(1).chain([&n])).map(|(a, b)| *a..*b);
        let of = |v: &[f64]| chunks().map(|c| v[c.clone()].iter().sum::<f64>() / c.len() as f64).collect();
        Recording {
            time: of(&self.time),
            depth: of(&self.depth),
            rate: of(&self.rate),
            force: of(&self.force),
            counts: if self.counts.is_empty() {
                Vec::new()
            } else {
                chunks().map(|c| self.counts[c].iter().all(|c| *c)).collect()
            },
            ..*self
        }
    }

    /// Duration of the way in, s, by its middle.
    fn way_in(&self) -> f64 {
        let (low, high) = (self.depth.iter().fold(f64::MAX, |m, x| m.min(*x)), highest(&self.depth));
        let at = |share: f64| low + share * (self.depth[high] - low);
        let reached = |share: f64| (0..=high).find(|i| self.depth[*i] >= at(share)).unwrap_or(high);
        let (from, to) = (reached(0.5 - 0.5 * MIDDLE), reached(0.5 + 0.5 * MIDDLE));
        (self.time[to] - self.time[from]).max(self.time[1] - self.time[0]) / MIDDLE
    }

    /// Whether the force of the sample `i` counts.
    pub fn counts(&self, i: usize) -> bool {
        self.counts.get(i).is_none_or(|c| *c)
    }

    /// The force read at the start, N, sorted.
    fn start(&self) -> Vec<f64> {
        let n = (self.force.len() / START).max(4).min(self.force.len());
        let mut start = self.force[..n].to_vec();
        start.sort_by(f64::total_cmp);
        start
    }

    /// What the force reads where nothing touches, N: at the start where it is at rest there, within `small` N; else 0.
    pub fn rest(&self, small: f64) -> f64 {
        let start = self.start();
        match (start.first(), start.last()) {
            (Some(a), Some(b)) if b - a < 2.0 * AT_REST * small => start[start.len() / 2],
            _ => 0.0,
        }
    }

    /// The same with the force over its rest divided by `factor`; `small`: share of its range by which a law of contact is off.
    pub(crate) fn over(&self, factor: f64, small: f64) -> Recording {
        let rest = self.rest(small * record::range(&self.force));
        Recording { force: self.force.iter().map(|f| rest + (f - rest) / factor).collect(), ..self.clone() }
    }

    /// Where the surface may be, m, each by another rule: around where the force leaves what it is at rest, at the scale's
    /// zero, and at the first sample. The same rule in the same place for every recording.
    pub fn surfaces(&self) -> Vec<f64> {
        let start = self.start();
        let away: Vec<f64> = self.force.iter().map(|f| f - start[start.len() / 2]).collect();
        let (top, most) = (highest(&away), largest(&away));
        // the last sample on the way in at which the force is still small
        let last_below = |share: f64| {
            let i = (0..=top).rev().find(|i| away[*i] < share * most);
            self.depth[i.unwrap_or(0)]
        };
        let (low, high) = (last_below(0.005), last_below(0.1));
        let step = (high - low).max(0.0);
        let moves = away.iter().position(|v| v.abs() > 0.02 * most).unwrap_or(0).saturating_sub(1);
        let around = [-0.5, -0.2, 0.0, 0.2, 0.5, 0.8].map(|w| low + w * step);
        around.into_iter().chain([0.0, self.depth[0], self.depth[moves]]).collect()
    }
}

/// What all recordings of a campaign have in common, for shapes without units.
#[derive(Clone, Debug, PartialEq)]
pub struct Press {
    /// Largest depth below the surface, m; range of the force, N; largest rate, m/s.
    pub depth: f64,
    pub force: f64,
    pub rate: f64,
    /// Duration of the fastest way in and back, which is twice the way in, and of the longest recording, s.
    pub lasts: (f64, f64),
    /// Depths, share of `depth`, between which the contact pulls while it is left; None where no force is below rest by more
    /// than a law of contact is off.
    pub pull: Option<(f64, f64)>,
    /// First and last place in the order.
    pub orders: (f64, f64),
    /// Levels, each once; their least value and their largest, where they have values that differ.
    pub levels: Vec<usize>,
    pub values: Option<(f64, f64)>,
}

/// Share of the range of force below which a contact is being left.
const LEFT: f64 = 0.05;

impl Press {
    /// Of recordings with their `surfaces`, m; a force counts as a pull where it is below rest by more than `small` of the range.
    /// None where nothing is deeper than the surface, or no force was read.
    pub fn of(recordings: &[Recording], surfaces: &[f64], small: f64) -> Option<Press> {
        let force = recordings.iter().map(|r| record::range(&r.force)).fold(0.0, f64::max);
        let deepest = |(r, s): (&Recording, &f64)| r.depth.iter().fold(f64::MIN, |m, x| m.max(x - s));
        let depth = recordings.iter().zip(surfaces).map(deepest).fold(f64::MIN, f64::max);
        let rate = recordings.iter().map(|r| largest(&r.rate)).fold(0.0, f64::max);
        if !(depth > 0.0 && force > 0.0 && rate > 0.0) {
            return None;
        }
        let way = recordings.iter().map(|r| 2.0 * r.way_in()).fold(f64::MAX, f64::min);
        let longest = recordings.iter().map(|r| r.time[r.time.len() - 1] - r.time[0]).fold(f64::MIN, f64::max);
        let lasts = (way.min(longest), longest);
        let mut pull: Option<(f64, f64)> = None;
        for (r, surface) in recordings.iter().zip(surfaces) {
            let rest = r.rest(small * force);
            let pulls: Vec<f64> =
                (0..r.force.len()).filter(|i| r.force[*i] - rest < -small * force).map(|i| r.depth[i]).collect();
            let Some(low) = pulls.iter().copied().reduce(f64::min) else { continue };
            let leaves = (highest(&r.force)..r.force.len()).find(|i| r.force[*i] - rest < LEFT * force);
            let high = leaves.map_or(low, |i| r.depth[i]).max(low);
            let (a, b) = ((low - surface) / depth, (high - surface) / depth);
            pull = Some(pull.map_or((a, b), |p| (p.0.min(a), p.1.max(b))));
        }
        let orders = recordings.iter().map(|r| r.order).fold((f64::MAX, f64::MIN), |(a, b), o| (a.min(o), b.max(o)));
        let mut levels: Vec<usize> = recordings.iter().map(|r| r.level).collect();
        levels.sort_unstable();
        levels.dedup();
        let values: Option<Vec<f64>> = recordings.iter().map(|r| r.value).collect();
        let ends = |v: Vec<f64>| v.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
        let values = values.map(ends).filter(|(a, b)| b > a);
        Some(Press { depth, force, rate, lasts, pull, orders, levels, values })
    }
}

impl Press {
    /// Where `order` lies from the first place to the last, 0 to 1; 0 of a single one.
    pub(crate) fn place_in_order(&self, order: f64) -> f64 {
        let (first, last) = self.orders;
        if last > first {
            (order - first) / (last - first)
        } else {
            0.0
        }
    }
}

/// Index of the largest of these, the last of several; 0 where there are none.
pub fn highest(y: &[f64]) -> usize {
    (0..y.len()).max_by(|a, b| y[*a].total_cmp(&y[*b])).unwrap_or(0)
}

/// A recording's motion without units, sample by sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// s.
    pub time: Vec<f64>,
    /// Depth below the surface, share of the largest; negative above.
    pub x: Vec<f64>,
    /// Rate, share of the largest.
    pub v: Vec<f64>,
    /// Direction, -1 to 1; 0 at rest.
    pub sign: Vec<f64>,
    /// Deepest so far.
    pub deepest: Vec<f64>,
    /// Whether its deepest point has been passed.
    pub leaving: Vec<bool>,
    /// Place in the order, 0 to 1; index of the level, and its value from the least to the largest, 0 to 1, or beyond them by the
    /// same way at most.
    pub order: f64,
    pub level: usize,
    pub value: f64,
}

/// Share of a recording's largest rate over which its direction turns.
const TURNS: f64 = 0.03;

impl Path {
    /// Of a recording whose surface is at `surface`, m.
    pub fn of(r: &Recording, surface: f64, press: &Press) -> Path {
        let x: Vec<f64> = r.depth.iter().map(|x| (x - surface) / press.depth).collect();
        let fastest = largest(&r.rate).max(f64::MIN_POSITIVE);
        let top = highest(&x);
        let mut so_far = 0.0f64;
        Path {
            time: r.time.clone(),
            v: r.rate.iter().map(|v| v / press.rate).collect(),
            sign: r.rate.iter().map(|v| (v / (TURNS * fastest)).tanh()).collect(),
            deepest: x
                .iter()
                .map(|x| {
                    so_far = so_far.max(*x);
                    so_far
                })
                .collect(),
            leaving: (0..x.len()).map(|i| i > top).collect(),
            order: press.place_in_order(r.order),
            level: r.level,
            value: match (press.values, r.value) {
                (Some((least, most)), Some(v)) => ((v - least) / (most - least)).clamp(-1.0, 2.0),
                _ => 0.0,
            },
            x,
        }
    }

    /// Depth below the surface, 0 above.
    pub fn below(&self, i: usize) -> f64 {
        self.x[i].max(0.0)
    }

    /// A shape that remembers, sample after sample.
    pub fn each_in_turn(&self, of: impl FnMut(usize) -> f64) -> Vec<f64> {
        (0..self.x.len()).map(of).collect()
    }

    /// A shape, sample by sample.
    pub fn each(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.x.len()).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(force: impl Fn(f64) -> f64) -> Recording {
        let time: Vec<f64> = (0..400).map(f64::from).collect();
        let depth: Vec<f64> = time.iter().map(|t| 1e-3 * (1.0 - (t - 200.0).abs() / 150.0)).collect();
        let rate = time.iter().map(|t| if *t < 200.0 { 1e-3 / 150.0 } else { -1e-3 / 150.0 }).collect();
        Recording {
            force: depth.iter().map(|x| force(*x)).collect(),
            time,
            depth,
            rate,
            counts: Vec::new(),
            order: 1.0,
            level: 0,
            value: None,
        }
    }

    #[test]
    fn one_of_the_surfaces_tried_is_where_the_force_begins() {
        let r = triangle(|x| 0.2 + 5e4 * (x - 2e-4).max(0.0));
        let nearest = r.surfaces().iter().map(|s| (s - 2e-4).abs()).fold(f64::MAX, f64::min);
        assert!(nearest < 1e-5, "{nearest}");
        assert!((r.rest(0.01) - 0.2).abs() < 1e-12);
        // pressed from the first sample on there is no rest to read
        let pressed = triangle(|x| 1e3 * (x + 1e-3));
        assert_eq!(pressed.rest(1e-4), 0.0);
    }

    #[test]
    fn a_pull_is_seen_where_the_force_is_below_rest_and_nowhere_else() {
        let none = triangle(|x| 5e4 * x.max(0.0));
        let of = |r: &Recording| Press::of(std::slice::from_ref(r), &[0.0], 0.01).unwrap().pull;
        assert_eq!(of(&none), None);
        let mut pulls = none.clone();
        for i in 300..370 {
            pulls.force[i] -= 5.0;
        }
        let (low, high) = of(&pulls).unwrap();
        assert!(low < 0.0 && low > -0.2 && high > 0.0 && high < 0.4, "{low} {high}");
    }

    #[test]
    fn in_means_a_recording_keeps_its_course() {
        let r = triangle(|x| 5e4 * x.max(0.0));
        let m = r.in_means(100);
        assert_eq!(m.time.len(), 100);
        assert!((m.force[40] - r.force[160..164].iter().sum::<f64>() / 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_fast_way_in_before_a_long_hold_keeps_its_course_in_means() {
        // 100 samples of way, then 20 times as many of hold
        let n = 2100;
        let way = |i: usize| 1e-3 * i.min(100) as f64 / 100.0;
        let depth: Vec<f64> = (0..n).map(way).collect();
        let r = Recording {
            force: depth.iter().map(|x| 1e4 * x).collect(),
            time: (0..n).map(|i| i as f64).collect(),
            rate: (0..n).map(|i| if i < 100 { 1e-5 } else { 0.0 }).collect(),
            depth,
            counts: vec![true; n],
            order: 1.0,
            level: 0,
            value: None,
        };
        let m = r.in_means(100);
        // before, the way in was 5 of them
        let on_the_way = m.rate.iter().filter(|v| **v > 5e-6).count();
        assert!(on_the_way >= 30 && m.time.len() <= 200, "{on_the_way} of {}", m.time.len());
        assert!((r.way_in() - 100.0).abs() < 2.0, "{}", r.way_in());
        assert_eq!(m.counts.len(), m.time.len());
    }
}
