//! Numbers with as many digits as their standard error allows.
//!
//! A standard error is itself accurate to a few per cent at best. It is therefore given with two significant digits,
//! and the value with the same number of decimals (ISO/IEC Guide 98-3, 7.2.6). Numbers without a standard error are
//! given with five significant digits. No value has more than eight significant digits; a standard error that needs
//! more has its own exponent.

use std::fmt;

/// Text for a missing number.
pub const DASH: &str = "\u{2013}";

/// Two-sided 95 % point of the normal distribution.
pub const Z_95: f64 = 1.959_963_984_540_054;

const DIGITS_OF_ERROR: i32 = 2;
const DIGITS_WITHOUT_ERROR: i32 = 5;

/// Relative standard error below which the standard error is attributed to rounding.
const ROUNDING_RELATIVE_ERROR: f64 = 16.0 * f64::EPSILON;
/// Largest number of significant digits of a value with a standard error.
const MAX_DIGITS: i32 = 8;

/// Returns the value and the standard error as text, with as many decimals as two significant digits of the standard
/// error need, but at most eight significant digits; a smaller standard error has its own exponent. If the standard
/// error is only a rounding error, a dash replaces it. A value that is not finite gives two dashes.
pub fn with_uncertainty(value: f64, standard_error: Option<f64>) -> (String, String) {
    if !value.is_finite() {
        return (DASH.to_owned(), DASH.to_owned());
    }
    match standard_error.filter(|s| s.is_finite() && *s > 0.0) {
        None => (format_plain(value), DASH.to_owned()),
        Some(error) if error < ROUNDING_RELATIVE_ERROR * value.abs() => {
            (format_significant(value, MAX_DIGITS), DASH.to_owned())
        }
        Some(error) => {
            let last = last_digit(error, DIGITS_OF_ERROR);
            if last < last_digit(value, MAX_DIGITS) && error < value.abs() {
                let error = format!("{error:.*e}", (DIGITS_OF_ERROR - 1) as usize);
                return (format_significant(value, MAX_DIGITS), error);
            }
            let exponent = exponent_for(value.abs().max(error));
            (
                format_digits(value, last, exponent),
                format_digits(error, last, exponent),
            )
        }
    }
}

/// Returns the interval `value +- factor * standard_error` with the decimals of [`with_uncertainty`]; a dash if there
/// is no standard error.
pub fn interval(value: f64, standard_error: Option<f64>, factor: f64) -> String {
    match standard_error.filter(|s| s.is_finite() && *s > 0.0 && value.is_finite()) {
        None => DASH.to_owned(),
        Some(error) => {
            let size = value.abs().max(error);
            let last = last_digit(error, DIGITS_OF_ERROR).max(last_digit(size, MAX_DIGITS));
            let (low, high) = (value - factor * error, value + factor * error);
            let exponent = exponent_for(size);
            format!(
                "{} to {}",
                format_digits(low, last, exponent),
                format_digits(high, last, exponent)
            )
        }
    }
}

/// Returns a count with its noun, such as "1 row" or "7 rows".
pub fn count_with_noun<N: PartialEq + From<u8> + fmt::Display>(n: N, noun: &str) -> String {
    if n == N::from(1) {
        format!("1 {noun}")
    } else {
        format!("{n} {noun}s")
    }
}

/// Smallest p-value that is printed as a number; a distribution has no meaning so far in its tail.
const MIN_P_VALUE: f64 = 1e-16;

/// Formats a p-value as a relation such as `p = 0.03`, so that it is never rounded to 0 or 1.
pub fn format_p_value(p: f64) -> String {
    match p {
        p if p > 0.99 => "p > 0.99".to_owned(),
        p if p < MIN_P_VALUE => format!("p < {MIN_P_VALUE:.0e}"),
        p if p < 0.01 => format!("p = {p:.0e}"),
        p => format!("p = {p:.2}"),
    }
}

/// Returns a number without a standard error, with five significant digits; a dash for non-finite values.
pub fn format_plain(value: f64) -> String {
    format_significant(value, DIGITS_WITHOUT_ERROR)
}

/// Returns a number with `digits` significant digits; a dash for non-finite values.
pub fn format_significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return DASH.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent_for(value.abs());
    let text = format_digits(value, last_digit(value, digits), exponent);
    match exponent {
        0 => without_trailing_zeros(&text).to_owned(),
        _ => text,
    }
}

/// Returns a number with a fixed number of decimals; a dash for non-finite values.
pub fn format_fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return DASH.to_owned();
    }
    without_negative_zero(format!("{value:.decimals$}"))
}

/// Returns the power of ten of the last significant digit.
fn last_digit(value: f64, digits: i32) -> i32 {
    // The number is rounded before its exponent is determined: 0.0996 with two digits is 0.10, not 0.100.
    let text = format!("{:.*e}", (digits - 1) as usize, value.abs());
    let exponent: i32 = text.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    exponent - (digits - 1)
}

/// Returns the exponent of a number in scientific notation; zero for numbers that are written without an exponent.
fn exponent_for(size: f64) -> i32 {
    let exponent = size.log10().floor();
    if (-3.0..6.0).contains(&exponent) {
        0
    } else {
        exponent as i32
    }
}

fn format_digits(value: f64, last: i32, exponent: i32) -> String {
    let decimals = (exponent - last).clamp(0, 17) as usize;
    if exponent == 0 {
        return without_negative_zero(format!("{value:.decimals$}"));
    }
    // The number is scaled in two steps, because 10^exponent is out of range for the smallest numbers.
    let scaled = value / 10f64.powi(exponent / 2) / 10f64.powi(exponent - exponent / 2);
    without_negative_zero(format!("{scaled:.decimals$}e{exponent}"))
}

fn without_negative_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest)
            if !rest
                .split('e')
                .next()
                .unwrap_or("")
                .contains(|c: char| c.is_ascii_digit() && c != '0') =>
        {
            rest.to_owned()
        }
        _ => text,
    }
}

fn without_trailing_zeros(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value_and_error(value: f64, error: f64) -> (String, String) {
        with_uncertainty(value, Some(error))
    }

    fn pair(a: &str, b: &str) -> (String, String) {
        (a.to_owned(), b.to_owned())
    }

    #[test]
    fn error_sets_the_number_of_digits() {
        assert_eq!(value_and_error(0.090_123_4, 0.001_234), pair("0.0901", "0.0012"));
        assert_eq!(value_and_error(11.2499, 0.0996), pair("11.25", "0.10"));
        assert_eq!(value_and_error(-1.912_113_05, 0.000_52), pair("-1.91211", "0.00052"));
        assert_eq!(value_and_error(1234.5, 120.0), pair("1234", "120"));
        assert_eq!(value_and_error(1.234_56e-7, 2.3e-9), pair("1.235e-7", "0.023e-7"));
        assert_eq!(value_and_error(0.3, 12.3), pair("0", "12"));
        assert_eq!(value_and_error(-0.001, 0.52), pair("0.00", "0.52"));
        assert_eq!(value_and_error(5.0e9, 1.0e8), pair("5.00e9", "0.10e9"));
    }

    #[test]
    fn rounding_sized_error_is_a_dash() {
        assert_eq!(value_and_error(0.35 - 1e-16, 1e-17), pair("0.35", DASH));
        assert_eq!(value_and_error(-0.499_999_999_999_999_9, 1.2e-16), pair("-0.5", DASH));
    }

    #[test]
    fn value_has_at_most_eight_digits() {
        assert_eq!(value_and_error(0.5, 1e-13), pair("0.5", "1.0e-13"));
        assert_eq!(
            with_uncertainty(1.563_463_998_094_07, Some(1e-16)),
            pair("1.563464", DASH)
        );
        assert_eq!(
            value_and_error(-114.573_496_389_99, 7.7e-13),
            pair("-114.5735", "7.7e-13")
        );
        assert_eq!(value_and_error(0.0, 6e-15), pair("0.0e-15", "6.0e-15"));
        assert_eq!(value_and_error(1.234_567_89, 1.2e-6), pair("1.2345679", "0.0000012"));
        assert_eq!(
            interval(1.563_463_998_094_07, Some(1e-13), 1.96),
            "1.5634640 to 1.5634640"
        );
    }

    #[test]
    fn non_finite_numbers_are_a_dash() {
        assert_eq!(value_and_error(f64::NAN, 1.0), pair(DASH, DASH));
        assert_eq!(with_uncertainty(f64::INFINITY, None), pair(DASH, DASH));
        assert_eq!(value_and_error(0.25, f64::NAN), pair("0.25", DASH));
        assert_eq!(value_and_error(0.25, 0.0), pair("0.25", DASH));
        assert_eq!(format_plain(f64::NAN), DASH);
        assert_eq!(format_fixed(f64::NEG_INFINITY, 1), DASH);
        assert_eq!(interval(1.0, None, 1.96), DASH);
    }

    #[test]
    fn numbers_without_error_have_five_digits() {
        assert_eq!(format_plain(0.28), "0.28");
        assert_eq!(format_plain(0.0), "0");
        assert_eq!(format_plain(13.714_285), "13.714");
        assert_eq!(format_plain(1.373_21e-3), "0.0013732");
        assert_eq!(format_plain(1.373_21e-4), "1.3732e-4");
        assert_eq!(format_plain(1.373_21e-5), "1.3732e-5");
        assert_eq!(format_plain(123_456.0), "123456");
        assert_eq!(format_plain(-8192.0), "-8192");
        assert_eq!(format_plain(f64::MIN_POSITIVE), "2.2251e-308");
        assert_eq!(format_fixed(-0.04, 1), "0.0");
    }

    #[test]
    fn intervals_use_the_decimals_of_the_error() {
        assert_eq!(interval(0.0901, Some(0.0012), 1.96), "0.0877 to 0.0925");
    }
}
