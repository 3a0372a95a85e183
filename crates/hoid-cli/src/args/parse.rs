//! Values as they are typed: spans of numbers.

/// `LO..HI`, finite and in order.
pub fn parse_span(text: &str) -> Result<(f64, f64), String> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let ends = text
        .split_once("..")
        .and_then(|(low, high)| Some((number(low)?, number(high)?)));
    match ends {
        Some((low, high)) if low <= high => Ok((low, high)),
        _ => Err(format!("{text:?} is no span; write LO..HI with LO <= HI, as 0.05..0.6")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_as_typed() {
        assert_eq!(parse_span("0.05..0.6"), Ok((0.05, 0.6)));
        assert_eq!(parse_span("-1 .. -1"), Ok((-1.0, -1.0)));
        for bad in ["", "1", "2..1", "a..b", "0..inf", ".."] {
            assert!(parse_span(bad).is_err(), "{bad}");
        }
    }
}
