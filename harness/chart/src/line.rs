//! Lines as they are drawn: as many points as can be seen, and no force that the data never had.

/// Width of a column of the picture in which extremes stand for all points, px.
const COLUMN: f64 = 0.5;
/// Columns for all that lies outside what is shown first.
const OUTSIDE: f64 = 800.0;
/// Distance within which a point of a curve that turns back adds nothing that is seen, px.
const NEAR: f64 = 0.2;

/// A stretch of a line without a gap: places in px, and the indices of the points they are.
pub(crate) type Stretch = Vec<(f64, f64, usize)>;

/// Points in px, a gap where one is not finite, thinned to what can be seen of them: where x rises, of every column its first,
/// its least, its largest and its last point (so that a spike of one sample keeps its height, and the line from one column
/// to the next is the data's own); where it does not, every point that is off the one before it. `width`: px of what is shown
/// first.
pub(crate) fn drawn(points: impl Iterator<Item = (f64, f64)>, width: f64) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = vec![Vec::new()];
    for (i, (x, y)) in points.enumerate() {
        if x.is_finite() && y.is_finite() {
            if let Some(s) = stretches.last_mut() {
                s.push((x, y, i));
            }
        } else if stretches.last().is_some_and(|s| !s.is_empty()) {
            stretches.push(Vec::new());
        }
    }
    stretches.retain(|s| !s.is_empty());
    let all = || stretches.iter().flatten();
    let (least, most) = all().fold((0.0f64, width), |(a, b), p| (a.min(p.0), b.max(p.0)));
    let outside = ((most - least - width) / OUTSIDE).max(COLUMN);
    let column = |x: f64| {
        if x < 0.0 {
            -1 - (-x / outside) as i64
        } else if x <= width {
            (x / COLUMN) as i64
        } else {
            (width / COLUMN) as i64 + 1 + ((x - width) / outside) as i64
        }
    };
    stretches
        .into_iter()
        .map(|s| if s.windows(2).all(|w| w[1].0 >= w[0].0) { by_column(&s, column) } else { off_the_last(s) })
        .collect()
}

/// Of every column the first, the least, the largest and the last point, in their order.
fn by_column(s: &Stretch, column: impl Fn(f64) -> i64) -> Stretch {
    let mut out = Vec::new();
    for group in s.chunk_by(|a, b| column(a.0) == column(b.0)) {
        let by = |a: &&(f64, f64, usize), b: &&(f64, f64, usize)| a.1.total_cmp(&b.1);
        let kept = [group.first(), group.iter().min_by(by), group.iter().max_by(by), group.last()];
        let mut kept: Vec<(f64, f64, usize)> = kept.into_iter().flatten().copied().collect();
        kept.sort_by_key(|p| p.2);
        kept.dedup_by_key(|p| p.2);
        out.extend(kept);
    }
    out
}

/// The points that are not where the last one drawn is; the last of all always.
fn off_the_last(s: Stretch) -> Stretch {
    let mut out: Stretch = Vec::new();
    let end = s.len() - 1;
    for (k, p) in s.into_iter().enumerate() {
        if k == end || out.last().is_none_or(|q| (p.0 - q.0).hypot(p.1 - q.1) > NEAR) {
            out.push(p);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_sample_in_a_million_keeps_its_height_and_its_neighbours_theirs() {
        let n = 1_000_000;
        let at = |i: usize| (400.0 * i as f64 / n as f64, if i == 654_321 { 99.0 } else { 1.0 });
        let out = drawn((0..n).map(at), 400.0);
        let points: Vec<_> = out.iter().flatten().collect();
        assert!(points.len() < 4 * 802, "{}", points.len());
        let spike = points.iter().position(|p| p.1 == 99.0).unwrap();
        assert_eq!(points[spike].2, 654_321);
        assert!(points[spike + 1].0 - points[spike - 1].0 < 2.0 * COLUMN);
        assert!(points.iter().all(|p| p.1 == 1.0 || p.1 == 99.0));
    }

    #[test]
    fn lines_between_points_are_the_datas_own_in_free_flight() {
        // two impacts, samples close together in contact, and in flight none but its ends
        let mut data: Vec<(f64, f64)> = Vec::new();
        for hit in [10.0, 300.0] {
            data.extend((0..=5000).map(|i| {
                let u = f64::from(i) / 5000.0;
                (hit + 3.0 * u, 200.0 * (std::f64::consts::PI * u).sin().max(0.0))
            }));
        }
        let out = drawn(data.iter().copied(), 400.0);
        for w in out.iter().flatten().collect::<Vec<_>>().windows(2) {
            let mid = 0.5 * (w[0].0 + w[1].0);
            if (14.0..299.0).contains(&mid) {
                assert!(w[0].1.max(w[1].1) < 1e-9, "{w:?}");
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_a_gap_and_a_loop_keeps_its_turns() {
        let y = [1.0, 2.0, f64::NAN, f64::INFINITY, 3.0, 4.0];
        let out = drawn(y.iter().enumerate().map(|(i, y)| (i as f64, *y)), 10.0);
        assert_eq!(out.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        let turn = |i: i32| (100.0 * (f64::from(i) * 0.001).sin(), 100.0 * (f64::from(i) * 0.001).cos());
        let out = drawn((0..20_000).map(turn), 100.0);
        let top = out.iter().flatten().map(|p| p.0).fold(0.0, f64::max);
        assert!(top > 99.99 && out[0].len() < 20_000, "{top}, {}", out[0].len());
        assert!(drawn(std::iter::empty(), 10.0).is_empty());
    }
}
