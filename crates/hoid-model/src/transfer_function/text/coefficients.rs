//! Coefficients in descending powers of s: `90/1,6,0`.

use super::ratio::Ratio;

pub(super) const EXAMPLES: &str = "write it as 90/(s(s+6)), or as 90/1,6,0 in descending powers of s";

/// Parses the numerator and the denominator, at least one of which contains commas.
pub(super) fn coefficients(text: &str) -> Result<Ratio, String> {
    let Some((num, den)) = text.split_once('/') else {
        return Err(format!("it has commas but no '/'; {EXAMPLES}"));
    };
    let list = |part: &str, before: usize| -> Result<Vec<f64>, String> {
        let mut at = before;
        part.split(',')
            .map(|c| {
                let here = at + c.chars().take_while(|sign| sign.is_whitespace()).count() + 1;
                at += c.chars().count() + 1;
                let finite = |v: &f64| v.is_finite();
                c.trim().parse::<f64>().ok().filter(finite).ok_or_else(|| {
                    let found = if c.trim().is_empty() { "nothing" } else { c.trim() };
                    format!("at character {here} there is {found}, expected a coefficient (a number); {EXAMPLES}")
                })
            })
            .collect()
    };
    Ok(Ratio {
        num: list(num, 0)?,
        den: list(den, num.chars().count() + 1)?,
        delay_s: 0.0,
    })
}
