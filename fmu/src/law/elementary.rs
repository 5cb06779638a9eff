//! The elementary functions the law uses, in one place so that every platform gets the same bits.

/// x^p for x >= 0.
#[inline]
pub fn pow(x: f64, p: f64) -> f64 {
    if p == 1.0 {
        x
    } else if p == 1.5 {
        x * x.sqrt()
    } else if p == 2.0 {
        x * x
    } else if p == 3.0 {
        x * x * x
    } else {
        x.powf(p)
    }
}

/// e^x.
#[inline]
pub fn exp(x: f64) -> f64 {
    x.exp()
}
