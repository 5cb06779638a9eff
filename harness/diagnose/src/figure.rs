//! Numbers as a reader wants them.

/// A number with as many digits as a reader wants, and its unit.
pub fn figure(v: f64, unit: &str) -> String {
    let a = v.abs();
    let s = if !a.is_finite() {
        "\u{2013}".into()
    } else if a == 0.0 {
        "0".into()
    } else if (1e-2..1e4).contains(&a) {
        let digits = (3 - a.log10().floor() as i32).clamp(0, 5) as usize;
        format!("{v:.digits$}")
    } else {
        format!("{v:.3e}")
    };
    if unit.is_empty() || unit == "1" {
        s
    } else {
        format!("{s} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short_and_carry_their_unit() {
        assert_eq!(figure(0.80123, "N"), "0.8012 N");
        assert_eq!(figure(1234.6, "N"), "1235 N");
        assert_eq!(figure(2.1e-7, "m"), "2.100e-7 m");
        assert_eq!(figure(0.0, "1"), "0");
        assert_eq!(figure(f64::NAN, "1"), "\u{2013}");
    }
}
