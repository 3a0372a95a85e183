//! What is refused before a fit begins.

use hoid_model::{Orders, Record, SampleTime, Structure};

use crate::{Estimator, Focus, IdentError, Loss, pem::criterion::Criterion};

/// Options that contradict each other, the structure or common sense.
pub(crate) fn options(estimator: &Estimator) -> Result<(), IdentError> {
    let mut asked = estimator.constraints.keys().chain(estimator.priors.keys()).peekable();
    // An ordinary fit asks for none, and its names are not made.
    let names = asked
        .peek()
        .map_or_else(Vec::new, |_| estimator.orders.parameter_names());
    for name in asked {
        if !names.contains(name) {
            return Err(IdentError::UnknownParameter {
                name: name.clone(),
                available: names.join(", "),
            });
        }
    }
    if let Some((name, constraint)) = estimator.constraints.iter().find(|(_, c)| !c.is_sound()) {
        return Err(IdentError::BadOption {
            option: format!("the constraint on {name}"),
            found: format!("{constraint:?}"),
            expected: "a finite value, or a lower bound that does not exceed the upper one".to_owned(),
        });
    }
    let unsound = |p: &crate::Prior| !(p.value.is_finite() && p.weight.is_finite() && p.weight >= 0.0);
    if let Some((name, prior)) = estimator.priors.iter().find(|(_, p)| unsound(p)) {
        return Err(IdentError::BadOption {
            option: format!("the prior of {name}"),
            found: format!("value {}, weight {}", prior.value, prior.weight),
            expected: "a finite value and a weight that is not negative".to_owned(),
        });
    }
    if let Loss::Huber { threshold } = estimator.loss
        && !(threshold.is_finite() && threshold > 0.0)
    {
        return Err(IdentError::BadOption {
            option: "the threshold of the robust loss".to_owned(),
            found: threshold.to_string(),
            expected: "a positive number of standard deviations, such as 1.345".to_owned(),
        });
    }
    if estimator.focus == Focus::Simulation {
        if !estimator.structure.has_input() {
            return Err(IdentError::BadOption {
                option: "the focus".to_owned(),
                found: format!("simulation with {}", estimator.structure),
                expected: "a structure with an input; without one there is nothing to simulate".to_owned(),
            });
        }
        if estimator.orders.na > 0 && estimator.orders.nf > 0 {
            return Err(IdentError::BadOption {
                option: "the focus".to_owned(),
                found: format!("simulation with {}", estimator.orders),
                expected: "na = 0 or nf = 0: the simulation error does not tell A from F".to_owned(),
            });
        }
    }
    Ok(())
}

/// The sample time that all records have.
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

/// A record that cannot determine a model whose residuals start at sample `first`.
pub(crate) fn record(structure: Structure, orders: &Orders, record: &Record, first: usize) -> Result<(), IdentError> {
    let label = || record.label().to_owned();
    if structure.has_input() && record.input_channel().is_none() {
        return Err(IdentError::NoInput {
            structure: structure.label(),
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
                value,
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

/// Fewer residuals than unknowns.
pub(crate) fn degrees_of_freedom(criterion: &Criterion<'_>, records: &[Record]) -> Result<(), IdentError> {
    let unknowns = criterion.orders.parameters() + criterion.states();
    if criterion.residuals() > unknowns {
        return Ok(());
    }
    Err(IdentError::TooFewSamples {
        label: records[0].label().to_owned(),
        samples: records[0].len(),
        orders: criterion.orders.to_string(),
        needed: criterion.first + unknowns.div_ceil(records.len()),
    })
}
