//! Transfer functions of controlled elements as a manifest writes them.

use hoid_model::ContinuousTransferFunction;

/// `numerator/denominator`, coefficients by falling powers of s, separated by commas.
pub(super) fn transfer_function(text: &str) -> Result<ContinuousTransferFunction, String> {
    let usage = "expected NUM/DEN by falling powers of s, such as 1/1,1,0";
    let (numerator, denominator) = text
        .split_once('/')
        .ok_or_else(|| format!("{text:?} has no slash; {usage}"))?;
    let coefficients = |part: &str| -> Result<Vec<f64>, String> {
        let number = |c: &str| {
            c.trim()
                .parse::<f64>()
                .map_err(|_| format!("{c:?} is no number; {usage}"))
        };
        part.split(',').map(number).collect()
    };
    ContinuousTransferFunction::new(&coefficients(numerator)?, &coefficients(denominator)?)
        .map_err(|error| error.to_string())
}
