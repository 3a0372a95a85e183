//! Simulation of the loop of a case, step by step in continuous time.
//!
//! The loop is `e = f - y`, `u = stick(Y e + n)`, `y = P (u + d)`, with a run-in of 15 s. The operator and the plant
//! are integrated in steps of at most a millisecond ([`Canonical`]). The delay is read from the history of e, at any
//! fraction of a step: a held error enters each step with its mean over that step, a continuous error with its values
//! interpolated between the steps. Only the random streams are shared with the simulators of [`hoid_sim`].
//!
//! In addition to the signals, a run contains data for the oracle: the remnant, the time course of its strength, the
//! true response, and the response to the same errors of the operator before each change.

use std::f64::consts::TAU;

use hoid_model::{Channel, Complex64, Record, SampleTime};
use hoid_sim::SimError;

use super::{
    case::{Case, DelayKnown, Forcing, Imperfection, Sampling},
    draw::{CaseRun, draw_person},
    driving::{RemnantStrength, forcing, rms_without_remnant},
    noise::Noise,
    operator::{Canonical, Operator, hold},
    world::{LoopState, OperatorPolynomials},
};

/// A run with its true values.
#[derive(Debug, Clone)]
pub struct Run {
    /// Sample time.
    pub sample_time: SampleTime,
    /// Recorded error; NaN where nothing was recorded.
    pub e: Vec<f64>,
    /// Recorded control output.
    pub u: Vec<f64>,
    /// The disturbance or the target.
    pub excitation: Vec<f64>,
    /// The operator over time.
    pub truth: Truth,
    /// True values for the oracle.
    pub hidden: OracleData,
}

/// The operator over time.
#[derive(Debug, Clone)]
pub struct Truth {
    first: Operator,
    case: Case,
    sample_time: SampleTime,
}

impl Truth {
    /// Returns the operator at a time.
    pub fn operator(&self, t_s: f64) -> Operator {
        self.case.operator_changes.iter().fold(self.first, |operator, shift| {
            let part = ((t_s - shift.at_s) / shift.takes_s).clamp(0.0, 1.0);
            operator.with_scaled_parameter(shift.parameter, shift.factor.powf(part))
        })
    }

    /// Returns the response from recorded e to recorded u.
    pub fn response(&self, omega_rad_s: f64, t_s: f64) -> Complex64 {
        let operator = self.operator(t_s);
        let response = match self.case.sampling {
            Sampling::Held => held_response(&operator, omega_rad_s, self.sample_time),
            Sampling::Continuous => operator.response(omega_rad_s),
        };
        response * self.sign(t_s)
    }

    /// Returns -1 if u is recorded with the opposite sign, otherwise 1.
    fn sign(&self, t_s: f64) -> f64 {
        match self.case.imperfection {
            Imperfection::Polarity(at_s) if t_s >= at_s => -1.0,
            _ => 1.0,
        }
    }

    /// Returns the delay in samples of `q^-nk`, including the delay of the hold; `None` if it is not given to the
    /// methods.
    pub fn given_nk(&self) -> Option<usize> {
        let samples = self.first.tau_e_s / self.sample_time.s();
        match self.case.delay {
            DelayKnown::No => None,
            // The tolerance allows for rounding errors in a whole number of samples.
            DelayKnown::Whole | DelayKnown::Fraction => Some((samples + 1e-6).floor() as usize + 1),
        }
    }
}

/// Returns the response at the sample times for a held error: `sum over m of (Y H)(omega + m 2 pi/Ts)`, where H is the
/// hold (Poisson's sum; A. V. Oppenheim and R. W. Schafer, *Discrete-Time Signal Processing*, section 4.2).
fn held_response(operator: &Operator, omega_rad_s: f64, sample_time: SampleTime) -> Complex64 {
    let each = (-ALIAS_COUNT..=ALIAS_COUNT).map(|m| {
        let omega = omega_rad_s + f64::from(m) * TAU / sample_time.s();
        operator.response(omega) * hold(omega, sample_time)
    });
    each.sum()
}

/// Number of aliases on either side; they decrease at least with the square of their index.
const ALIAS_COUNT: i32 = 100;

/// True values at each sample.
#[derive(Debug, Clone)]
pub struct OracleData {
    /// Remnant before the stick and the recorder, with the recorded sign.
    pub(super) n: Vec<f64>,
    /// Time course s of the remnant's strength.
    pub(super) level: Vec<f64>,
    /// Response of the operator to the error, before the stick and the recorder, with the recorded sign.
    pub(super) response: Vec<f64>,
    /// First sample of each change, with the response from this sample on of the operator before the change.
    pub(super) before: Vec<(usize, Vec<f64>)>,
    /// Whitening filter of the remnant n for constant strength.
    pub(super) whitening: Vec<f64>,
    /// Standard deviation of the innovations of n for s = 1.
    pub(super) innovation: f64,
}

const RUN_IN_S: f64 = 15.0;
/// Maximum number of people who may lose control in the simulation before it fails.
const MAX_ATTEMPTS: usize = 20;
/// Limit of u beyond which control is lost, standard deviations of u.
const LOSS_LIMIT: f64 = 30.0;

const NOISE_STREAM: u64 = 2;
const GLITCH_STREAM: u64 = 4;
const WALK_STREAM: u64 = 5;

/// Simulates a run of a case.
///
/// # Errors
/// [`SimError`] if no person can control the case.
pub fn simulate(case: &Case, run: CaseRun) -> Result<Run, SimError> {
    let sample_time = SampleTime::new(1.0 / case.rate_hz)?;
    let mut outcome = Err(SimError::Diverged {
        signal: "u",
        time_s: 0.0,
        scenario: case.name.clone(),
    });
    for attempt in 0..MAX_ATTEMPTS {
        let operator = draw_person(case, run, sample_time, attempt)?;
        outcome = simulate_person(case, run, operator, sample_time);
        if !matches!(outcome, Err(SimError::Diverged { .. })) {
            break;
        }
    }
    outcome
}

fn simulate_person(case: &Case, run: CaseRun, operator: Operator, sample_time: SampleTime) -> Result<Run, SimError> {
    let ts = sample_time.s();
    let run_in = (RUN_IN_S / ts).round() as usize;
    let samples = (case.length_s / ts).round() as usize;
    let total = run_in + samples;
    let time = |k: usize| (k as f64 - run_in as f64) * ts;
    let truth = Truth {
        first: operator,
        case: case.clone(),
        sample_time,
    };
    let lines = forcing(case, run)?;
    let idle_s = match case.imperfection {
        Imperfection::IdleStart(s) => s,
        _ => f64::NEG_INFINITY,
    };
    // There is one more sample for interpolation.
    let mut excitation = lines.samples(time(0), sample_time, total + 1);
    for (k, value) in excitation.iter_mut().enumerate() {
        if time(k) < idle_s {
            *value = 0.0;
        }
    }
    let [sigma_u, sigma_e] = rms_without_remnant(&operator, case, &lines);
    let sigma_n = case.ratio * sigma_u;
    let numbers = run.stream(case, NOISE_STREAM).uniform_numbers(4);
    let streams = |tag| run.stream(case, tag);
    let band = [numbers[0], numbers[1], numbers[2]];
    let mut noise = Noise::new(
        case.spectrum,
        case.course,
        operator.omega_nm_rad_s,
        band,
        streams,
        ts,
        total + 1,
    );
    let (whitening, variance) = noise.whitening();
    let steps = match case.imperfection {
        Imperfection::Drift(_) => run.stream(case, WALK_STREAM).white_noise(total),
        _ => Vec::new(),
    };
    let stick = |u: f64| match case.imperfection {
        Imperfection::Quantised(part) => (u / (part * sigma_u)).round() * part * sigma_u,
        Imperfection::Saturated(at) => u.clamp(-at * sigma_u, at * sigma_u),
        _ => u,
    };
    let mut strength = RemnantStrength::new(case, [sigma_u, sigma_e], numbers[3], ts);
    let changes: Vec<usize> = (case.change_times_s().iter())
        .map(|at_s| run_in + (at_s / ts).round() as usize)
        .collect();
    let mut hidden = OracleData {
        n: Vec::with_capacity(total),
        level: Vec::with_capacity(total),
        response: Vec::with_capacity(total),
        before: Vec::new(),
        whitening,
        innovation: variance.sqrt() * sigma_n,
    };
    let mut shadows: Vec<(Operator, Canonical)> = Vec::new();
    let mut world = LoopState::new(case, ts, total);
    let (mut e, mut u) = (Vec::with_capacity(total), Vec::with_capacity(total));
    let (mut now, mut walk) = (OperatorPolynomials::of(operator), 0.0);
    let target = case.forcing != Forcing::Disturbance;
    let mut next_noise = 0.0;
    for k in 0..total {
        let t = time(k);
        if changes.contains(&k) {
            // The parameters are still those of the previous sample; this sample is the first at which they may differ.
            shadows.push((truth.operator(t - ts), world.operator));
            hidden.before.push((k, Vec::new()));
        }
        let operator = truth.operator(t);
        if operator != now.operator {
            now = OperatorPolynomials::of(operator);
        }
        let error = (if target { excitation[k] } else { 0.0 }) - world.plant.x[0];
        let level = if t < idle_s { 0.0 } else { strength.of(t, error) };
        let n = if case.sampling == Sampling::Held || k == 0 {
            sigma_n * noise.step(k, level)
        } else {
            next_noise
        } + walk;
        if case.sampling == Sampling::Continuous {
            next_noise = sigma_n * noise.step(k + 1, level);
        }
        let response = world.operator.output(&now.numerator);
        let control = stick(response + n);
        if !(control.is_finite() && control.abs() < LOSS_LIMIT * sigma_u) {
            return Err(SimError::Diverged {
                signal: "u",
                time_s: t,
                scenario: case.name.clone(),
            });
        }
        strength.follow(control);
        for ((operator, state), (_, responses)) in shadows.iter().zip(&mut hidden.before) {
            responses.push(state.output(&operator.numerator()));
        }
        let ends = [excitation[k], excitation[k + 1]];
        let noises = [
            n,
            if case.sampling == Sampling::Held {
                n
            } else {
                next_noise + walk
            },
        ];
        world.sample(&now, &mut shadows, k, error, control, ends, noises, &stick);
        if let Imperfection::Drift(size) = case.imperfection {
            walk += size * sigma_u * ts.sqrt() * steps[k];
        }
        hidden.n.push(n);
        hidden.level.push(level);
        hidden.response.push(response);
        e.push(error);
        u.push(control);
    }
    for signal in [&mut e, &mut u, &mut hidden.n, &mut hidden.level, &mut hidden.response] {
        signal.drain(..run_in);
    }
    hidden.before.iter_mut().for_each(|(k, _)| *k -= run_in);
    excitation.drain(..run_in);
    excitation.truncate(samples);
    let mut result = Run {
        sample_time,
        e,
        u,
        excitation,
        truth,
        hidden,
    };
    result.apply_recorder_imperfections(case, run, [sigma_u, sigma_e]);
    Ok(result)
}

impl Run {
    /// Applies the imperfections of the recorder.
    fn apply_recorder_imperfections(&mut self, case: &Case, run: CaseRun, [sigma_u, sigma_e]: [f64; 2]) {
        let ts = self.sample_time.s();
        let at = |t_s: f64| ((t_s / ts).round() as usize).min(self.e.len());
        let gap = at(60.0)..at(63.0);
        match case.imperfection {
            Imperfection::Offset(part) => {
                self.e.iter_mut().for_each(|e| *e += part * sigma_e);
                self.u.iter_mut().for_each(|u| *u -= part * sigma_u);
            }
            Imperfection::Glitches(size) => {
                let draws = run.stream(case, GLITCH_STREAM).uniform_numbers(2 * self.u.len());
                for (u, draw) in self.u.iter_mut().zip(draws.chunks_exact(2)) {
                    if draw[0] < ts / 50.0 {
                        *u += size * self.hidden.innovation * if draw[1] < 0.5 { -1.0 } else { 1.0 };
                    }
                }
            }
            Imperfection::Missing | Imperfection::Silent => {
                let value = if case.imperfection == Imperfection::Missing {
                    f64::NAN
                } else {
                    0.0
                };
                self.e[gap.clone()].fill(value);
                self.u[gap].fill(value);
            }
            Imperfection::Polarity(at_s) => {
                let from = at(at_s);
                let OracleData { n, response, .. } = &mut self.hidden;
                for signal in [&mut self.u, n, response] {
                    signal[from..].iter_mut().for_each(|u| *u = -*u);
                }
            }
            _ => {}
        }
    }

    /// Returns recorded e and u as a record with the excitation in the channel `excitation`; `None` if samples are
    /// missing.
    pub fn record(&self) -> Option<Record> {
        let channel = |name: &str, values: &[f64]| Channel::new(name, "", values.to_vec());
        let record = Record::new(self.sample_time, channel("e", &self.e), channel("u", &self.u)).ok()?;
        record.with_channel(channel("excitation", &self.excitation)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Seeds, Theme, cases};

    fn case(name: &str) -> Case {
        cases().into_iter().find(|case| case.name == name).unwrap()
    }

    const RUN: CaseRun = CaseRun {
        seeds: Seeds::Open,
        number: 0,
    };

    /// Without a remnant, U/E at the lines of the excitation over whole periods of 20 s equals the true response, for
    /// held and continuous errors and for whole and fractional delays.
    #[test]
    fn simulated_loop_has_the_true_response() {
        for (name, within) in [("none-lag-1", 1e-3), ("delay-half-60", 1e-3), ("continuous-60", 4e-3)] {
            let quiet = Case {
                ratio: 0.0,
                length_s: 80.0,
                operator_changes: Vec::new(),
                ..case(name)
            };
            let run = simulate(&quiet, RUN).unwrap();
            let per_second = quiet.rate_hz as usize;
            // The span starts after the initial transient has decayed.
            let span = 60 * per_second..80 * per_second;
            for multiple in [2.0, 3.0, 5.0, 11.0, 19.0] {
                let omega = multiple * TAU / 20.0;
                let turn = |x: &[f64]| -> Complex64 {
                    let each = x[span.clone()].iter().enumerate();
                    each.map(|(k, x)| Complex64::from_polar(*x, -omega * k as f64 / quiet.rate_hz))
                        .sum()
                };
                let (found, truth) = (turn(&run.u) / turn(&run.e), run.truth.response(omega, 50.0));
                let error = (found - truth).norm() / truth.norm();
                assert!(error < within, "{name} at {omega:.2} rad/s: {error:.5}");
            }
        }
    }

    #[test]
    fn recorded_output_is_the_response_plus_remnant() {
        let run = simulate(&case("change-K_e_dot-100"), RUN).unwrap();
        let OracleData {
            n, response, before, ..
        } = &run.hidden;
        for k in 0..run.u.len() {
            assert!((run.u[k] - response[k] - n[k]).abs() < 1e-12);
        }
        let (first, shadow) = &before[0];
        assert_eq!((*first, shadow.len()), (4500, run.u.len() - 4500));
        assert!((shadow[0] - response[*first]).abs() < 1e-9);
        let far = (0..shadow.len())
            .map(|k| (shadow[k] - response[first + k]).abs())
            .fold(0.0, f64::max);
        assert!(far > 0.1, "{far}");
    }

    #[test]
    fn imperfections_occur_where_specified() {
        let run = simulate(&case("none-missing"), RUN).unwrap();
        assert!(run.e[6000..6300].iter().all(|e| e.is_nan()) && run.record().is_none());
        assert!(run.e[..6000].iter().chain(&run.e[6300..]).all(|e| e.is_finite()));
        let run = simulate(&case("polarity"), RUN).unwrap();
        assert!((run.truth.response(1.0, 44.9) + run.truth.response(1.0, 45.1)).norm() < 1e-12);
        let run = simulate(&case("idle-start"), RUN).unwrap();
        assert!(run.u[..1499].iter().all(|u| *u == 0.0) && run.u[1600..].iter().any(|u| u.abs() > 0.1));
        let run = simulate(&case("none-saturated"), RUN).unwrap();
        let largest = run.u.iter().fold(0.0_f64, |a, u| a.max(u.abs()));
        assert!(run.u.iter().filter(|u| u.abs() == largest).count() > 50);
    }

    /// Each selected person keeps control.
    #[test]
    fn every_closed_loop_stays_under_control() {
        let are_loops = |case: &Case| {
            let again = matches!(case.theme, Theme::Changes | Theme::ChangesInRemnants);
            !again && !matches!(case.imperfection, Imperfection::IdleStart(_))
        };
        for case in cases()
            .into_iter()
            .filter(|case| case.rate_hz <= 100.0 && are_loops(case))
        {
            let short = Case { length_s: 6.0, ..case };
            let run = simulate(&short, RUN).unwrap();
            assert!(run.u.iter().any(|u| u.abs() > 0.01), "{}", short.name);
        }
    }
}
