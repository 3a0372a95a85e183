//! Values as they are typed: spans of numbers, transfer functions.

use hoid_model::ContinuousTransferFunction;

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

/// `NUM/DEN`, coefficients by descending powers of s, separated by commas.
pub fn parse_transfer_function(text: &str) -> Result<ContinuousTransferFunction, String> {
    let usage = "write NUM/DEN by descending powers of s, as 90/1,6,0";
    let (num, den) = text
        .split_once('/')
        .ok_or_else(|| format!("{text:?} has no '/'; {usage}"))?;
    let coefficients = |part: &str| {
        part.split(',')
            .map(|c| {
                c.trim()
                    .parse::<f64>()
                    .map_err(|_| format!("{c:?} is no number; {usage}"))
            })
            .collect::<Result<Vec<f64>, String>>()
    };
    ContinuousTransferFunction::new(&coefficients(num)?, &coefficients(den)?).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfer_functions_as_typed() {
        let h = parse_transfer_function("90/1,6,0").unwrap();
        assert_eq!((h.num(), h.den()), (&[90.0][..], &[1.0, 6.0, 0.0][..]));
        for bad in ["90", "a/1", "1,0,0/1", "1/0", ""] {
            assert!(parse_transfer_function(bad).is_err(), "{bad}");
        }
    }
}
