//! The part of the input that follows an external signal.
//!
//! In a closed loop `e = S f_t + (a response to the noise)`. The response to f_t is estimated as an expansion in
//! Laguerre filters,
//!
//! `L_0 = sqrt(1 - p^2) / (1 - p q^-1)`,  `L_k = L_{k-1} (q^-1 - p) / (1 - p q^-1)`
//!
//! with weights computed by least squares (B. Wahlberg, *IEEE Trans. Automatic Control* 36 (1991) 551-562). A few dozen
//! filters cover the memory of a loop of several seconds, for which a finite impulse response would need hundreds of
//! lags. The expansion is always stable, and for a sum of sinusoids it is the projection on their lines.
//!
//! The sum depends only on f_t, so noise can affect it only through the weights. Components of the noise at the lines
//! of f_t enter the weights, and their effect is considerable if noise and f_t are both slow. Therefore the record is
//! divided into blocks, and the instruments of a block are computed with weights from the other blocks, whose noise is
//! independent of the noise in this block (split-sample instruments, J. D. Angrist and A. B. Krueger, *J. Business
//! Econ. Stat.* 13 (1995) 225-235). Poor weights then increase the variance but cause no bias.
//!
//! Instruments from an external signal were proposed by M. Gilson, H. Garnier, P. C. Young and P. Van den Hof, *IET
//! Control Theory Appl.* 5 (2011) 1147-1154; their construction uses the known controller, which for a human operator
//! is unknown.

use std::{borrow::Cow, ops::Range};

use hoid_core::filter::divide_in_place;
use hoid_model::Record;

use crate::{
    IdentError,
    criterion::Data,
    linalg::{
        least_squares::solve_symmetric,
        vectors::{add_scaled, dot},
    },
};

use super::{
    columns::{orthonormal_basis, split_by_record, with_past},
    equation::Source,
};

/// Candidate time constants of the filters in samples; the time constant with the smallest residual is used.
const TIME_CONSTANTS: [f64; 3] = [4.0, 16.0, 64.0];
/// Number of filters, if the records are long enough.
const FILTER_COUNT: usize = 24;
/// Minimum number of samples for each filter.
const MIN_SAMPLES_PER_FILTER: usize = 10;
/// Number of blocks; the input in each block is computed with weights from the other blocks.
const BLOCK_COUNT: usize = 4;
/// Ridge factor in the equations for the weights, needed if the output of a filter is concentrated in one block. The
/// scale of an instrument does not matter.
const RIDGE_FACTOR: f64 = 0.02;

/// Returns the external signal of each record.
///
/// # Errors
/// [`IdentError::NoChannel`] if a record does not have the channel, [`IdentError::NoExcitation`] if it is constant,
/// [`IdentError::BadOption`] if it is the input or the output.
pub(super) fn external_signals<'a>(records: &'a [Record], name: &str) -> Result<Vec<&'a [f64]>, IdentError> {
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
            });
        }
        let of_loop = [record.input_channel(), Some(record.output_channel())];
        if let Some(same) = of_loop.into_iter().flatten().find(|c| c.name == name) {
            return Err(IdentError::BadOption {
                option: "the channel of the instruments".to_owned(),
                found: format!("{}, which is in the loop", same.name),
                expected: "a signal from outside the loop, such as the forcing function".to_owned(),
            });
        }
    }
    Ok(found)
}

/// Returns the part of each input that follows the external signals, once for each block of samples, with weights
/// computed from the other blocks.
pub(super) fn noise_free_sources<'a>(external: &[&[f64]], data: &[Data<'a>]) -> Vec<Source<'a>> {
    let inputs: Vec<&[f64]> = data.iter().map(|d| d.e).collect();
    let lengths: Vec<usize> = inputs.iter().map(|e| e.len()).collect();
    let samples: usize = lengths.iter().sum();
    let target = inputs.concat();
    let basis = best_basis(external, &inputs);
    let whole: Vec<f64> = basis.iter().map(|q| dot(q, &target)).collect();
    (0..BLOCK_COUNT)
        .map(|k| {
            let block = k * samples / BLOCK_COUNT..(k + 1) * samples / BLOCK_COUNT;
            // The weights come from the other blocks. The noise of this block does not affect them, so it is not
            // correlated with the instrument.
            let weights =
                weights_outside_block(&basis, &whole, &target, block.clone()).unwrap_or_else(|| whole.clone());
            let sum = combination(&basis, &weights, samples);
            Source {
                inputs: split_by_record(&sum, &lengths).into_iter().map(Cow::Owned).collect(),
                samples: block,
            }
        })
        .collect()
}

/// Returns least-squares weights from the samples outside a block, shrunk slightly towards zero.
fn weights_outside_block(basis: &[Vec<f64>], whole: &[f64], target: &[f64], block: Range<usize>) -> Option<Vec<f64>> {
    let p = basis.len();
    let mut gram = vec![0.0; p * p];
    let mut right = whole.to_vec();
    for i in 0..p {
        let inside = &basis[i][block.clone()];
        // The normal equations are the equations of all samples minus the equations of the block. The basis is
        // orthonormal over all samples, so its Gram matrix is the identity.
        right[i] -= dot(inside, &target[block.clone()]);
        for j in 0..p {
            let unit = if i == j { 1.0 + RIDGE_FACTOR } else { 0.0 };
            gram[i * p + j] = unit - dot(inside, &basis[j][block.clone()]);
        }
    }
    solve_symmetric(&gram, &right)
}

/// Returns the part of each target that follows its driving signal, estimated with one filter for all records.
pub(super) fn driven_parts(driving: &[&[f64]], targets: &[&[f64]]) -> Vec<Vec<f64>> {
    let lengths: Vec<usize> = targets.iter().map(|t| t.len()).collect();
    let target = targets.concat();
    let basis = best_basis(driving, targets);
    let weights: Vec<f64> = basis.iter().map(|q| dot(q, &target)).collect();
    split_by_record(&combination(&basis, &weights, target.len()), &lengths)
}

fn combination(basis: &[Vec<f64>], weights: &[f64], samples: usize) -> Vec<f64> {
    let mut sum = vec![0.0; samples];
    for (q, weight) in basis.iter().zip(weights) {
        add_scaled(&mut sum, *weight, q);
    }
    sum
}

/// Returns an orthonormal basis of the filter outputs over all records, for the time constant whose filters explain the
/// largest share of the targets.
fn best_basis(driving: &[&[f64]], targets: &[&[f64]]) -> Vec<Vec<f64>> {
    let target = targets.concat();
    let filters = FILTER_COUNT.min(target.len() / MIN_SAMPLES_PER_FILTER).max(1);
    let mut best = (-1.0, Vec::new());
    for time_constant in TIME_CONSTANTS {
        let (basis, _) = orthonormal_basis(&laguerre_outputs(driving, (-1.0 / time_constant).exp(), filters));
        let explained: f64 = basis.iter().map(|q| dot(q, &target).powi(2)).sum();
        if explained > best.0 {
            best = (explained, basis);
        }
    }
    best.1
}

/// Returns the outputs of the Laguerre filters with the pole p, over all records.
fn laguerre_outputs(driving: &[&[f64]], p: f64, filters: usize) -> Vec<Vec<f64>> {
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
    fn laguerre_filters_are_orthonormal() {
        let mut impulse = vec![0.0; 4000];
        // The impulse comes after the samples from which the artificial past is computed.
        impulse[300] = 1.0;
        let columns = laguerre_outputs(&[&impulse], 0.9, 12);
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                // 0.9^4000 is below rounding.
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn delayed_response_to_the_signal_is_found() {
        let n = 4000;
        let x: Vec<f64> = (0..n)
            .map(|t| (0.05 * f64::from(t)).sin() + (0.31 * f64::from(t)).sin())
            .collect();
        let mut y = vec![0.0; x.len()];
        hoid_core::filter::fir(&[0.1], 20, &x, &mut y);
        divide_in_place(&[-1.7, 0.8], &mut y);
        let found = driven_parts(&[&x], &[&y]);
        let rest: f64 = found[0].iter().zip(&y).skip(200).map(|(a, b)| (a - b).powi(2)).sum();
        assert!(rest < 1e-4 * dot(&y, &y), "{}", rest / dot(&y, &y));
    }
}
