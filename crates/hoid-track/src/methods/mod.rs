//! The recursive methods.

mod adaptive;
mod fused;
mod joint_filter;
mod rriv;
mod window;

use hoid_ident::{Estimator, IdentError};
use hoid_model::SampleTime;

use crate::{
    kernel,
    options::{Method, StartAt, TrackOptions},
    recursion::Recursion,
    start::StartState,
};

use fused::FusedRecursion;
use joint_filter::JointRecursion;
use rriv::{RefinedRecursion, RefinedStart};
use window::WindowRecursion;

pub(crate) use adaptive::{LARGEST_ND, first_hypothesis, outside, suppositions};

/// The recursion that the options ask for.
pub(crate) fn build(
    options: &TrackOptions,
    start: &StartState,
    sample_time: SampleTime,
) -> Result<Box<dyn Recursion>, IdentError> {
    let covariance: Vec<f64> = start.spread.iter().map(|s| s * start.variance).collect();
    match options.method {
        Method::Window => {
            let estimator = Estimator {
                search: options.search,
                ..Estimator::new(options.structure, options.orders)
            };
            let window = options.window.samples(sample_time)?;
            let known = match options.start {
                StartAt::Nothing => None,
                _ => Some((start.values.as_slice(), start.from_fit.then_some(covariance.as_slice()))),
            };
            let recursion = WindowRecursion::new(estimator, sample_time, window, options.every, known)?;
            Ok(Box::new(recursion))
        }
        Method::Refined => {
            if !start.from_fit {
                return Err(IdentError::BadStart {
                    reason: "rriv makes its instruments with a model; start it from the batch fit of a span".to_owned(),
                });
            }
            let from = RefinedStart {
                theta: &start.values,
                covariance: &covariance,
                innovation_variance: start.variance,
                samples: start.residuals as usize,
            };
            let lambda = options
                .memories()?
                .into_iter()
                .map(|m| m.lambda(sample_time))
                .collect::<Result<Vec<f64>, _>>()?;
            let recursion = RefinedRecursion::new(options.orders, from, &lambda, options.instruments.is_some())?;
            Ok(Box::new(recursion))
        }
        Method::Adaptive => adaptive::build(options, start, sample_time),
        Method::Fused => Ok(Box::new(FusedRecursion::new(options, start, sample_time)?)),
        Method::Ekf | Method::Ukf => Ok(Box::new(JointRecursion::new(options, start, sample_time)?)),
        _ => kernel::build(options, start, sample_time),
    }
}
