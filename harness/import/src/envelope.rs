//! A course of samples of any length in a bounded number of stretches: their extremes, means and scatter.

/// Most buckets that are kept; where more come, neighbours are joined.
const MOST: usize = 1 << 15;

/// What is known of the samples of a bucket.
#[derive(Clone, Copy, Debug)]
pub struct Bucket {
    pub low: f64,
    pub high: f64,
    /// The least that three samples in a row reach together, downwards and upwards: spikes of one or two do not show.
    pub low3: f64,
    pub high3: f64,
    count: f64,
    pub mean: f64,
    /// Sum of squared distances from the mean.
    squares: f64,
}

impl Bucket {
    const EMPTY: Bucket = Bucket {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        low3: f64::INFINITY,
        high3: f64::NEG_INFINITY,
        count: 0.0,
        mean: 0.0,
        squares: 0.0,
    };

    fn join(self, b: Bucket) -> Bucket {
        let count = self.count + b.count;
        let step = b.mean - self.mean;
        let share = if count > 0.0 { b.count / count } else { 0.0 };
        Bucket {
            low: self.low.min(b.low),
            high: self.high.max(b.high),
            low3: self.low3.min(b.low3),
            high3: self.high3.max(b.high3),
            count,
            mean: self.mean + share * step,
            squares: self.squares + b.squares + step * step * self.count * share,
        }
    }

    /// Whether it holds samples.
    pub fn holds(&self) -> bool {
        self.count > 0.0
    }

    /// Standard deviation of its samples.
    pub fn scatter(&self) -> f64 {
        (self.squares / (self.count - 1.0).max(1.0)).sqrt()
    }
}

/// Buckets of one channel.
#[derive(Clone, Debug, Default)]
struct Course {
    buckets: Vec<Bucket>,
    last: Option<[f64; 2]>,
}

/// The courses of channels sampled together, and their time.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Rows in a bucket.
    pub rows: u64,
    filled: u64,
    added: u64,
    /// Time of the first row of each bucket, s.
    pub times: Vec<f64>,
    courses: [Option<Course>; 3],
}

impl Envelope {
    /// An empty one of the channels that are there.
    pub fn new(has: [bool; 3]) -> Envelope {
        Envelope { rows: 1, filled: 0, added: 0, times: Vec::new(), courses: has.map(|h| h.then(Course::default)) }
    }

    /// Adds a row; a row with a sample missing takes its place and says nothing.
    pub fn add(&mut self, time: f64, row: [f64; 3]) {
        if self.filled == 0 {
            if self.times.len() == MOST {
                self.halve();
            }
            self.times.push(time);
            self.courses.iter_mut().flatten().for_each(|c| c.buckets.push(Bucket::EMPTY));
        }
        self.filled = (self.filled + 1) % self.rows;
        self.added += 1;
        for (c, v) in self.courses.iter_mut().zip(row) {
            let Some(c) = c else { continue };
            if v.is_nan() {
                c.last = None;
                continue;
            }
            let (low3, high3) = match c.last {
                Some([a, b]) if !a.is_nan() => (v.max(a).max(b), v.min(a).min(b)),
                _ => (f64::INFINITY, f64::NEG_INFINITY),
            };
            c.last = Some([c.last.map_or(f64::NAN, |l| l[1]), v]);
            if let Some(b) = c.buckets.last_mut() {
                let one = Bucket { low: v, high: v, low3, high3, count: 1.0, mean: v, squares: 0.0 };
                *b = b.join(one);
            }
        }
    }

    /// Joins neighbours, an even number of full ones.
    fn halve(&mut self) {
        for c in self.courses.iter_mut().flatten() {
            c.buckets = c.buckets.chunks_exact(2).map(|p| p[0].join(p[1])).collect();
        }
        self.times = self.times.iter().step_by(2).copied().collect();
        self.rows *= 2;
    }

    /// Rows added so far.
    pub fn rows_added(&self) -> u64 {
        self.added
    }

    /// Buckets of a channel.
    pub fn buckets(&self, channel: usize) -> Option<&[Bucket]> {
        self.courses[channel].as_ref().map(|c| c.buckets.as_slice())
    }

    /// The course of a channel in at most `most` points: time, least and largest reading.
    pub fn curve(&self, channel: usize, most: usize) -> Vec<[f64; 3]> {
        let Some(buckets) = self.buckets(channel) else { return Vec::new() };
        let size = buckets.len().div_ceil(most).max(1);
        let join = |(t, b): (&[f64], &[Bucket])| {
            let b = b.iter().copied().fold(Bucket::EMPTY, Bucket::join);
            [t[0], b.low, b.high]
        };
        self.times.chunks(size).zip(buckets.chunks(size)).map(join).filter(|p| p[1].is_finite()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_join_and_keep_extremes_means_and_scatter() {
        let n = 5 * MOST / 2 + 17;
        let y = |i: usize| if i == 1000 { 50.0 } else { (i % 7) as f64 };
        let mut e = Envelope::new([true, false, false]);
        (0..n).for_each(|i| e.add(i as f64, [y(i), f64::NAN, f64::NAN]));
        let b = e.buckets(0).unwrap();
        assert_eq!((e.rows, b.len(), e.times.len()), (4, n.div_ceil(4), n.div_ceil(4)));
        assert!(e.times.iter().enumerate().all(|(i, t)| *t == 4.0 * i as f64));
        assert_eq!((b[250].high, b[250].low), (50.0, y(1001).min(y(1002)).min(y(1003))));
        // a spike of one sample does not reach as three in a row
        assert!(b.iter().all(|b| b.high3 <= 4.0));
        let four: Vec<f64> = (8..12).map(y).collect();
        let mean = four.iter().sum::<f64>() / 4.0;
        let scatter = (four.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 3.0).sqrt();
        assert!((b[2].mean - mean).abs() < 1e-12 && (b[2].scatter() - scatter).abs() < 1e-12);
        assert!(e.curve(0, 300).len() <= 300 && e.buckets(1).is_none());
    }

    #[test]
    fn missing_samples_take_their_place_and_say_nothing() {
        let mut e = Envelope::new([true, false, false]);
        [1.0, f64::NAN, 3.0, 3.0, 3.0].iter().enumerate().for_each(|(i, v)| e.add(i as f64, [*v, f64::NAN, f64::NAN]));
        let b = e.buckets(0).unwrap();
        assert_eq!(b.iter().map(Bucket::holds).collect::<Vec<_>>(), [true, false, true, true, true]);
        assert_eq!(b[4].high3, 3.0);
        assert!(b[3].high3.is_infinite());
    }
}
