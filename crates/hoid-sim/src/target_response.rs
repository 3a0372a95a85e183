//! Response of a person to a displayed target, over a whole run.
//!
//! The target does not depend on the loop, so its response is computed before the run and added to u like a remnant. An
//! operator that does not change is applied as one recursion, its discrete model
//! ([`FamilyOperator::zoh`](hoid_model::FamilyOperator::zoh)); an operator that changes is advanced sample by sample
//! ([`ZohOperator`]), with the parameters at each sample. Both give the same response up to rounding.

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{
    Channel, FamilyOperator, Feedforward, ModelError, SampleTime,
    feedforward::{OperatorWithDelay, response_parameters},
};

use crate::zoh_operator::{OperatorState, ZohOperator};

/// Prepared response to a target.
#[derive(Debug, Clone)]
pub(crate) struct TargetResponse {
    feedforward: Feedforward,
    /// One entry if nothing changes, otherwise one entry per sample.
    instants: Vec<OperatorWithDelay>,
    sample_time: SampleTime,
}

impl TargetResponse {
    /// Prepares the response; `at` returns the operator at each of the `instants` samples.
    pub fn new(
        feedforward: &Feedforward,
        instants: usize,
        at: impl Fn(usize) -> Result<Option<OperatorWithDelay>, ModelError>,
        sample_time: SampleTime,
    ) -> Result<Self, ModelError> {
        let instants = (0..instants)
            .map(|k| at(k).transpose())
            .collect::<Option<Result<_, _>>>();
        Ok(Self {
            feedforward: feedforward.clone(),
            instants: instants.unwrap_or_else(|| Ok(Vec::new()))?,
            sample_time,
        })
    }

    /// Preview time, s.
    pub fn preview_s(&self) -> f64 {
        self.feedforward.preview_s
    }

    /// Returns the response to the displayed values of the target, from rest.
    pub fn respond(&self, shown: &[f64]) -> Result<Vec<f64>, ModelError> {
        match self.instants.as_slice() {
            [(operator, _)] => self.constant_response(operator, shown),
            _ => self.changing_response(shown),
        }
    }

    fn constant_response(&self, operator: &FamilyOperator, shown: &[f64]) -> Result<Vec<f64>, ModelError> {
        let held = operator.zoh(self.sample_time)?;
        let mut response = vec![0.0; shown.len()];
        fir(&held.b, held.nk, shown, &mut response);
        divide_in_place(&held.f, &mut response);
        Ok(response)
    }

    fn changing_response(&self, shown: &[f64]) -> Result<Vec<f64>, ModelError> {
        let longest = self.instants.iter().map(|(_, (whole, _))| *whole).max().unwrap_or(0);
        let mut current: Option<(&OperatorWithDelay, ZohOperator, OperatorState)> = None;
        let mut response = Vec::with_capacity(shown.len());
        for (instant, f) in self.instants.iter().zip(shown) {
            let (_, held, mut state) = match current.take() {
                Some(same) if same.0 == instant => same,
                before => {
                    let held = ZohOperator::new(&instant.0, instant.1, self.sample_time)?;
                    let state = match before {
                        Some((_, _, state)) => state,
                        None => OperatorState::at_rest(&held, longest),
                    };
                    (instant, held, state)
                }
            };
            let output = held.output(&state);
            response.push(output.delayed_response + output.feedthrough * f);
            held.advance(&mut state, output, *f);
            current = Some((instant, held, state));
        }
        Ok(response)
    }

    /// Returns the target as a channel that states its role.
    pub fn target(&self, channel: Channel) -> Channel {
        channel.with_role(self.feedforward.role())
    }

    /// Returns the true parameters of the response at each sample from `first` to before `end`, named after the target:
    /// `f_t_K_d`, `f_t_tau_f` and so on. Only parameters that are finite throughout are included.
    pub fn true_parameters(&self, first: usize, end: usize) -> Vec<Channel> {
        let preview_s = self.feedforward.preview_s;
        let of = |(operator, _): &OperatorWithDelay| response_parameters(operator, preview_s);
        let named: Vec<_> = self.instants.iter().map(of).collect();
        true_parameter_channels("f_t", (first, end), |k| &named[k.min(named.len() - 1)])
    }
}

/// Returns the true parameters of the response to a further input at each sample from `first` to before `end`, named
/// after the input. Only parameters that are finite throughout are included.
pub(crate) fn true_parameter_channels<'n>(
    input: &str,
    (first, end): (usize, usize),
    at: impl Fn(usize) -> &'n [(&'static str, &'static str, f64)],
) -> Vec<Channel> {
    if first >= end {
        return Vec::new();
    }
    let channel = |(i, (name, unit, _)): (usize, &(&str, &str, f64))| {
        let values = (first..end).map(|k| at(k)[i].2).collect();
        Channel::new(format!("{input}_{name}"), *unit, values)
    };
    let all = at(first).iter().enumerate().map(channel);
    all.filter(|channel| channel.values.iter().all(|v| v.is_finite()))
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{Form, schedule::Schedule};

    use super::*;

    fn shown_target(n: usize) -> Vec<f64> {
        (0..n)
            .map(|k| (0.03 * k as f64).sin() + 0.4 * (0.11 * k as f64 + 1.0).sin())
            .collect()
    }

    /// The recursion of a constant operator and the operator advanced sample by sample give the same response, for
    /// every form and for delays of a whole number of samples and of a fraction of a sample.
    #[test]
    fn batch_and_recursion_give_the_same_response() {
        let ts = SampleTime::AT_60_HZ;
        let f = shown_target(900);
        for form in Form::TARGET_FORMS {
            for tau in [0.0, 0.1, 0.1437, 0.24] {
                let kinds = form.coordinates(true);
                let mut x: Vec<f64> = kinds.iter().map(|_| 0.6).collect();
                let n = x.len();
                (x[n - 3], x[n - 2], x[n - 1]) = (11.0_f64.ln(), 0.3_f64.ln(), tau);
                let seen = Feedforward::new(FamilyOperator::new(form, true, &x).unwrap(), 0.0);
                let at = |_| Ok(Some(seen.at(0.0, &Schedule::Constant, ts, None)?));
                let of = |instants| {
                    TargetResponse::new(&seen, instants, at, ts)
                        .unwrap()
                        .respond(&f)
                        .unwrap()
                };
                let (batch, recursion) = (of(1), of(900));
                let largest = batch.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
                assert!(largest > 0.05, "{form}");
                for (k, (a, b)) in batch.iter().zip(&recursion).enumerate() {
                    assert!((a - b).abs() < 1e-11 * largest, "{form} {tau} {k}: {a} {b}");
                }
            }
        }
    }

    /// Long before and after a step of all parameters, the response equals that of the constant operators; in between
    /// it does not.
    #[test]
    fn changing_response_matches_both_constant_responses() {
        let ts = SampleTime::AT_100_HZ;
        let f = shown_target(4000);
        let seen = Feedforward::from_text("derivative:0.3..0.6,tau_f=0.1..0.2", Some((11.0, 0.3))).unwrap();
        let schedule = Schedule::Sigmoid {
            rate_per_s: 100.0,
            midpoint_s: 20.0,
        };
        let at = |k: usize| {
            let t_s = 0.01 * k as f64;
            let muscles = (schedule.value(11.0, 8.0, t_s), schedule.value(0.3, 0.5, t_s));
            Ok(Some(seen.at(t_s, &schedule, ts, Some(muscles))?))
        };
        let response = TargetResponse::new(&seen, 4000, at, ts).unwrap();
        let all = response.respond(&f).unwrap();
        let constant = |operator: FamilyOperator| {
            let one = |_| Ok(Some((operator.clone(), (0, 0.0))));
            TargetResponse::new(&seen, 1, one, ts).unwrap().respond(&f).unwrap()
        };
        let (before, after) = (
            constant(seen.operator.clone()),
            constant(seen.last.as_ref().unwrap().with_neuromuscular(8.0, 0.5).unwrap()),
        );
        for k in (500..1900).step_by(50) {
            assert!((all[k] - before[k]).abs() < 1e-9, "{k}");
        }
        // The slowest mode decays at a rate of 3.3 1/s.
        for k in (3000..4000).step_by(50) {
            assert!((all[k] - after[k]).abs() < 1e-9, "{k} {} {}", all[k], after[k]);
        }
        assert!((before[3500] - after[3500]).abs() > 1e-2);
        let truth = response.true_parameters(1000, 4000);
        let names: Vec<&str> = truth.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["f_t_K_d", "f_t_tau_f"]);
        assert_eq!((truth[0].values[0], truth[0].values[2999]), (0.3, 0.6));
        assert!(response.respond(&[]).unwrap().is_empty());
    }
}
