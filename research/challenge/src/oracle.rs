//! Bounds that follow from the available information and that no method can exceed.
//!
//! **Evidence of a change.** The logarithm of the likelihood ratio of the true model after a change against the true
//! model before it, if the time of the change and the spectrum, density and time course of the remnant are known:
//! `sum over k of log f(A n/s) - log f(A (n + delta)/s)`. Here n is the remnant, delta the difference between the
//! responses of the present operator and of the operator before the change to the same errors, and A the whitening
//! filter. Above 12 a change is certain: a good test with one false alarm per hour finds it. The ratio is computed from
//! the signals before the stick and the recorder, where the model is exact.
//!
//! **Batch fit with known changes.** A Box-Jenkins model with the true delay and a noise model of order 4 is fitted by
//! the prediction-error method to all data since the last change. It uses every sample, and its errors are those that
//! the same data give without tracking.

use hoid_ident::Estimator;
use hoid_model::{Orders, Structure};

use super::{
    case::Case,
    entrant::{ReportedResponse, Task, complex_covariance},
    noise::density,
    simulate::Run,
};

/// Logarithm of the likelihood ratio above which a change is certain.
pub const CERTAIN_LOG_RATIO: f64 = 12.0;
/// Lower limit of the strength; without it the remnant would vanish where the error is zero and reveal the response.
const MIN_LEVEL: f64 = 0.05;
/// Order of the noise model of the batch fit; `MIN_SPAN_S` is the shortest span of the fit, s.
const ND: usize = 4;
const MIN_SPAN_S: f64 = 7.5;

/// Returns the logarithm of the likelihood ratio over the first `seconds` after the change with this index.
pub fn log_likelihood_ratio(case: &Case, run: &Run, change: usize, seconds: f64) -> f64 {
    let hidden = &run.hidden;
    let Some((first, before)) = hidden.before.get(change) else {
        return 0.0;
    };
    let end = (first + (seconds / run.sample_time.s()).round() as usize).min(hidden.n.len());
    let density = density(case.course, run.sample_time.s());
    let log = |w: f64| {
        let each = density.iter().map(|(p, v)| p / v.sqrt() * (-0.5 * w * w / v).exp());
        // If all densities underflow, the widest determines the result.
        let widest = density.iter().map(|(_, v)| *v).fold(0.0, f64::max);
        each.sum::<f64>().ln().max(-0.5 * w * w / widest - 20.0)
    };
    let delta = |k: usize| {
        if k < *first {
            0.0
        } else {
            hidden.response[k] - before[k - first]
        }
    };
    (*first..end)
        .map(|k| {
            let scale = hidden.innovation * hidden.level[k].max(MIN_LEVEL);
            let (mut now, mut old) = (0.0, 0.0);
            for (lag, a) in hidden.whitening.iter().enumerate().take(k + 1) {
                now += a * hidden.n[k - lag];
                old += a * (hidden.n[k - lag] + delta(k - lag));
            }
            log(now / scale) - log(old / scale)
        })
        .sum()
}

/// Returns the batch fits at the requested times, with known `changes_s`; an estimate is empty if the span is too short
/// or the fit fails.
pub fn batch(task: &Task, changes_s: &[f64], tau_e_s: f64) -> Vec<ReportedResponse> {
    let nk = (tau_e_s / task.sample_time.s()).round() as usize + 1;
    let structure = Structure::BoxJenkins;
    let orders = Orders {
        nd: ND,
        ..structure.operator_orders(nk)
    };
    let estimator = Estimator::new(structure, orders);
    let at = |t_s: &f64| -> Option<ReportedResponse> {
        // A change takes half a second.
        let from = (changes_s.iter().rev().find(|c| *c < t_s)).map_or(task.start_s.0, |c| c + 0.5);
        if t_s - from < MIN_SPAN_S {
            return None;
        }
        let fit = estimator
            .fit(&[task.span(task.sample_index(from), task.sample_index(*t_s))?])
            .ok()?;
        let each: Vec<_> = (task.lines_rad_s.iter())
            .map(|omega| fit.model().response_and_gradient(*omega))
            .collect();
        let covariance = (fit.covariance()).map(|c| each.iter().map(|(_, g)| complex_covariance(g, c)).collect());
        let operator = fit.operator().ok();
        let parameters = operator.map_or_else(Vec::new, |o| {
            [
                ("K_e", o.k_e),
                ("K_e_dot", o.k_e_dot),
                ("omega_nm", o.omega_nm_rad_s),
                ("zeta_nm", o.zeta_nm),
            ]
            .map(|(name, e)| (name, e.value, e.standard_error))
            .into()
        });
        Some(ReportedResponse {
            response: each.into_iter().map(|(h, _)| h).collect(),
            covariance,
            parameters,
        })
    };
    task.asked_s.iter().map(|t_s| at(t_s).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CaseRun, Seeds, cases, simulate};

    fn evidence_of_case(name: &str, seconds: f64) -> f64 {
        let case = cases().into_iter().find(|case| case.name == name).unwrap();
        let run = simulate(
            &case,
            CaseRun {
                seeds: Seeds::Open,
                number: 1,
            },
        )
        .unwrap();
        log_likelihood_ratio(&case, &run, 0, seconds)
    }

    #[test]
    fn only_a_large_change_is_certain() {
        let (large, small) = (
            evidence_of_case("change-K_e_dot-100", 8.0),
            evidence_of_case("change-zeta-10", 8.0),
        );
        assert!(
            large > CERTAIN_LOG_RATIO && small < CERTAIN_LOG_RATIO && large > small,
            "{large} {small}"
        );
    }

    /// The mean of the log ratio is the divergence: half the power of the whitened difference divided by the variance.
    /// Its standard deviation over runs is the square root of twice the divergence.
    #[test]
    fn evidence_for_a_gaussian_remnant_matches_the_divergence() {
        let case = cases().into_iter().find(|case| case.name == "change-omega-30").unwrap();
        let (mut sum, mut expected) = (0.0, 0.0);
        for number in 0..6 {
            let run = simulate(
                &case,
                CaseRun {
                    seeds: Seeds::Open,
                    number,
                },
            )
            .unwrap();
            let (first, before) = &run.hidden.before[0];
            let delta = |k: usize| {
                if k < *first {
                    0.0
                } else {
                    run.hidden.response[k] - before[k - first]
                }
            };
            sum += log_likelihood_ratio(&case, &run, 0, 8.0);
            for k in *first..first + 800 {
                let each = run.hidden.whitening.iter().enumerate();
                let w: f64 = each.map(|(lag, a)| a * delta(k - lag)).sum();
                expected += 0.5 * (w / run.hidden.innovation).powi(2);
            }
        }
        let scatter = (2.0_f64 * expected).sqrt();
        assert!((sum - expected).abs() < 4.0 * scatter, "{sum} {expected} {scatter}");
    }
}
