//! Dynamic time warping within a band about the diagonal (Sakoe and Chiba 1978), as ISO/TS 18571 takes it for its
//! magnitude score: squared differences, steps along either signal or both, each of weight one.

/// The step by which a cell of the cost table is reached.
#[derive(Clone, Copy, PartialEq)]
enum Step {
    /// Along the first signal.
    First,
    /// Along the second.
    Second,
    Both,
}

/// Pairs of samples (of `a`, of `b`, as long as `a`) on the cheapest path from the first pair to the last, the last
/// pair first. `half`: cells of the band either side of the diagonal. Of equally cheap steps the order is along the
/// first signal, the second, both.
pub fn path(a: &[f64], b: &[f64], half: usize) -> Vec<(usize, usize)> {
    let n = a.len();
    let width = 2 * half + 1;
    // cell (i, j) of the table at `width * i + j + half - i`
    let mut steps = vec![Step::Both; n * width];
    let mut above = vec![f64::INFINITY; width];
    let mut row = vec![f64::INFINITY; width];
    for i in 0..n {
        row.fill(f64::INFINITY);
        for j in i.saturating_sub(half)..n.min(i + half + 1) {
            let c = j + half - i;
            let cell = (a[i] - b[j]) * (a[i] - b[j]);
            if i == 0 && j == 0 {
                row[c] = cell;
                continue;
            }
            // one row up the band has moved by one cell
            let from_first = if c + 1 < width { above[c + 1] } else { f64::INFINITY };
            let from_second = if c > 0 { row[c - 1] } else { f64::INFINITY };
            let (mut step, mut least) = (Step::First, from_first);
            for (s, cost) in [(Step::Second, from_second), (Step::Both, above[c])] {
                if cost < least {
                    (step, least) = (s, cost);
                }
            }
            steps[width * i + c] = step;
            row[c] = least + cell;
        }
        std::mem::swap(&mut above, &mut row);
    }
    back(&steps, n, half)
}

/// The path from the last pair back to the first.
fn back(steps: &[Step], n: usize, half: usize) -> Vec<(usize, usize)> {
    let mut pairs = Vec::with_capacity(2 * n);
    let Some(last) = n.checked_sub(1) else { return pairs };
    let (mut i, mut j) = (last, last);
    pairs.push((i, j));
    while i > 0 || j > 0 {
        let step = match (i, j) {
            (0, _) => Step::Second,
            (_, 0) => Step::First,
            _ => steps[(2 * half + 1) * i + j + half - i],
        };
        if step != Step::Second {
            i -= 1;
        }
        if step != Step::First {
            j -= 1;
        }
        pairs.push((i, j));
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_signals_are_paired_sample_by_sample() {
        let a = [0.0, 1.0, 5.0, 2.0, 0.5];
        assert_eq!(path(&a, &a, 2), [(4, 4), (3, 3), (2, 2), (1, 1), (0, 0)]);
    }

    #[test]
    fn a_delay_within_the_band_costs_nothing() {
        let a = [0.0, 0.0, 1.0, 5.0, 2.0, 0.0];
        let b = [0.0, 1.0, 5.0, 2.0, 0.0, 0.0];
        assert!(path(&a, &b, 2).iter().all(|(i, j)| a[*i] == b[*j]));
        assert!(path(&a, &b, 0).iter().all(|(i, j)| i == j));
        assert!(path(&[], &[], 3).is_empty());
    }
}
