//! Checks whether records are informative enough for a model: equal sample times, no constant signals, more residuals
//! than unknowns.
//!
//! These conditions can be checked before the fit; linearly dependent regressors are detected by the fit itself.
//! Source: L. Ljung, *System Identification*, 1999, section 8.2 (informative data).

use hoid_model::{Orders, Record, SampleTime, Structure};

use crate::{IdentError, criterion::Criterion};

/// Returns the common sample time of all records.
///
/// # Errors
/// [`IdentError::NoRecords`], [`IdentError::MixedSampling`].
pub(crate) fn common_sample_time(records: &[Record]) -> Result<SampleTime, IdentError> {
    let first = records.first().ok_or(IdentError::NoRecords)?.sample_time();
    match records.iter().find(|r| !first.matches(r.sample_time())) {
        None => Ok(first),
        Some(other) => Err(IdentError::MixedSampling {
            label: other.label().to_owned(),
            found: other.sample_time().s(),
            expected: first.s(),
        }),
    }
}

/// Returns an error if a record cannot determine a model whose residuals start at sample `first`.
///
/// # Errors
/// [`IdentError::NoInput`], [`IdentError::NoExcitation`], [`IdentError::DelayTooLong`],
/// [`IdentError::TooFewSamples`].
pub(crate) fn check_record(
    structure: Structure,
    orders: &Orders,
    record: &Record,
    first: usize,
) -> Result<(), IdentError> {
    let label = || record.label().to_owned();
    if structure.has_input() && record.input_channel().is_none() {
        return Err(IdentError::NoInput {
            structure: structure.to_string(),
            label: label(),
        });
    }
    let input = record.input_channel().filter(|_| structure.has_input());
    for channel in input.into_iter().chain([record.output_channel()]) {
        let value = channel.values[0];
        if channel.values.iter().all(|v| *v == value) {
            return Err(IdentError::NoExcitation {
                channel: channel.name.clone(),
                label: label(),
            });
        }
    }
    if orders.nk >= record.len() {
        return Err(IdentError::DelayTooLong {
            nk: orders.nk,
            label: label(),
            samples: record.len(),
        });
    }
    let needed = first + orders.nf + orders.nc;
    if record.len() <= needed {
        return Err(IdentError::TooFewSamples {
            label: label(),
            samples: record.len(),
            orders: orders.to_string(),
            needed,
        });
    }
    Ok(())
}

/// Returns an error unless there are more residuals than unknowns: `N > p + s` with p parameters and s initial states.
///
/// # Errors
/// [`IdentError::TooFewSamples`].
pub(crate) fn check_degrees_of_freedom(criterion: &Criterion<'_>, records: &[Record]) -> Result<(), IdentError> {
    let unknowns = criterion.parameter_count() + criterion.state_count();
    if criterion.residual_count() > unknowns {
        return Ok(());
    }
    Err(IdentError::TooFewSamples {
        label: records[0].label().to_owned(),
        samples: records[0].len(),
        orders: criterion.orders.to_string(),
        needed: criterion.first + unknowns.div_ceil(records.len()),
    })
}
