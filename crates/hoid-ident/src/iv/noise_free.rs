//! Noise-free signals of a closed loop, for use by other estimators.

use std::ops::Range;

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{Orders, Record};

use super::{columns::with_past, external_signal};
use crate::{IdentError, criterion::Data};

/// The part of e that follows an excitation, and the samples for which it is valid.
pub(crate) struct NoiseFreeInput {
    /// The part of e that follows the excitation, for each whole record.
    pub inputs: Vec<Vec<f64>>,
    /// Samples whose noise does not affect this input, counted through all records.
    pub samples: Range<usize>,
}

/// Returns the parts of e that follow this channel, one for each block of samples, with weights computed from the
/// samples outside the block ([`super::external_signal`]).
///
/// # Errors
/// [`IdentError::NoChannel`] if a record does not have the channel, [`IdentError::NoExcitation`] if the channel is
/// constant, and [`IdentError::BadOption`] if it is a signal of the loop.
pub(crate) fn noise_free_inputs(records: &[Record], channel: &str) -> Result<Vec<NoiseFreeInput>, IdentError> {
    let data = Data::of(records);
    let made = external_signal::noise_free_sources(&external_signal::external_signals(records, channel)?, &data);
    let of = |source: super::equation::Source<'_>| NoiseFreeInput {
        inputs: source.inputs.into_iter().map(std::borrow::Cow::into_owned).collect(),
        samples: source.samples,
    };
    Ok(made.into_iter().map(of).collect())
}

/// Returns `(B/F) q^-nk e`, simulated with an artificial past, for theta of a Box-Jenkins model.
pub(crate) fn simulated_output(orders: &Orders, theta: &[f64], e: &[f64]) -> Vec<f64> {
    let b = &theta[..orders.nb];
    let f = &theta[theta.len() - orders.nf..];
    let (extended, past) = with_past(e);
    let mut output = vec![0.0; extended.len()];
    fir(b, orders.nk, &extended, &mut output);
    divide_in_place(f, &mut output);
    output.drain(..past);
    output
}
