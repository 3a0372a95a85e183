//! Precision of the printed numbers of a column.

use std::ops::RangeInclusive;

/// Largest number of decimals at which rounding of binary times is recognised (1 µs).
const MAX_DECIMALS: i32 = 6;
/// Numbers of significant digits at which rounding of binary times is recognised.
const SIGNIFICANT_DIGITS: RangeInclusive<i32> = 5..=7;

/// Precision with which a column of decimal numbers is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Precision {
    /// Largest number of decimals of any value; `None` if the values come from binary numbers that were not rounded.
    decimals: Option<i32>,
    /// Largest number of significant digits of any value; 0 if only the decimals are known.
    significant: i32,
}

impl Precision {
    /// Precision of binary single-precision numbers: seven significant digits.
    pub(crate) fn single() -> Self {
        Self {
            decimals: Some(45),
            significant: 7,
        }
    }

    /// Determines the precision of times stored as binary numbers. If a recorder rounds its times, for example to
    /// tenths of a ms, all times are multiples of one unit of the last decimal, which reveals the rounding; with a
    /// fixed number of significant digits, each time is a multiple of its own unit. A rounded
    /// number deviates from such a multiple by less than two units of its last binary digit; for the numbers of
    /// decimals tried here, numbers that were not rounded are not so close to a multiple by chance.
    pub(crate) fn from_times(values: &[f64], single: bool) -> Self {
        if single {
            return Self::single();
        }
        let is_multiple = |value: f64, decimals: i32| {
            let scaled = value * 10_f64.powi(decimals);
            (scaled - scaled.round()).abs() <= 2.0 * f64::EPSILON * scaled.abs()
        };
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let is_rounded = |decimals: &i32| finite().all(|value| is_multiple(value, *decimals));
        let decimals = (0..=MAX_DECIMALS).find(is_rounded);
        let decimals_of = |value: f64, digits: i32| digits.saturating_sub(1).saturating_sub(magnitude(value));
        let non_zero = || finite().filter(|value| *value != 0.0);
        let digits = SIGNIFICANT_DIGITS
            .clone()
            .find(|digits| non_zero().all(|v| is_multiple(v, decimals_of(v, *digits))));
        Self {
            decimals: decimals.or_else(|| {
                non_zero()
                    .map(|value| Some(decimals_of(value, digits?)))
                    .max()
                    .flatten()
            }),
            significant: digits.unwrap_or(0),
        }
    }

    /// Updates the precision with another printed number of the column.
    pub(crate) fn add(&mut self, text: &str) {
        self.add_bytes(text.trim().as_bytes());
    }

    /// Updates the precision with another printed number, which must have no surrounding blanks.
    pub(crate) fn add_bytes(&mut self, text: &[u8]) {
        let mut parts = text.splitn(2, |byte| matches!(byte, b'e' | b'E' | b'd' | b'D'));
        let digits = parts.next().unwrap_or_default();
        let written = parts
            .next()
            .and_then(|text| std::str::from_utf8(text).ok()?.parse().ok());
        let exponent = written.map_or(0, |exponent: i32| exponent.clamp(-400, 400));
        let fraction_digits = digits
            .iter()
            .skip_while(|byte| **byte != b'.')
            .filter(|byte| byte.is_ascii_digit());
        let significant = digits
            .iter()
            .filter(|byte| byte.is_ascii_digit())
            .skip_while(|byte| **byte == b'0');
        let decimals = digit_count(fraction_digits).saturating_sub(exponent);
        self.decimals = Some(self.decimals.unwrap_or(i32::MIN).max(decimals));
        self.significant = self.significant.max(digit_count(significant));
    }

    /// Updates the precision with that of another part of the column.
    pub(crate) fn join(&mut self, other: Self) {
        self.decimals = self.decimals.max(other.decimals);
        self.significant = self.significant.max(other.significant);
    }

    /// Updates the precision with another number that has the given number of decimals.
    pub(crate) fn add_decimals(&mut self, decimals: usize) {
        self.decimals = Some(self.decimals.unwrap_or(0).max(decimals as i32));
    }

    /// Returns the precision of the same numbers multiplied by a power of ten.
    pub(crate) fn scale_by_power_of_ten(self, power: i32) -> Self {
        Self {
            decimals: self.decimals.map(|decimals| decimals.saturating_sub(power)),
            ..self
        }
    }

    /// Returns the precision limited to a number of decimals, as of binary numbers far from zero.
    pub(crate) fn limit_decimals(self, decimals: i32) -> Self {
        Self {
            decimals: Some(self.decimals.map_or(decimals, |own| own.min(decimals))),
            ..self
        }
    }

    /// Returns the magnitude below which the number of decimals determines the unit, and this unit.
    pub(crate) fn fixed_unit(self) -> (f64, f64) {
        match self.decimals {
            None => (f64::INFINITY, 0.0),
            Some(decimals) if self.significant == 0 => (f64::INFINITY, last_digit(decimals)),
            Some(decimals) => (
                10_f64.powi(self.significant.saturating_sub(decimals)),
                last_digit(decimals),
            ),
        }
    }

    /// Returns one unit of the last printed digit of a value. With a fixed number of decimals the unit is constant;
    /// with a fixed number of significant digits it grows with the value.
    pub(crate) fn unit(self, value: f64) -> f64 {
        let Some(decimals) = self.decimals else { return 0.0 };
        let fixed = last_digit(decimals);
        if self.significant == 0 || value == 0.0 || !value.is_finite() {
            return fixed;
        }
        let digits = magnitude(value).saturating_add(1);
        fixed.max(10_f64.powi(digits.saturating_sub(self.significant)))
    }
}

/// Returns the power of ten of the first significant digit of a value.
fn magnitude(value: f64) -> i32 {
    value.abs().log10().floor() as i32
}

/// Returns one unit of the last decimal.
fn last_digit(decimals: i32) -> f64 {
    10_f64.powi(decimals.saturating_neg())
}

fn digit_count(digits: impl Iterator) -> i32 {
    i32::try_from(digits.count()).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn precision(texts: &[&str]) -> Precision {
        let mut precision = Precision::default();
        texts.iter().for_each(|text| precision.add(text));
        precision
    }

    #[test]
    fn last_digit_unit_follows_the_printed_format() {
        let fixed = precision(&["0.0000", "0.0167", "45.0167"]);
        for t in [0.0, 0.0167, 45.0] {
            assert!((fixed.unit(t) - 1e-4).abs() < 1e-18, "{t}");
        }
        // Some programs print five significant digits: at 100 s one unit of the last digit is 0.01.
        let significant = precision(&["0", "0.016667", "1.0167", "100.02"]);
        assert!((significant.unit(100.02) - 1e-2).abs() < 1e-15);
        assert!((significant.unit(0.016667) - 1e-6).abs() < 1e-18);
        assert!((precision(&["1.67e-02", "1.00e-01"]).unit(0.0167) - 1e-4).abs() < 1e-18);
        assert_eq!(precision(&["0", "1", "120"]).unit(3.0), 1.0);
        for texts in [
            &["0.00", "12.34"][..],
            &["0", "0.016667", "1.0167", "100.02"],
            &["1.67e-02", "1.00e-01"],
            &["120"],
        ] {
            let (limit, unit) = precision(texts).fixed_unit();
            for value in [0.5, 0.99, 0.999_999] {
                assert_eq!(precision(texts).unit(value * limit), unit, "{texts:?}");
            }
            assert!(precision(texts).unit(10.0 * limit) > unit, "{texts:?}");
        }
        assert!(precision(&["0.30000000000000004"]).unit(0.3) < 1e-15);
        assert_eq!(Precision::default().unit(3.0), 0.0);
        // The unit is a valid number for any file content.
        assert!(precision(&["1e-99999999999", ".", "-", "e"]).unit(1e300) >= 0.0);
    }

    #[test]
    fn rounded_times_are_detected() {
        let times = |rate_hz: f64| (0..5000).map(move |k| f64::from(k) / rate_hz);
        let rounded: Vec<f64> = times(60.0).map(|t| (t * 1e4).round() / 1e4).collect();
        assert!((Precision::from_times(&rounded, false).unit(45.0) - 1e-4).abs() < 1e-18);
        let hundredths: Vec<f64> = (0..5000).map(|k| f64::from(k) * 0.01).collect();
        assert!((Precision::from_times(&hundredths, false).unit(45.0) - 1e-2).abs() < 1e-16);
        let exact: Vec<f64> = times(60.0).collect();
        assert_eq!(Precision::from_times(&exact, false).unit(45.0), 0.0);
        assert_eq!(Precision::from_times(&exact, true), Precision::single());
        // Times with NaN are reported elsewhere; here NaN is ignored.
        assert_eq!(Precision::from_times(&[f64::NAN, 0.5], false).unit(1.0), 0.1);
    }
}
