//! The part of the input that follows an external signal.
//!
//! In a closed loop `e = S f_t + (a response to the noise)`. The response to f_t is estimated as an expansion in Laguerre filters
//!
//! `L_0 = sqrt(1 - p^2) / (1 - p q^-1)`,  `L_k = L_{k-1} (q^-1 - p) / (1 - p q^-1)`
//!
//! whose weights are found by least squares (B. Wahlberg, *IEEE Trans. Automatic Control* 36 (1991) 551-562). A few dozen of them
//! span the seconds that a loop remembers, where a finite impulse response would need hundreds of lags; the expansion is always
//! stable; and for a sum of sinusoids it is the projection on their lines. Whatever its quality, the sum is made of f_t alone, at
//! rest at the start of the record, so that the noise reaches it only through the weights: a share `K/N` of the noise power with
//! K filters and N samples. Poor quality costs variance, not bias.
//!
//! The construction of instruments from an external signal is that of M. Gilson, H. Garnier, P. C. Young and P. Van den Hof, *IET
//! Control Theory Appl.* 5 (2011) 1147-1154; they use the known controller, which a person in the loop does not offer.

use std::borrow::Cow;

use hoid_core::filter::divide_in_place;
use hoid_model::Record;

use crate::{
    IdentError,
    least_squares::{add_scaled, dot},
    prediction_error::Data,
};

use super::equation::{orthonormal, with_past};

/// Time constants of the filters in samples; the one with the smallest rest is taken.
const TIME_CONSTANTS: [f64; 3] = [4.0, 16.0, 64.0];
/// Number of filters, where the records are long enough.
const FILTERS: usize = 24;
/// Samples for each filter.
const SAMPLES_EACH: usize = 10;

/// The external signal of each record.
///
/// # Errors
/// [`IdentError::NoChannel`], [`IdentError::NoExcitation`].
pub(super) fn signals<'a>(records: &'a [Record], name: &str) -> Result<Vec<&'a [f64]>, IdentError> {
    let found: Vec<&[f64]> = records
        .iter()
        .map(|record| {
            record.channel(name).ok_or_else(|| IdentError::NoChannel {
                channel: name.to_owned(),
                label: record.label().to_owned(),
                available: record
                    .channels()
                    .map(|c| c.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", "),
            })
        })
        .collect::<Result<_, _>>()?;
    for (signal, record) in found.iter().zip(records) {
        if signal.iter().all(|v| *v == signal[0]) {
            return Err(IdentError::NoExcitation {
                channel: name.to_owned(),
                label: record.label().to_owned(),
                value: signal[0],
            });
        }
        let of_loop = [record.input_channel(), Some(record.output_channel())];
        if let Some(same) = of_loop.into_iter().flatten().find(|c| c.name == name) {
            return Err(IdentError::BadOption {
                option: "the channel of the instruments".to_owned(),
                found: format!("{}, which is in the loop", same.name),
                expected: "a signal from outside, such as the forcing function".to_owned(),
            });
        }
    }
    Ok(found)
}

/// The part of each input that follows the external signals.
pub(super) fn noise_free<'a>(external: &[&[f64]], data: &[Data<'a>]) -> Vec<Cow<'a, [f64]>> {
    let inputs: Vec<&[f64]> = data.iter().map(|d| d.e).collect();
    following(external, &inputs).into_iter().map(Cow::Owned).collect()
}

/// The part of each target that follows its driving signal, through one filter for all records.
pub(super) fn following(driving: &[&[f64]], targets: &[&[f64]]) -> Vec<Vec<f64>> {
    let samples: usize = targets.iter().map(|t| t.len()).sum();
    let filters = FILTERS.min(samples / SAMPLES_EACH).max(1);
    let target: Vec<f64> = targets.concat();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for time_constant in TIME_CONSTANTS {
        let columns = laguerre(driving, (-1.0 / time_constant).exp(), filters);
        let (basis, _) = orthonormal(&columns);
        let mut sum = vec![0.0; samples];
        let mut explained = 0.0;
        for q in &basis {
            let component = dot(q, &target);
            explained += component * component;
            add_scaled(&mut sum, component, q);
        }
        if best.as_ref().is_none_or(|(most, _)| explained > *most) {
            best = Some((explained, sum));
        }
    }
    let sum = best.map(|(_, sum)| sum).unwrap_or_default();
    let rows: Vec<usize> = targets.iter().map(|t| t.len()).collect();
    super::equation::cut(&sum, &rows)
}

/// Outputs of the filters with the pole p, over all records.
fn laguerre(driving: &[&[f64]], p: f64, filters: usize) -> Vec<Vec<f64>> {
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); filters];
    for x in driving {
        let gain = (1.0 - p * p).sqrt();
        let (mut state, before) = with_past(x);
        state.iter_mut().for_each(|v| *v *= gain);
        divide_in_place(&[-p], &mut state);
        for column in &mut columns {
            column.extend_from_slice(&state[before..]);
            let mut past = 0.0;
            for v in &mut state {
                let now = *v;
                *v = past - p * now;
                past = now;
            }
            divide_in_place(&[-p], &mut state);
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_orthonormal() {
        let mut impulse = vec![0.0; 4000];
        // Behind the samples that the invented past is made of.
        impulse[300] = 1.0;
        let columns = laguerre(&[&impulse], 0.9, 12);
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                // 0.9^4000 is beyond rounding.
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn the_part_of_a_delayed_response_is_found() {
        let n = 4000;
        let x: Vec<f64> = (0..n)
            .map(|t| (0.05 * f64::from(t)).sin() + (0.31 * f64::from(t)).sin())
            .collect();
        let mut y = vec![0.0; x.len()];
        hoid_core::filter::moving_sum(&[0.1], 20, &x, &mut y);
        divide_in_place(&[-1.7, 0.8], &mut y);
        let found = following(&[&x], &[&y]);
        let rest: f64 = found[0].iter().zip(&y).skip(200).map(|(a, b)| (a - b).powi(2)).sum();
        assert!(rest < 1e-4 * dot(&y, &y), "{}", rest / dot(&y, &y));
    }
}
