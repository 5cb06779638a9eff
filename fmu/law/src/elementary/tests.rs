//! Values of mpmath (fixture.csv, written by tests/elementary/generate.py) and the same bits everywhere.

use super::*;

/// xorshift64* (Vigna 2016): seeded, the same on every platform.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// Even in (low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / 9007199254740992.0)
    }

    /// 2^n times a mantissa, n even in low..high.
    fn scaled(&mut self, low: i64, high: i64) -> f64 {
        let n = low + (self.bits() % (high - low) as u64) as i64;
        self.between(1.0, 2.0) * power_of_two(n)
    }
}

/// Distance, ulp of the true value, from value + rest.
fn error(got: f64, value: f64, rest: f64) -> f64 {
    if got == value && rest == 0.0 {
        return 0.0;
    }
    let above = f64::from_bits(value.abs().to_bits() + 1);
    ((got - value) - rest).abs() / (above - value.abs())
}

#[test]
fn values_are_mpmaths() {
    let number = |s: &str| f64::from_bits(u64::from_str_radix(s, 16).unwrap());
    let mut worst: Vec<(&str, f64, usize)> = Vec::new();
    for row in include_str!("fixture.csv").lines().skip(1) {
        let f: Vec<&str> = row.split(',').collect();
        let (x, y, value, rest) = (number(f[1]), number(f[2]), number(f[3]), number(f[4]));
        let got = match f[0] {
            "pow" => pow(x, y),
            "exp" => exp(x),
            "exp_m1" => exp_m1(x),
            "ln" => ln(x),
            "ln_1p" => ln_1p(x),
            "sinh" => sinh(x),
            "cosh" => cosh(x),
            "tanh" => tanh(x),
            "asinh" => asinh(x),
            name => panic!("{name}"),
        };
        let most = match f[0] {
            "pow" | "exp" | "ln" => 0.52,
            "exp_m1" | "ln_1p" => 0.9,
            _ => 2.5,
        };
        let e = error(got, value, rest);
        assert!(e < most, "{}({x:e}, {y:e}) = {got:e}, not {value:e}: {e} ulp", f[0]);
        match worst.iter_mut().find(|w| w.0 == f[0]) {
            Some(w) => *w = (w.0, w.1.max(e), w.2 + 1),
            None => worst.push((f[0], e, 1)),
        }
    }
    assert_eq!(worst.len(), 9);
    for (name, e, n) in worst {
        println!("{name}: at most {e:.4} ulp in {n} values");
    }
}

#[test]
fn the_same_bits_on_every_platform() {
    let mut random = Random(2005);
    // FNV-1a (Fowler, Noll and Vo) over the bits
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |y: f64| {
        for byte in y.to_bits().to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for i in 0..100_000 {
        let x = random.scaled(-40, 4);
        add(pow(x, random.between(0.1, 6.0)));
        add(pow(x, 0.5 * f64::from(i % 8 + 1)));
        add(pow(random.scaled(-1022, 1022), random.between(-3.0, 3.0)));
        let y = random.between(-745.0, 709.0);
        add(exp(y));
        add(exp_m1(random.between(-3.0, 3.0)));
        add(ln(x));
        add(ln_1p(random.between(-0.9, 4.0)));
        add(sinh(random.between(-5.0, 5.0)));
        add(cosh(random.between(-5.0, 5.0)));
        add(asinh(random.between(-50.0, 50.0)));
        add(tanh(random.between(-25.0, 25.0)));
    }
    assert_eq!(hash, 0x572e_b833_e6bc_aa97, "{hash:#018x}");
}

#[test]
fn far_out_and_not_numbers() {
    let inf = f64::INFINITY;
    for p in [0.3, 0.5, 1.0, 1.5, 2.0, 2.79, 3.0, 4.0, 1e20, inf] {
        assert_eq!(pow(0.0, p), 0.0);
        assert_eq!(pow(1.0, p), 1.0);
        assert_eq!(pow(inf, p), inf);
        assert!(pow(f64::NAN, p).is_nan());
        assert_eq!(pow(0.0, -p), inf);
        assert_eq!(pow(inf, -p), 0.0);
    }
    assert_eq!(pow(0.9, 1e20), 0.0);
    assert_eq!(pow(1.1, 1e20), inf);
    assert_eq!(pow(1.1, -1e20), 0.0);
    assert_eq!(pow(0.9, -inf), inf);
    assert_eq!(pow(f64::NAN, 0.0), 1.0);
    assert!(pow(-2.0, 1.5).is_nan() && pow(-2.0, 2.79).is_nan() && pow(2.0, f64::NAN).is_nan());
    assert_eq!(pow(3.0, 1e-300), 1.0);
    assert_eq!(pow(1e300, 1.5), inf);
    assert_eq!(pow(1e-300, 1.5), 0.0);
    assert_eq!((exp(inf), exp(-inf), exp(0.0), exp(1e-300)), (inf, 0.0, 1.0, 1.0));
    assert_eq!((exp(709.8), exp(-745.2), exp(1e300), exp(-1e300)), (inf, 0.0, inf, 0.0));
    assert_eq!((exp_m1(inf), exp_m1(-inf), exp_m1(0.0)), (inf, -1.0, 0.0));
    assert_eq!((ln(0.0), ln(1.0), ln(inf)), (-inf, 0.0, inf));
    assert_eq!((ln_1p(-1.0), ln_1p(0.0), ln_1p(inf)), (-inf, 0.0, inf));
    assert!(exp(f64::NAN).is_nan() && ln(-1.0).is_nan() && ln(f64::NAN).is_nan() && ln_1p(-1.5).is_nan());
    assert_eq!((sinh(0.0), cosh(0.0), asinh(0.0)), (0.0, 1.0, 0.0));
    assert_eq!((sinh(-800.0), cosh(800.0), asinh(-inf)), (-inf, inf, -inf));
    assert_eq!((tanh(0.0), tanh(-inf), tanh(30.0), tanh(f64::NAN).is_nan()), (0.0, -1.0, 1.0, true));
}

#[test]
fn a_common_exponent_and_its_neighbours_agree() {
    let mut random = Random(1);
    for halves in 1..=8 {
        let p = 0.5 * f64::from(halves);
        for _ in 0..10_000 {
            let x = random.scaled(-30, 4);
            let by_logarithm = pow_by_logarithm(x.to_bits(), p);
            let apart = (pow(x, p).to_bits() as i64 - by_logarithm.to_bits() as i64).abs();
            assert!(apart <= 1, "{x:e}^{p}: {apart} ulp");
        }
    }
}

#[test]
fn powers_rise_across_the_seams() {
    // where tables and ranges change: the ends of intervals, 1, and the common range
    for i in 0..=128u64 {
        let x = f64::from_bits(FIRST + (i << 45));
        for p in [0.5, 0.7, 1.5, 2.5, 2.79, 3.0, 3.5, 4.0] {
            for s in [1.0, 1e-9, power_of_two(-200) / x, power_of_two(200) / x] {
                let at = |n: i64| pow(f64::from_bits(((x * s).to_bits() as i64 + n) as u64), p);
                for n in -3..3 {
                    assert!(at(n) <= at(n + 1), "{:e}^{p}", x * s);
                }
            }
        }
    }
}

#[test]
fn sine_and_cosine_of_half_turns_are_those_of_the_angle() {
    for n in 0..=1000 {
        let t = f64::from(n) / 1000.0;
        let angle = std::f64::consts::PI * t;
        assert!((sin_of_half_turns(t) - angle.sin()).abs() < 5e-16, "{}", t);
        assert!((cos_of_half_turns(t) - angle.cos()).abs() < 5e-16, "{}", t);
    }
    assert_eq!((sin_of_half_turns(0.0), sin_of_half_turns(1.0), cos_of_half_turns(0.5)), (0.0, 0.0, 0.0));
}
