//! Parsers of values typed by users: numbers with a range, spans of numbers, widths of figures.

/// Parses `LO..HI`, two finite numbers in ascending order.
pub fn parse_span(text: &str) -> Result<(f64, f64), String> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let ends = text
        .split_once("..")
        .and_then(|(low, high)| Some((number(low)?, number(high)?)));
    match ends {
        Some((low, high)) if low <= high => Ok((low, high)),
        _ => Err(format!(
            "{text:?} is not a span; write LO..HI with LO <= HI, such as 0.05..0.6"
        )),
    }
}

/// Parses a width on paper, such as `85mm`, `8.5cm` or `3.3in`, and returns it in mm.
pub fn parse_width(text: &str) -> Result<f64, String> {
    let units = [("mm", 1.0), ("cm", 10.0), ("in", 25.4)];
    let of = |(unit, mm): (&str, f64)| Some(text.trim().strip_suffix(unit)?.trim().parse::<f64>().ok()? * mm);
    units
        .into_iter()
        .find_map(of)
        .filter(|mm| (10.0..=2000.0).contains(mm))
        .ok_or_else(|| {
            format!("{text:?} is not a width; write a width from 10mm to 2000mm, such as 85mm, 17cm or 3.3in")
        })
}

/// Parses a number of samples, at least one.
pub fn parse_count(text: &str) -> Result<usize, String> {
    let count = text.trim().parse().ok().filter(|n| *n > 0);
    count.ok_or_else(|| format!("{text:?} is not a number of samples; write a whole number, 1 or more"))
}

/// Parses a frequency in Hz.
pub fn parse_frequency(text: &str) -> Result<f64, String> {
    positive_number(text)
        .ok_or_else(|| format!("{text:?} is not a frequency; write a positive number in Hz, such as 100"))
}

/// Parses a duration in s.
pub fn parse_duration(text: &str) -> Result<f64, String> {
    positive_number(text).ok_or_else(|| format!("{text:?} is not a duration; write a positive number in s, such as 5"))
}

fn positive_number(text: &str) -> Option<f64> {
    let number = text.trim().parse().ok();
    number.filter(|x: &f64| *x > 0.0 && x.is_finite())
}

/// Longest prediction horizon, samples.
const MAX_HORIZON: usize = 1_000_000;

/// Parses a prediction horizon in samples.
pub fn parse_horizon(text: &str) -> Result<usize, String> {
    let samples = text.trim().parse().ok().filter(|k| (1..=MAX_HORIZON).contains(k));
    samples.ok_or_else(|| {
        format!("{text:?} is not a prediction horizon; write a number of samples from 1 to {MAX_HORIZON}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_frequencies_and_durations_are_parsed() {
        assert!(parse_count("0").is_err() && parse_frequency("0").is_err() && parse_duration("nan").is_err());
        assert_eq!((parse_count(" 7 "), parse_frequency("100")), (Ok(7), Ok(100.0)));
    }

    #[test]
    fn widths_are_parsed() {
        assert_eq!(parse_width("85mm"), Ok(85.0));
        assert_eq!(parse_width(" 17 cm"), Ok(170.0));
        assert!((parse_width("3.3in").unwrap() - 83.82).abs() < 1e-12);
        for bad in ["", "85", "mm", "-85mm", "1e9mm", "NaNmm", "85px"] {
            assert!(parse_width(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn spans_are_parsed() {
        assert_eq!(parse_span("0.05..0.6"), Ok((0.05, 0.6)));
        assert_eq!(parse_span("-1 .. -1"), Ok((-1.0, -1.0)));
        for bad in ["", "1", "2..1", "a..b", "0..inf", ".."] {
            assert!(parse_span(bad).is_err(), "{bad}");
        }
    }
}
