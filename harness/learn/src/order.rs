//! Evidence for a stiffness that follows the order of the recordings counts recordings, not samples: each has one stiffness, and
//! those of places or samples that differ lie in some order, too.

/// ln evidence of a course by the order against none: of the recordings' places in the order, 0 to 1, and the logarithms of their
/// factors on one law (Schwarz 1978). `ways`: whether it may rise, and whether it may fall; `known`: by how much factors differ where
/// nothing is missing, which counts as one recording. Both shapes of the class, even and at first faster, are as likely beforehand.
pub(crate) fn ln_evidence(orders: &[f64], factors: &[f64], ways: [bool; 2], known: f64) -> f64 {
    let n = orders.len() as f64;
    let centred = |v: Vec<f64>| {
        let mean = v.iter().sum::<f64>() / n;
        v.into_iter().map(|x| x - mean).collect::<Vec<f64>>()
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let y = centred(factors.to_vec());
    let whole = dot(&y, &y) + known * known;
    let gain = |left: f64, parameters: f64| -0.5 * (n - 1.0) * (left / whole).ln() - 0.5 * parameters * n.ln();
    let shapes = [orders.to_vec(), orders.iter().map(|u| u.max(0.0).sqrt()).collect()].map(centred);
    let [a, b] = &shapes;
    let (aa, bb, ab) = (dot(a, a), dot(b, b), dot(a, b));
    let (ya, yb) = (dot(&y, a), dot(&y, b));
    if ways == [true, true] {
        // one shape rises and the other falls
        let det = aa * bb - ab * ab;
        let explained =
            if det > 1e-9 * aa * bb { (ya * ya * bb - 2.0 * ya * yb * ab + yb * yb * aa) / det } else { 0.0 };
        return gain((whole - explained).max(known * known), 2.0);
    }
    let one = |by: f64, size: f64| {
        let by = if ways[0] { by.max(0.0) } else { by.min(0.0) };
        gain(whole - if size > 0.0 { by * by / size } else { 0.0 }, 1.0)
    };
    let (first, second) = (one(ya, aa), one(yb, bb));
    let top = first.max(second);
    top + (0.5 * ((first - top).exp() + (second - top).exp())).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_speaks_for_itself_where_it_is_more_than_what_differs_anyway() {
        let orders: Vec<f64> = (0..8).map(|k| f64::from(k) / 7.0).collect();
        let of = |factors: &[f64], ways: [bool; 2]| ln_evidence(&orders, factors, ways, 0.01);
        let rises: Vec<f64> = orders.iter().map(|u| 0.1 * u).collect();
        assert!(of(&rises, [true, false]) > 8.0 && of(&rises, [false, true]) < -0.9);
        assert!(of(&rises, [true, true]) < of(&rises, [true, false]));
        // places that differ, with a slight trend among them by chance
        let scatters = [0.0, 0.4, -0.3, 0.2, -0.1, 0.5, -0.2, 0.3];
        assert!(of(&scatters, [true, false]) < 0.5, "{}", of(&scatters, [true, false]));
        // alike but for what is known: nothing speaks for a course
        assert!(of(&[0.001, -0.002, 0.001, 0.0, 0.002, -0.001, 0.0, 0.001], [true, false]) < 0.0);
    }

    #[test]
    fn two_recordings_say_little() {
        assert!(ln_evidence(&[0.0, 1.0], &[0.0, 0.05], [true, false], 0.01) < 2.0);
    }
}
