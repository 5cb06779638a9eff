//! Theoretical stiffness of contacts from geometry and material.

use super::elementary::{asinh, pow};

/// Coefficient m of the mean displacement m P (1 - nu^2)/(E sqrt(A)) under a uniformly loaded rectangle of
/// side ratio `ratio` (Timoshenko and Goodier 1951, art. 124): the mean of 1/r over the rectangle in closed form.
///
/// Returns None unless the ratio is between 1e-50 and 1e50.
pub fn rectangle_coefficient(ratio: f64) -> Option<f64> {
    if !(1e-50..=1e50).contains(&ratio) {
        return None;
    }
    let (a, b) = if ratio >= 1.0 { (ratio, 1.0) } else { (1.0 / ratio, 1.0) };
    let s: f64 = a * a + b * b;
    // a^3 + b^3 - s^(3/2) without the cancellation of a^3 for slender faces
    let root = s.sqrt();
    let rest = b * b * b - b * b / (root + a) * (s + a * root + a * a);
    let integral = 2.0 * (a * a * b * asinh(b / a) + a * b * b * asinh(a / b) + rest / 3.0);
    Some(integral / (std::f64::consts::PI * pow(a * b, 1.5)))
}

/// Compliance h = (1 - nu^2)/E of a half space, 1/Pa.
pub fn half_space(youngs_modulus: f64, poisson_ratio: f64) -> f64 {
    (1.0 - poisson_ratio * poisson_ratio) / youngs_modulus
}

/// Stiffness, N/m, of two flat rectangular faces of half sides `a`, `b` m with half-space compliances `h1`, `h2`:
/// k = 2 sqrt(a b)/(m (h1 + h2)) (Ahn and Ryu 2005, eq. 7).
///
/// Returns None unless a, b and h1 + h2 are above 0 and k is finite.
pub fn rectangular_faces(a: f64, b: f64, h1: f64, h2: f64) -> Option<f64> {
    if !(a > 0.0 && b > 0.0 && h1 + h2 > 0.0) {
        return None;
    }
    rectangle_coefficient(a / b).map(|m| 2.0 * (a * b).sqrt() / (m * (h1 + h2))).filter(|k| k.is_finite())
}

/// Stiffness, N/m^1.5, of two spheres of radii `r1`, `r2` m (infinite: flat): 4/3 sqrt(R)/(h1 + h2), p = 1.5 (Hertz 1881).
///
/// A negative radius is a hollow seat. Returns None unless the curvatures add to more than 0 and h1 + h2 > 0.
pub fn spheres(r1: f64, r2: f64, h1: f64, h2: f64) -> Option<f64> {
    let curvature = 1.0 / r1 + 1.0 / r2;
    if !(curvature.is_finite() && curvature > 0.0 && h1 + h2 > 0.0) {
        return None;
    }
    Some(4.0 / 3.0 / curvature.sqrt() / (h1 + h2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_are_timoshenkos() {
        for (r, m) in [(1.0, 0.9464), (2.0, 0.9195), (10.0, 0.7104)] {
            assert!((rectangle_coefficient(r).unwrap() - m).abs() < 6e-5, "{r}");
        }
        assert!((rectangle_coefficient(0.5).unwrap() - rectangle_coefficient(2.0).unwrap()).abs() < 1e-15);
        assert!(rectangle_coefficient(-1.0).is_none());
    }

    #[test]
    fn coefficients_are_the_mean_of_the_distances_inverse_over_the_rectangle() {
        // m = 1/(pi A^1.5) times the double integral of 1/r over pairs of points: by differences (u, w) with
        // weight 4 (a - u)(b - w), in polar coordinates, where 1/r cancels r dr
        for ratio in [1.0, 1.5, 3.7, 10.0, 100.0] {
            let (a, b): (f64, f64) = (ratio, 1.0);
            let n = 200_000;
            let mut sum = 0.0;
            for i in 0..n {
                let t = std::f64::consts::FRAC_PI_2 * (f64::from(i) + 0.5) / f64::from(n);
                let (s, c) = t.sin_cos();
                let r = (a / c).min(b / s);
                sum += a * b * r - (a * s + b * c) * r * r / 2.0 + s * c * r * r * r / 3.0;
            }
            sum *= 4.0 * std::f64::consts::FRAC_PI_2 / f64::from(n);
            let m = sum / (std::f64::consts::PI * (a * b).powf(1.5));
            let got = rectangle_coefficient(ratio).unwrap();
            assert!((got / m - 1.0).abs() < 1e-8, "{ratio}: {got} {m}");
        }
        // a line: m sqrt(ratio) = 2/pi (ln(2 ratio) + 1/2)
        let line = 2.0 / std::f64::consts::PI * ((2e12f64).ln() + 0.5);
        assert!((rectangle_coefficient(1e12).unwrap() * 1e6 / line - 1.0).abs() < 1e-11);
    }

    #[test]
    fn faces_of_one_material_follow_equation_7() {
        let h = half_space(200e9, 0.3);
        let k = rectangular_faces(2e-3, 2e-3, h, h).unwrap();
        assert!((k / (2.0 * 2e-3 / (0.946_399 * 2.0 * 0.91 / 200e9)) - 1.0).abs() < 1e-4);
        assert!(rectangular_faces(1e-3, f64::NAN, h, h).is_none());
        assert!(rectangular_faces(1e-3, 1e-3, 0.0, 0.0).is_none());
        assert!(spheres(f64::INFINITY, f64::INFINITY, h, h).is_none());
    }

    #[test]
    fn a_steel_ball_on_steel() {
        let h = half_space(210e9, 0.3);
        let k = spheres(0.01, f64::INFINITY, h, h).unwrap();
        assert!((k - 4.0 / 3.0 * (210e9 / 0.91 / 2.0) * 0.1).abs() < 1e-3 * k);
    }
}
