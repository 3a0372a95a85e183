//! `ln(1 + x)` and `e^x` without a call, for the density of every hypothesis at every sample.

/// ln 2 in two parts, the first with so few digits that its multiples are exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Bits of the mantissa of an f64.
const MANTISSA: u32 = 52;

/// `ln(1 + x)` for x that is not negative, in a third of the time where x is small: with
/// `z = x/(2 + x)`, `2 (z + z^3/3 + z^5/5 + ...)`, whose next term is below 1e-16 of the first.
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

/// Adding and taking away 3/2 2^52 rounds to the nearest whole number, which then are the last bits.
const ROUNDS: f64 = 6_755_399_441_055_744.0;

/// `e^x` without a call, to 4e-16 between -700 and 700 and libm's beyond: `2^k e^r` with
/// `|r| <= ln(2)/2`, by Taylor's series.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    if x.abs() >= 700.0 || x.is_nan() {
        return libm::exp(x);
    }
    let k = (x * core::f64::consts::LOG2_E + ROUNDS) - ROUNDS;
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
    sum * f64::from_bits(((k as i64 + 1023) as u64) << MANTISSA)
}

/// The same where x is known to be between -700 and 700, for several side by side: without a branch, and
/// with even and odd powers apart, which do not wait for each other.
#[inline(always)]
pub(crate) fn exp_within(x: f64) -> f64 {
    let shifted = x * core::f64::consts::LOG2_E + ROUNDS;
    let k = shifted - ROUNDS;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let square = r * r;
    let (mut even, mut odd) = (1.0 / 479_001_600.0, 1.0 / 6_227_020_800.0);
    for [of_even, of_odd] in [
        [3_628_800.0, 39_916_800.0],
        [40_320.0, 362_880.0],
        [720.0, 5_040.0],
        [24.0, 120.0],
        [2.0, 6.0],
        [1.0, 1.0],
    ] {
        even = even * square + 1.0 / of_even;
        odd = odd * square + 1.0 / of_odd;
    }
    f64::from_bits((even + odd * r).to_bits().wrapping_add(shifted.to_bits() << MANTISSA))
}

/// `ln x` to 1e-15 of the larger of 1 and itself, without a branch: `x = 2^k m` with m between the roots
/// of 1/2 and 2. Of numbers that are not positive, not finite or below the smallest normal one it makes
/// something finite.
#[inline(always)]
pub(crate) fn ln_of_normal(x: f64) -> f64 {
    let (k, f) = split(x);
    ln_of_parts(exponent(k), f)
}

/// `ln(1 + x)` for x that is not negative, without a branch: what the sum loses by rounding is added to
/// what is left of it.
#[inline(always)]
pub(crate) fn ln_1p(x: f64) -> f64 {
    let sum = 1.0 + x;
    let lost = x - (sum - 1.0);
    let (k, f) = split(sum);
    // 2^-k.
    let scale = f64::from_bits((2 * EXPONENT_OF_ONE).wrapping_sub(k) << MANTISSA);
    ln_of_parts(exponent(k), f + lost * scale)
}

/// Exponent of 1, as it stands in its bits.
const EXPONENT_OF_ONE: u64 = 1023;

/// k, as an exponent stands in the bits of a number, and `m - 1`.
#[inline(always)]
fn split(x: f64) -> (u64, f64) {
    const ROOT_OF_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    let bits = x.to_bits().wrapping_add((EXPONENT_OF_ONE << MANTISSA) - ROOT_OF_HALF);
    let m = f64::from_bits((bits & ((1 << MANTISSA) - 1)) + ROOT_OF_HALF);
    (bits >> MANTISSA, m - 1.0)
}

/// k as a number: in the last bits of 2^52.
#[inline(always)]
fn exponent(k: u64) -> f64 {
    const WHOLE: f64 = 4_503_599_627_370_496.0;
    f64::from_bits(k | WHOLE.to_bits()) - (WHOLE + EXPONENT_OF_ONE as f64)
}

/// `k ln 2 + ln(1 + f)`: with `s = f/(2 + f)`, `ln(1 + f) = f - s (f - R)` with the polynomial R(s) of
/// FDLIBM (Sun Microsystems, 1993), even and odd powers of s^2 apart.
#[inline(always)]
fn ln_of_parts(k: f64, f: f64) -> f64 {
    let s = f / (2.0 + f);
    let square = s * s;
    let fourth = square * square;
    let even = ((1.479_819_860_511_658_6e-1 * fourth + 1.818_357_216_161_805e-1) * fourth + 2.857_142_874_366_239e-1)
        * fourth
        + 6.666_666_666_666_735e-1;
    let odd = (1.531_383_769_920_937_3e-1 * fourth + 2.222_219_843_214_978_4e-1) * fourth + 3.999_999_999_940_942e-1;
    let r = even * square + odd * fourth;
    let half = 0.5 * f * f;
    k * LN_2[0] - ((half - (s * (half + r) + k * LN_2[1])) - f)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_short_functions_are_libm_s() {
        for i in 0..4000 {
            let x = f64::from(i) * 1e-3;
            assert!((super::log1p(x) - libm::log1p(x)).abs() <= 4e-16 * libm::log1p(x));
            for x in [-x, x, -180.0 * x] {
                let e = libm::exp(x);
                assert!((super::exp(x) - e).abs() <= 4e-16 * e, "{x}");
                let within = x.max(-700.0);
                assert!(
                    (super::exp_within(within) - libm::exp(within)).abs() <= 4e-16 * e.max(1e-304),
                    "{x}"
                );
            }
        }
        for i in -3000..3000 {
            let x = libm::exp(0.1003 * f64::from(i));
            let ln = libm::log(x);
            assert!((super::ln_of_normal(x) - ln).abs() <= 1e-15 * ln.abs().max(1.0), "{x}");
        }
        assert_eq!(super::ln_of_normal(1.0), 0.0);
        for i in -3000..3000 {
            let x = libm::exp(0.1003 * f64::from(i));
            let ln = libm::log1p(x);
            assert!((super::ln_1p(x) - ln).abs() <= 4e-16 * ln, "{x}");
        }
        assert_eq!(super::ln_1p(0.0), 0.0);
        for x in [0.0, -1.0, 5e-324, f64::INFINITY, f64::NAN, -f64::NAN] {
            assert!(super::ln_of_normal(x).is_finite(), "{x}");
        }
        assert_eq!(super::exp(f64::NEG_INFINITY), 0.0);
        assert!(super::exp(f64::NAN).is_nan() && super::log1p(1e300) == libm::log1p(1e300));
    }
}
