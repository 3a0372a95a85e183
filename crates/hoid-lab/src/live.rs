//! Live estimate during a run.
//!
//! A recursion of `hoid track` runs on a separate thread and processes e and u of every tenth tick from the batches
//! sent by the page; it is not part of the control loop. With the known controlled element P the open loop is
//! `L = Y P`. The crossover frequency omega_c is the lowest frequency at which |L| falls below 1, and the phase margin
//! is `phi_m = 180 deg + arg L` at this frequency. With `d ln Y = g + j p`, where g and p have the covariance matrix S,
//! to first order
//!
//! `d omega_c = -g / s_g`,  `d phi_m = p - (s_p/s_g) g`,
//!
//! where `s_g` and `s_p` are the slopes of `ln |L|` and `arg L` with respect to omega. The variances of omega_c and
//! phi_m follow from S.

use std::{
    fs::OpenOptions,
    io::Write as _,
    path::PathBuf,
    sync::mpsc::{Receiver, Sender, channel},
    thread,
};

use hoid_ident::order_selection::{Criterion, default_operator_ranges};
use hoid_model::{Complex64, ContinuousTransferFunction, SampleTime, uncertainty::Estimate};
use hoid_track::{DEFAULT_WARM_UP_S, Live, Response, Sample, Stage, TrackOptions, TrackPlan, Tracker};
use serde::Serialize;

use crate::{
    LabError,
    lag::{Lag, LagFits},
    session::Stem,
    task::{TICK_S, TICKS_PER_SAMPLE},
    task_definition::TaskDefinition,
};

/// Dead time n_k with which a method starts, in samples of 10 ms.
const DEFAULT_NK: usize = 21;
/// Frequency range in rad/s of the search for the crossover, and the number of its logarithmically spaced steps.
const CROSSOVER_GRID: (f64, f64, usize) = (0.3, 15.0, 40);
/// Relative frequency step for the slopes.
const SLOPE_STEP: f64 = 1e-3;

/// A value and its standard error; each is `None` if unknown.
type ReportedValue = (Option<f64>, Option<f64>);

/// Estimates at one time.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct LiveLine {
    /// Time from the start of the measurement, s.
    pub t: f64,
    /// Gain K_e.
    pub gain: ReportedValue,
    /// Lead T_L, s.
    pub lead_s: ReportedValue,
    /// Lag T_I (s), if the data determine the lag.
    pub lag_s: ReportedValue,
    /// Reason why no lag is reported; `None` if the lag is reported.
    pub lag_waiting: Option<&'static str>,
    /// Natural frequency of the neuromuscular system, rad/s.
    pub omega_nm_rad_s: ReportedValue,
    /// Delay, s.
    pub delay_s: ReportedValue,
    /// Crossover frequency, rad/s.
    pub crossover_rad_s: ReportedValue,
    /// Phase margin, deg.
    pub phase_margin_deg: ReportedValue,
    /// Time of a change (s), if one was declared in this update.
    pub changed_s: Option<f64>,
    /// Reason why there is no estimate yet; `None` if there is an estimate.
    pub waiting: Option<String>,
}

/// Samples queued for the estimate.
pub type Samples = Vec<Sample>;

/// The recursion of one run.
pub struct LiveRun {
    live: Live,
    lags: LagFits,
    task_definition: TaskDefinition,
    t_s: f64,
    ts: SampleTime,
}

impl LiveRun {
    /// Creates a live estimate for a task with the named method.
    ///
    /// # Errors
    /// [`LabError::Ident`] for a method that does not support live estimation.
    pub fn new(method: &str, course: TaskDefinition) -> Result<Self, LabError> {
        let ts = SampleTime::new(TICK_S * TICKS_PER_SAMPLE as f64)?;
        let method = hoid_survey::method(method)?;
        let options = TrackOptions::default_for(method, DEFAULT_NK);
        let ranges = default_operator_ranges(options.structure, ts);
        let plan = TrackPlan::new(options, ranges, Criterion::Bic, ts)?;
        Ok(Self {
            live: Live::from_plan(plan, DEFAULT_WARM_UP_S)?,
            lags: LagFits::new(ts),
            t_s: -course.durations_s().0,
            task_definition: course,
            ts,
        })
    }

    /// Processes samples and returns the estimates after the last sample.
    pub fn process(&mut self, samples: &[Sample]) -> LiveLine {
        let mut changed_s = None;
        for sample in samples {
            self.live
                .update(*sample, true, &|plan, record| plan.choose(record, &|| ()));
            if let Some(change) = self.live.tracker().and_then(Tracker::change) {
                let at_s = self.t_s - change.seconds_ago;
                changed_s = Some(at_s);
                self.lags.discard_before(at_s);
            }
            // The run-in, during which the target is faded in, is excluded.
            if self.t_s > -self.ts.s() / 2.0 {
                self.lags.push(*sample);
            }
            self.t_s += self.ts.s();
        }
        let mut line = LiveLine {
            t: self.t_s,
            changed_s,
            ..LiveLine::default()
        };
        match self.lags.lag() {
            Lag::Waiting => line.lag_waiting = Some("after 40 s"),
            Lag::NotDetermined => line.lag_waiting = Some("not determined"),
            Lag::Known(lag) => line.lag_s = reported_value(lag),
        }
        let tracker = match self.live.stage() {
            Stage::Tracking(tracker) => tracker,
            Stage::Collecting(warm_up) => {
                let left = warm_up.needed.saturating_sub(warm_up.collected) as f64 * self.ts.s();
                line.waiting = Some(format!(
                    "collecting the first {DEFAULT_WARM_UP_S} s, {left:.0} s remain"
                ));
                return line;
            }
        };
        match tracker.operator() {
            Ok(operator) => {
                line.gain = reported_value(operator.k_e);
                line.lead_s = reported_value(operator.t_l_s);
                line.omega_nm_rad_s = reported_value(operator.omega_nm_rad_s);
                line.delay_s = reported_value(operator.tau_e_s);
            }
            Err(reason) => line.waiting = Some(reason.to_string()),
        }
        if let Ok(element) = self.task_definition.element_at(self.t_s)
            && let Some((crossover, margin)) = crossover(&|omega| tracker.response(omega), &element)
        {
            (line.crossover_rad_s, line.phase_margin_deg) = (reported_value(crossover), reported_value(margin));
        }
        line
    }
}

fn reported_value(estimate: Estimate) -> ReportedValue {
    let finite = |v: f64| v.is_finite().then_some(v);
    (finite(estimate.value), estimate.standard_error.and_then(finite))
}

/// Returns the crossover frequency in rad/s and the phase margin in degrees, with first-order standard errors; `None`
/// if `|L|` does not fall below one within the range of [`CROSSOVER_GRID`].
fn crossover(
    response: &dyn Fn(f64) -> Option<Response>,
    element: &ContinuousTransferFunction,
) -> Option<(Estimate, Estimate)> {
    let open = |omega: f64| -> Option<Complex64> {
        let [re, im] = response(omega)?.value;
        Some(Complex64::new(re, im) * element.response(omega))
    };
    let (low, high, steps) = CROSSOVER_GRID;
    let at = |k: usize| low * (high / low).powf(k as f64 / steps as f64);
    let mut above = None;
    let mut found = None;
    for k in 0..=steps {
        let omega = at(k);
        let gain = open(omega)?.norm();
        if let (Some(last), true) = (above, gain <= 1.0) {
            found = Some((last, omega));
            break;
        }
        above = (gain > 1.0).then_some(omega);
    }
    let (mut from, mut to) = found?;
    for _ in 0..30 {
        let middle = (from + to) / 2.0;
        if open(middle)?.norm() > 1.0 {
            from = middle;
        } else {
            to = middle;
        }
    }
    let omega = (from + to) / 2.0;
    let own = response(omega)?;
    let ratio = open(omega * (1.0 + SLOPE_STEP))? / open(omega * (1.0 - SLOPE_STEP))?;
    let width = 2.0 * SLOPE_STEP * omega;
    let (slope_gain, slope_phase) = (ratio.norm().ln() / width, ratio.arg() / width);
    // Derivatives of ln Y with respect to Re Y and Im Y: d ln Y = (dRe + j dIm)/Y.
    let [re, im] = own.value;
    let square = re * re + im * im;
    let (gain, phase) = ([re / square, im / square], [-im / square, re / square]);
    let covariance = |a: [f64; 2], b: [f64; 2]| {
        let c = &own.covariance;
        a[0] * (c[0][0] * b[0] + c[0][1] * b[1]) + a[1] * (c[1][0] * b[0] + c[1][1] * b[1])
    };
    let r = slope_phase / slope_gain;
    let margin = [phase[0] - r * gain[0], phase[1] - r * gain[1]];
    let degrees = 180.0 / std::f64::consts::PI;
    let mut phi = 180.0 + open(omega)?.arg() * degrees;
    if phi > 180.0 {
        phi -= 360.0;
    }
    Some((
        Estimate::with_variance(omega, covariance(gain, gain) / (slope_gain * slope_gain)),
        Estimate::with_variance(phi, degrees * degrees * covariance(margin, margin)),
    ))
}

/// Starts the thread of the live estimate of a run. The thread processes samples until the returned sender is dropped,
/// passes each line of estimates to `tell` and appends it to `live.csv`.
pub fn start(mut run: LiveRun, stem: &Stem, tell: impl Fn(&LiveLine) + Send + 'static) -> Sender<Samples> {
    let (sender, receiver): (Sender<Samples>, Receiver<Samples>) = channel();
    let path: PathBuf = stem.file("live.csv");
    thread::spawn(move || {
        let mut file = OpenOptions::new().append(true).create(true).open(&path).ok();
        let mut write = |text: &str| {
            // Write errors are ignored here: the estimate can be recomputed from the record at any time, and the log
            // reports a full disk.
            if let Some(file) = &mut file {
                let _ = file.write_all(text.as_bytes());
            }
        };
        write(CSV_HEADER);
        while let Ok(mut samples) = receiver.recv() {
            // Samples that have arrived in the meantime are processed together.
            while let Ok(more) = receiver.try_recv() {
                samples.extend(more);
            }
            let line = run.process(&samples);
            write(&csv_row(&line));
            tell(&line);
        }
    });
    sender
}

const CSV_HEADER: &str = "t,K_e,K_e_se,T_L,T_L_se,omega_nm,omega_nm_se,tau_e,tau_e_se,crossover_rad_s,\
crossover_rad_s_se,phase_margin_deg,phase_margin_deg_se,changed_s,T_I,T_I_se\n";

fn csv_row(line: &LiveLine) -> String {
    let cell = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    let pairs = [
        line.gain,
        line.lead_s,
        line.omega_nm_rad_s,
        line.delay_s,
        line.crossover_rad_s,
        line.phase_margin_deg,
    ];
    let mut text = line.t.to_string();
    for (value, error) in pairs {
        text.push_str(&format!(",{},{}", cell(value), cell(error)));
    }
    let (lag, error) = line.lag_s;
    text.push_str(&format!(",{},{},{}\n", cell(line.changed_s), cell(lag), cell(error)));
    text
}

#[cfg(test)]
pub(crate) mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition as Reference, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::config::Condition;

    /// Returns e and u of the operator of C1 for a seed.
    pub(crate) fn c1_samples(seed: u64) -> Vec<Sample> {
        let simulator = Simulator::new(&Scenario::condition(Reference::C1)).unwrap();
        let seed = RunSeed {
            seed,
            ..RunSeed::default()
        };
        let signals = simulator.signals(&seed.white_noise(simulator.sample_count())).unwrap();
        (signals.e.iter().zip(&signals.u))
            .map(|(e, u)| Sample {
                e: *e,
                u: *u,
                reference: None,
            })
            .collect()
    }

    #[test]
    fn simulated_person_is_identified_live() {
        let condition = Condition {
            scenario: Some("C1".to_owned()),
            scenario_text: Some("condition = \"C1\"\n".to_owned()),
            ..Condition::default()
        };
        let mut run = LiveRun::new("adaptive", condition.task_definition().unwrap()).unwrap();
        let mut last = LiveLine::default();
        for five in c1_samples(3).chunks(5) {
            last = run.process(five);
        }
        assert!((last.t - 81.92).abs() < 1e-6, "{}", last.t);
        // The margins of C1 are computed from the formulas of the loop of s1.
        let scenario = Scenario::condition(Reference::C1);
        let open = scenario.initial.operator.transfer_function().unwrap();
        let open = open.series(&scenario.initial.controlled_element.transfer_function().unwrap());
        let truth = hoid_model::margins::margins(|omega| open.response(omega), (0.3, 15.0));
        let within = |reported: ReportedValue, truth: f64| {
            let (value, error) = (reported.0.unwrap(), reported.1.unwrap());
            assert!(
                (value - truth).abs() < 4.0 * error + 0.05 * truth.abs(),
                "{value} {error} {truth}"
            );
        };
        within(last.crossover_rad_s, truth.crossover_rad_s.unwrap());
        within(last.phase_margin_deg, truth.phase_margin_deg.unwrap());
        assert!(last.waiting.is_none());
    }

    #[test]
    fn margins_and_errors_match_the_closed_form() {
        // With Y = 1 and P = 3 e^{-0.2 s}/s, omega_c = 3 and phi_m = 90 deg - 0.6 rad. A change in ln|Y| changes
        // omega_c by 3 times as much, and phi_m by -0.2 times the change in omega_c.
        let element: ContinuousTransferFunction = "3/s".parse().unwrap();
        let y = |omega: f64| {
            let (sin, cos) = (-0.2 * omega).sin_cos();
            // The covariance is 0.01^2 along Y, which is an error of the gain only.
            let v = 1e-4;
            Some(Response {
                value: [cos, sin],
                covariance: [[v * cos * cos, v * cos * sin], [v * cos * sin, v * sin * sin]],
            })
        };
        let (omega, margin) = crossover(&y, &element).unwrap();
        assert!((omega.value - 3.0).abs() < 1e-6);
        assert!((margin.value - (90.0 - 0.6 * 180.0 / std::f64::consts::PI)).abs() < 1e-4);
        assert!((omega.standard_error.unwrap() - 0.03).abs() < 1e-4);
        let expected = 0.2 * 0.03 * 180.0 / std::f64::consts::PI;
        assert!((margin.standard_error.unwrap() - expected).abs() < 1e-3, "{margin}");
        let weak: ContinuousTransferFunction = "0.1/s".parse().unwrap();
        assert!(crossover(&y, &weak).is_none());
    }
}
