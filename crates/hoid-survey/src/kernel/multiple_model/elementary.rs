//! `ln(1 + x)` and `e^x` computed inline, for the density of every hypothesis at every sample.

/// ln 2 as the sum of two numbers; the first has so few digits that its multiples are exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Number of stored bits in the mantissa of an f64.
const MANTISSA_BITS: u32 = 52;

/// Returns `ln(1 + x)` for x >= 0. For small x it uses the series `2 (z + z^3/3 + z^5/5 + ...)` with `z = x/(2 + x)`,
/// which takes a third of the time of libm; the first omitted term is below 1e-16 of the first term.
#[inline(always)]
pub(crate) fn log1p(x: f64) -> f64 {
    if x > 0.25 {
        return libm::log1p(x);
    }
    let z = x / (2.0 + x);
    let s = z * z;
    let mut sum = 1.0 / 15.0;
    for k in [13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        sum = sum * s + 1.0 / k;
    }
    2.0 * z * sum
}

/// Adding and then subtracting 3/2 2^52 rounds a number to the nearest integer.
const ROUNDING_OFFSET: f64 = 6_755_399_441_055_744.0;

/// Returns `e^x`, between -700 and 700 inline with a relative error of 4e-16, otherwise by libm. The inline value is
/// `2^k e^r` with `|r| <= ln(2)/2` and the Taylor series of `e^r`.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    if x.abs() >= 700.0 || x.is_nan() {
        return libm::exp(x);
    }
    let k = (x * std::f64::consts::LOG2_E + ROUNDING_OFFSET) - ROUNDING_OFFSET;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let mut sum = 1.0 / 6_227_020_800.0;
    for factorial in [
        479_001_600.0,
        39_916_800.0,
        3_628_800.0,
        362_880.0,
        40_320.0,
        5_040.0,
        720.0,
        120.0,
        24.0,
        6.0,
        2.0,
        1.0,
        1.0,
    ] {
        sum = sum * r + 1.0 / factorial;
    }
    sum * f64::from_bits(((k as i64 + 1023) as u64) << MANTISSA_BITS)
}

#[cfg(test)]
mod tests {
    #[test]
    fn short_functions_agree_with_libm() {
        for i in 0..4000 {
            let x = f64::from(i) * 1e-3;
            assert!((super::log1p(x) - libm::log1p(x)).abs() <= 4e-16 * libm::log1p(x));
            for x in [-x, x, -180.0 * x] {
                let e = libm::exp(x);
                assert!((super::exp(x) - e).abs() <= 4e-16 * e, "{x}");
            }
        }
        assert_eq!(super::exp(f64::NEG_INFINITY), 0.0);
        assert!(super::exp(f64::NAN).is_nan() && super::log1p(1e300) == libm::log1p(1e300));
    }
}
