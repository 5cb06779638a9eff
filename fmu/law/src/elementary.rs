//! The elementary functions the law uses: the same bits on every platform, and errors below one last place.
//!
//! Only +, -, *, /, square roots and integer operations on the bits, which IEEE 754 fixes to the last bit; never the
//! platform's libm, never a fused multiply-add. Errors are counted in units in the last place (ulp) of the result;
//! what the tests see at most: pow, exp, ln 0.52, exp_m1 and ln_1p 0.9, sinh, cosh, tanh and asinh 2.5.
//!
//! Method (table lookup after Tang 1989 and 1990, ACM TOMS 15(2) and 16(4)): x = 2^k z; r = z/c - 1 is exact in a
//! double because 1/c has few bits; ln x = k ln 2 + ln c + r - r^2/2 + ... carried in two doubles;
//! e^y = 2^n 2^(j/128) e^r with |r| < ln 2/256. Common exponents take square root and products instead, with what
//! the products' rounding leaves added, so that p = 1.5 and p = 1.5 + 1e-16 give the same curve.

mod tables;
#[cfg(test)]
mod tests;

use tables::{EXP, EXP_POLY, LN, LN2, LN_POLY, STEP, STEPS};

/// Bits of 0.6875, where the intervals of the table of logarithms begin.
const FIRST: u64 = 0x3fe6_0000_0000_0000;
/// Bits of 2^-200 and the distance to those of 2^200: between them no common power leaves the range of doubles.
const COMMON: u64 = (1023 - 200) << 52;
const COMMON_SPAN: u64 = 400 << 52;
/// 1.5 * 2^52: added and taken away it rounds to whole numbers, which its lowest bits hold meanwhile.
const WHOLE: f64 = 6755399441055744.0;

/// `x` with its lowest `N` bits cleared: 53 - N significant bits left.
#[inline(always)]
fn cut<const N: u32>(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & (!0 << N))
}

/// 2^n for a normal result.
#[inline(always)]
fn power_of_two(n: i64) -> f64 {
    f64::from_bits(((1023 + n) << 52) as u64)
}

/// x^p for x >= 0 and any p; NaN for x < 0 (p = 1 and 2 apart) or NaN, but x^0 = 1.
#[inline]
pub fn pow(x: f64, p: f64) -> f64 {
    if p == 1.0 {
        x
    } else if p == 2.0 {
        x * x
    } else {
        pow_other(x, p)
    }
}

/// x^p where p is neither 1 nor 2.
fn pow_other(x: f64, p: f64) -> f64 {
    if x.to_bits().wrapping_sub(COMMON) < COMMON_SPAN {
        if p == 1.5 {
            return one_and_a_half(x);
        }
        if p == 3.0 {
            return cube(x);
        }
        let (half_steps, halves) = (p + p, (p + p) as i32);
        if half_steps == f64::from(halves) {
            match halves {
                1 => return x.sqrt(),
                5 => return two_and_a_half(x),
                7 => return three_and_a_half(x),
                8 => return fourth(x),
                _ => {}
            }
        }
        if p.abs() < 1e19 {
            return pow_by_logarithm(x.to_bits(), p);
        }
    }
    pow_rare(x, p)
}

/// What is missing in the square root `s` of `x`, times 2 s; `high` is `s` with few bits.
#[inline(always)]
fn rest_of_root(x: f64, s: f64, high: f64) -> f64 {
    (x - high * high) - (s - high) * (s + high)
}

#[inline]
fn one_and_a_half(x: f64) -> f64 {
    let s = x.sqrt();
    let (a, b) = (cut::<27>(x), cut::<27>(s));
    // a b is exact; the root's own rest adds x rest/(2 s) = s rest/2
    a * b + ((x - a) * s + a * (s - b) + 0.5 * s * rest_of_root(x, s, b))
}

#[inline]
fn two_and_a_half(x: f64) -> f64 {
    let s = x.sqrt();
    let (a, b) = (cut::<36>(x), cut::<36>(s));
    let square = a * a;
    square * b + ((x - a) * (x + a) * s + square * (s - b) + 0.5 * s * x * rest_of_root(x, s, b))
}

#[inline]
fn cube(x: f64) -> f64 {
    let a = cut::<36>(x);
    a * a * a + (x - a) * (a * a + x * (x + a))
}

#[inline]
fn three_and_a_half(x: f64) -> f64 {
    let s = x.sqrt();
    let (a, b) = (cut::<40>(x), cut::<40>(s));
    let cube = a * a * a;
    let more = (x - a) * (a * a + x * (x + a));
    cube * b + (more * s + cube * (s - b) + 0.5 * s * (x * x) * rest_of_root(x, s, b))
}

#[inline]
fn fourth(x: f64) -> f64 {
    let a = cut::<40>(x);
    let (square, whole) = (a * a, x * x);
    square * square + (x - a) * (x + a) * (whole + square)
}

/// ln of the positive normal double with the bits `ix`, times 2^`down`, as a double and a rest: relative error
/// below 2^-66.
#[inline(always)]
fn ln_in_two(ix: u64, down: i64) -> (f64, f64) {
    let above = ix.wrapping_sub(FIRST);
    let [reciprocal, high, low] = LN[(above >> 45) as usize & 127];
    let k = above as i64 >> 52;
    let z = f64::from_bits(ix.wrapping_sub((k << 52) as u64));
    let k = (k + down) as f64;
    // every product and sum here is exact: few bits times few bits
    let top = cut::<32>(z);
    let r = (top * reciprocal - 1.0) + (z - top) * reciprocal;
    let t = k * LN2[0] + high;
    let u = t + r;
    let rest_of_sum = t - u + r;
    let a = cut::<27>(r);
    let square = -0.5 * a * a;
    let v = u + square;
    let rest_of_square = (u - v + square) - 0.5 * (r - a) * (r + a);
    let r2 = r * r;
    let q = LN_POLY[0]
        + r * LN_POLY[1]
        + r2 * (LN_POLY[2] + r * LN_POLY[3])
        + r2 * r2 * (LN_POLY[4] + r * LN_POLY[5] + r2 * LN_POLY[6]);
    let rest = (k * LN2[1] + low) + rest_of_sum + rest_of_square + r * r2 * q;
    let sum = v + rest;
    (sum, v - sum + rest)
}

/// (2^(j/128) 2^n as bits, e^(x + rest) over it less 1, n) for |x| < 1024 and a `rest` below 1e-3.
#[inline(always)]
fn exp_in_two(x: f64, rest: f64) -> (u64, f64, i64) {
    let shifted = x * STEPS + WHOLE;
    let count = (shifted.to_bits() << 13) as i64 >> 13;
    let steps = shifted - WHOLE;
    let r = x - steps * STEP[0] - steps * STEP[1] + rest;
    let [high, low] = EXP[count as usize & 127];
    let n = count >> 7;
    let r2 = r * r;
    let more = low + r + r2 * (EXP_POLY[0] + r * EXP_POLY[1]) + r2 * r2 * (EXP_POLY[2] + r * EXP_POLY[3]);
    (high.to_bits().wrapping_add((n << 52) as u64), more, n)
}

/// e^(x + rest).
#[inline(always)]
fn exp_of_sum(x: f64, rest: f64) -> f64 {
    // below 708 nothing over- or underflows on the way
    if x.abs() < 708.0 {
        let (scale, more, _) = exp_in_two(x, rest);
        let scale = f64::from_bits(scale);
        return scale + scale * more;
    }
    exp_at_the_ends(x, rest)
}

/// e^(x + rest) for |x| >= 708 or NaN.
#[cold]
fn exp_at_the_ends(x: f64, rest: f64) -> f64 {
    if x.is_nan() {
        return x;
    }
    if x.abs() >= 1024.0 {
        return if x > 0.0 { f64::INFINITY } else { 0.0 };
    }
    let (scale, more, n) = exp_in_two(x, rest);
    if n > 0 {
        let scale = f64::from_bits(scale.wrapping_sub(1000 << 52));
        return (scale + scale * more) * power_of_two(1000);
    }
    let scale = f64::from_bits(scale.wrapping_add(1022 << 52));
    let more = scale * more;
    let mut y = scale + more;
    if y < 1.0 {
        // a subnormal result: round once, where its last bit will be
        let lost = scale - y + more;
        let sum = 1.0 + y;
        y = sum + ((1.0 - sum + y) + lost) - 1.0;
    }
    y * power_of_two(-1022)
}

#[inline(always)]
fn pow_by_logarithm(ix: u64, p: f64) -> f64 {
    let (l, rest) = ln_in_two(ix, 0);
    exp_of_product(p, l, rest)
}

/// e^(p (l + rest)).
#[inline(always)]
fn exp_of_product(p: f64, l: f64, rest: f64) -> f64 {
    let (a, b) = (cut::<27>(p), cut::<27>(l));
    exp_of_sum(a * b, (p - a) * b + p * (l - b + rest))
}

/// x^p where x or p is far out, zero, negative, infinite or NaN.
#[cold]
fn pow_rare(x: f64, p: f64) -> f64 {
    if p == 0.0 || x == 1.0 {
        return 1.0;
    }
    if x.is_nan() || p.is_nan() || x < 0.0 {
        return f64::NAN;
    }
    if x == 0.0 || x == f64::INFINITY || p.abs() >= 1e19 {
        // p beyond 1e19 takes even 1 + 1e-16 out of the range
        return if (x > 1.0) == (p > 0.0) { f64::INFINITY } else { 0.0 };
    }
    let (l, rest) = ln_of_positive(x);
    exp_of_product(p, l, rest)
}

/// ln x in two doubles for finite x > 0.
#[inline]
fn ln_of_positive(x: f64) -> (f64, f64) {
    if x < f64::MIN_POSITIVE {
        ln_in_two((x * power_of_two(54)).to_bits(), -54)
    } else {
        ln_in_two(x.to_bits(), 0)
    }
}

/// e^x.
#[inline]
pub fn exp(x: f64) -> f64 {
    exp_of_sum(x, 0.0)
}

/// e^x - 1, precise near 0.
pub fn exp_m1(x: f64) -> f64 {
    if x.abs() < 0.25 {
        // Taylor's series
        let mut sum = 0.0;
        for n in (3..=14).rev() {
            sum = (1.0 + sum) * x / f64::from(n);
        }
        return x + 0.5 * x * x * (1.0 + sum);
    }
    if !(-40.0..700.0).contains(&x) {
        return exp(x) - 1.0;
    }
    let (scale, more, _) = exp_in_two(x, 0.0);
    let scale = f64::from_bits(scale);
    let sum = scale - 1.0;
    let lost = if scale >= 1.0 { scale - sum - 1.0 } else { scale - (sum + 1.0) };
    sum + (lost + scale * more)
}

/// ln x: -inf at 0, NaN below.
#[inline]
pub fn ln(x: f64) -> f64 {
    if x > 0.0 && x < f64::INFINITY {
        ln_of_positive(x).0
    } else if x == 0.0 {
        f64::NEG_INFINITY
    } else if x > 0.0 {
        x
    } else {
        f64::NAN
    }
}

/// ln(1 + x), precise near 0: -inf at -1, NaN below.
pub fn ln_1p(x: f64) -> f64 {
    let u = 1.0 + x;
    if !(u > 0.0 && u < f64::INFINITY) {
        return ln(u);
    }
    let lost = if x < 1.0 { x - (u - 1.0) } else { 1.0 - (u - x) };
    let (l, rest) = ln_in_two(u.to_bits(), 0);
    l + (rest + lost / u)
}

/// sinh x.
pub fn sinh(x: f64) -> f64 {
    let a = x.abs();
    let y = if a < 40.0 {
        let e = exp_m1(a);
        0.5 * (e + e / (e + 1.0))
    } else {
        let half = exp(0.5 * a);
        0.5 * half * half
    };
    if x < 0.0 {
        -y
    } else {
        y
    }
}

/// cosh x.
pub fn cosh(x: f64) -> f64 {
    let a = x.abs();
    if a < 40.0 {
        let e = exp(a);
        return 0.5 * (e + 1.0 / e);
    }
    let half = exp(0.5 * a);
    0.5 * half * half
}

/// tanh x.
pub fn tanh(x: f64) -> f64 {
    let a = x.abs();
    let y = if a < 20.0 {
        let e = exp_m1(2.0 * a);
        e / (e + 2.0)
    } else {
        1.0
    };
    if x.is_nan() {
        return x;
    }
    if x < 0.0 {
        -y
    } else {
        y
    }
}

/// asinh x.
pub fn asinh(x: f64) -> f64 {
    let a = x.abs();
    let y = if a < 1e8 {
        let square = a * a;
        ln_1p(a + square / (1.0 + (1.0 + square).sqrt()))
    } else {
        ln(a) + std::f64::consts::LN_2
    };
    if x < 0.0 {
        -y
    } else {
        y
    }
}

/// Coefficients of Taylor's series of the sine behind the first: -1/3!, 1/5!, -1/7! and on; what is left out is below 1e-17 within a
/// quarter of a turn.
const SINE: [f64; 11] = [
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
    -1.0 / 121_645_100_408_832_000.0,
    1.0 / 51_090_942_171_709_440_000.0,
    -1.0 / 25_852_016_738_884_976_640_000.0,
];

/// sin(pi t) for t from -0.5 to 0.5.
#[inline]
fn sin_within_a_quarter(t: f64) -> f64 {
    let x = std::f64::consts::PI * t;
    let square = x * x;
    let twice = square * square;
    // the even and the odd places side by side
    let (mut even, mut odd) = (SINE[10], SINE[9]);
    for k in (0..5).rev() {
        even = even * twice + SINE[2 * k];
        if k > 0 {
            odd = odd * twice + SINE[2 * k - 1];
        }
    }
    x + x * square * (even + odd * square)
}

/// sin(pi t) for t from 0 to 1.
#[inline]
pub fn sin_of_half_turns(t: f64) -> f64 {
    sin_within_a_quarter(if t > 0.5 { 1.0 - t } else { t })
}

/// cos(pi t) for t from 0 to 1.
#[inline]
pub fn cos_of_half_turns(t: f64) -> f64 {
    sin_within_a_quarter(0.5 - t)
}
