//! Evaluation of an entrant in a run; the result is one line.
//!
//! The response is requested at seven lines from .5 to 6 rad/s, at +2, +4, +8, +13, +18 and +28 s after each change,
//! once before the first change, and every 10 s if there is no change. The error is the mean of `|dH|/|H|` over the
//! lines. A missing estimate has the error 1, the error of a zero response; an estimate that is not finite has the
//! largest error, 10. Coverage is counted separately for the real and the imaginary part at each line: a part is
//! covered if the truth lies within 1.96 standard errors.

use std::collections::BTreeMap;

use hoid_model::Complex64;
use serde::{Deserialize, Serialize};

use super::{
    case::{Case, Imperfection},
    draw::CaseRun,
    entrant::{Entrant, EntrantResult, ReportedResponse, Task},
    oracle::{batch, log_likelihood_ratio},
    simulate::{Run, Truth, simulate},
};

/// Times after a change at which the response is requested, s.
pub const TIMES_AFTER_CHANGE_S: [f64; 6] = [2.0, 4.0, 8.0, 13.0, 18.0, 28.0];
/// Number of lines; they are evenly spaced on a logarithmic scale over `LINES_RAD_S`.
const LINE_COUNT: usize = 7;
const LINES_RAD_S: (f64, f64) = (0.5, 6.0);
/// Time before the first change at which the response is requested, s.
const TIME_BEFORE_CHANGE_S: f64 = 0.5;
/// Interval between requests if there is no change (s); `LONG_CASE_TIMES_S` are the times for the long case.
const STEADY_INTERVAL_S: f64 = 10.0;
const LONG_CASE_TIMES_S: [f64; 4] = [60.0, 120.0, 200.0, 300.0];
/// Largest error, to which larger errors are limited.
const MAX_ERROR: f64 = 10.0;
const CRITICAL_VALUE: f64 = 1.96;
/// Time after a change within which an alarm is not counted as false, s. An alarm within [`DETECTION_LIMITS_S`] has
/// found the change.
const ALARM_WINDOW_S: f64 = 12.0;
/// Times after a change within which it should be found, s.
pub const DETECTION_LIMITS_S: [f64; 2] = [5.0, 8.0];

/// Name of the batch fit with known changes.
pub const BATCH_NAME: &str = "batch (oracle)";

/// Results of an entrant in a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Name of the case.
    pub case: String,
    /// Number of the run within the set of seeds.
    pub run: u64,
    /// Name of the entrant.
    pub method: String,
    /// Reason for a failure; `None` if the entrant did not fail.
    pub failed: Option<String>,
    /// Results at each requested time.
    pub moments: Vec<Moment>,
    /// Number of alarms that belong to no change; `None` for an entrant that does not detect changes.
    pub false_alarms: Option<usize>,
    /// Number of further alarms that belong to no change and are attributed only to the remnant.
    pub of_remnant: usize,
    /// Total time in which an alarm counts as false, s.
    pub exposed_s: f64,
    /// Results for each change.
    pub changes: Vec<ChangeOutcome>,
    /// Names of the findings about the result.
    pub findings: Vec<String>,
}

/// Result at one requested time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Label such as `+8` (seconds after a change), `before` or `steady`, or the time in the long case.
    pub label: String,
    /// Time, s.
    pub t_s: f64,
    /// Mean of |dH|/|H| over the lines.
    pub error: f64,
    /// Number of bands of the response that cover the truth, and number of all bands.
    pub covered: [usize; 2],
    /// Relative error of each parameter, and whether its band covers the truth.
    pub parameters: BTreeMap<String, (f64, Option<bool>)>,
}

/// A change, and the time to its detection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChangeOutcome {
    /// Time at which the change started, s.
    pub at_s: f64,
    /// Logarithm of the likelihood ratio of the true models within 5 and 8 s.
    pub evidence: [f64; 2],
    /// Time to the first alarm (s); `None` if there is no alarm within 8 s.
    pub after_s: Option<f64>,
}

/// Frequencies of the lines at which the response is requested, rad/s.
pub(super) fn lines_rad_s() -> Vec<f64> {
    let (low, high) = LINES_RAD_S;
    let of = |i: usize| low * (high / low).powf(i as f64 / (LINE_COUNT - 1) as f64);
    (0..LINE_COUNT).map(of).collect()
}

/// Times at which the response is requested, with their labels.
pub(super) fn requested_times(changes_s: &[f64], start_s: f64, length_s: f64, is_long: bool) -> Vec<(String, f64)> {
    let mut all = Vec::new();
    let steady = |from: f64| {
        let count = ((length_s - from) / STEADY_INTERVAL_S + 1e-9) as usize;
        (1..=count).map(move |i| ("steady".to_owned(), from + STEADY_INTERVAL_S * i as f64))
    };
    match changes_s.first() {
        None if is_long => all.extend(LONG_CASE_TIMES_S.map(|t| (format!("{t:.0} s"), t))),
        None => all.extend(steady(start_s)),
        Some(first) if first - TIME_BEFORE_CHANGE_S >= start_s => {
            all.push(("before".to_owned(), first - TIME_BEFORE_CHANGE_S))
        }
        Some(_) => {}
    }
    for (i, change) in changes_s.iter().enumerate() {
        let next = changes_s.get(i + 1).copied().unwrap_or(length_s);
        let times = TIMES_AFTER_CHANGE_S.map(|after| (format!("+{after:.0}"), change + after));
        all.extend(times.into_iter().filter(|(_, t)| *t <= next && *t >= start_s));
    }
    all
}

/// A run with the task that it poses.
pub struct EvaluationRun {
    case: Case,
    number: u64,
    run: Run,
    task: Task,
    labels: Vec<String>,
    /// Changes with a definite time.
    changes: Vec<ChangeOutcome>,
}

impl EvaluationRun {
    /// Simulates a run of a case and poses the task.
    ///
    /// # Errors
    /// The reason, if no person can stabilise the case.
    pub fn new(case: &Case, of: CaseRun) -> Result<Self, String> {
        let run = simulate(case, of).map_err(|e| e.to_string())?;
        let changes_s = if case.has_sudden_changes() {
            case.change_times_s()
        } else {
            Vec::new()
        };
        let start_s = case.start_span_s();
        let asked = requested_times(&changes_s, start_s.1, case.length_s, case.length_s > 200.0);
        let (labels, asked_s) = asked.into_iter().unzip();
        let changes = (changes_s.iter().enumerate())
            .map(|(i, at_s)| ChangeOutcome {
                at_s: *at_s,
                evidence: DETECTION_LIMITS_S.map(|seconds| log_likelihood_ratio(case, &run, i, seconds)),
                after_s: None,
            })
            .collect();
        let task = Task {
            sample_time: run.sample_time,
            e: run.e.clone(),
            u: run.u.clone(),
            label: format!("{} {}", case.name, of.number),
            start_s,
            nk: run.truth.given_nk(),
            lines_rad_s: lines_rad_s(),
            asked_s,
            seam: None,
        };
        Ok(Self {
            case: case.clone(),
            number: of.number,
            run,
            task,
            labels,
            changes,
        })
    }

    /// Evaluates an entrant in the run.
    pub fn line(&self, entrant: &dyn Entrant) -> Line {
        let mut line = self.evaluate(entrant.name(), entrant.follow(&self.task));
        if !self.case.has_sudden_changes() {
            // An alarm during a slow change is neither false nor late.
            (line.false_alarms, line.exposed_s, line.of_remnant) = (None, 0.0, 0);
        }
        line
    }

    /// Evaluates the batch fit with known changes.
    pub fn batch(&self) -> Line {
        let changes_s: Vec<f64> = self.changes.iter().map(|change| change.at_s).collect();
        let tau_e_s = self.run.truth.operator(0.0).tau_e_s;
        let answer = EntrantResult {
            estimates: batch(&self.task, &changes_s, tau_e_s),
            ..EntrantResult::default()
        };
        self.evaluate(BATCH_NAME.to_owned(), Ok(answer))
    }

    fn evaluate(&self, method: String, answer: Result<EntrantResult, String>) -> Line {
        let truth = &self.run.truth;
        let at = |omega: f64, t_s: f64| truth.response(omega, t_s);
        let mut line = evaluate_result(&self.task, &self.labels, &at, method, answer, &self.changes);
        (line.case, line.run) = (self.case.name.clone(), self.number);
        // Parameters are evaluated only if the recorded operator has the form of the thesis.
        let named = truth.operator(0.0).is_lead() && !matches!(self.case.imperfection, Imperfection::Polarity(_));
        for moment in &mut line.moments {
            match named {
                true => compare_parameters(&mut moment.parameters, truth, moment.t_s),
                false => moment.parameters.clear(),
            }
        }
        line
    }
}

/// Converts parameter values to errors and coverage. [`evaluate_result`] stores a value as `(value, None)` and its
/// standard error under the name with ` se` appended.
fn compare_parameters(parameters: &mut BTreeMap<String, (f64, Option<bool>)>, truth: &Truth, t_s: f64) {
    let said = std::mem::take(parameters);
    for (name, value) in truth.operator(t_s).named_parameters() {
        let Some((found, _)) = said.get(name) else { continue };
        let covered = said
            .get(&format!("{name} se"))
            .map(|(error, _)| (found - value).abs() <= CRITICAL_VALUE * error);
        let error = ((found - value) / value).abs();
        if error.is_finite() {
            parameters.insert(name.to_owned(), (error.min(MAX_ERROR), covered));
        }
    }
}

/// Evaluates a result against the true response; the parameters are copied without evaluation.
pub(super) fn evaluate_result(
    task: &Task,
    labels: &[String],
    truth: &dyn Fn(f64, f64) -> Complex64,
    method: String,
    answer: Result<EntrantResult, String>,
    changes: &[ChangeOutcome],
) -> Line {
    let (answer, failed) = match answer {
        Ok(answer) => (answer, None),
        Err(reason) => (EntrantResult::default(), Some(reason)),
    };
    let nothing = ReportedResponse::default();
    let moments = (labels.iter().zip(&task.asked_s).enumerate())
        .map(|(i, (label, t_s))| {
            let said = answer.estimates.get(i).unwrap_or(&nothing);
            let truths: Vec<Complex64> = task.lines_rad_s.iter().map(|omega| truth(*omega, *t_s)).collect();
            let (error, covered) = response_error(said, &truths);
            let mut parameters = BTreeMap::new();
            for (name, value, standard_error) in &said.parameters {
                parameters.insert((*name).to_owned(), (*value, None));
                if let Some(s) = standard_error {
                    parameters.insert(format!("{name} se"), (*s, None));
                }
            }
            Moment {
                label: label.clone(),
                t_s: *t_s,
                error,
                covered,
                parameters,
            }
        })
        .collect();
    let length_s = task.time_s(task.e.len());
    let from = task.start_s.1;
    let of_change = |t: f64| changes.iter().any(|c| t >= c.at_s && t < c.at_s + ALARM_WINDOW_S);
    let step = 0.01;
    let exposed = (0..((length_s - from) / step) as usize).filter(|i| !of_change(from + step * *i as f64));
    let exposed_s = exposed.count() as f64 * step;
    let mut found = changes.to_vec();
    for change in &mut found {
        let own = |t: f64| t >= change.at_s && t <= change.at_s + DETECTION_LIMITS_S[1];
        let first = (answer.alarms.iter().flatten()).find(|alarm| !alarm.of_remnant && own(alarm.t_s));
        change.after_s = first.map(|alarm| alarm.t_s - change.at_s);
    }
    let false_ones = |alarms: &Vec<super::entrant::Alarm>| {
        let outside = alarms.iter().filter(|a| a.t_s >= from && !of_change(a.t_s));
        let of_remnant = outside.clone().filter(|a| a.of_remnant).count();
        (outside.count(), of_remnant)
    };
    let counted = answer.alarms.as_ref().map(false_ones);
    Line {
        case: String::new(),
        run: 0,
        method,
        failed,
        moments,
        false_alarms: counted.map(|(all, of_remnant)| all - of_remnant),
        of_remnant: counted.map_or(0, |(_, of_remnant)| of_remnant),
        exposed_s,
        changes: found,
        findings: answer.findings,
    }
}

/// Returns the mean of |dH|/|H|, the number of bands that cover the truth, and the number of all bands.
fn response_error(said: &ReportedResponse, truths: &[Complex64]) -> (f64, [usize; 2]) {
    if said.response.len() != truths.len() {
        return (1.0, [0, 0]);
    }
    let each = said.response.iter().zip(truths);
    let error = each.map(|(h, truth)| (h - truth).norm() / truth.norm()).sum::<f64>() / truths.len() as f64;
    let error = if error.is_finite() {
        error.min(MAX_ERROR)
    } else {
        MAX_ERROR
    };
    let mut covered = [0, 0];
    for ((h, truth), c) in said.response.iter().zip(truths).zip(said.covariance.iter().flatten()) {
        let d = h - truth;
        for (distance, variance) in [(d.re, c[0]), (d.im, c[1])] {
            covered[0] += usize::from(distance.abs() <= CRITICAL_VALUE * variance.sqrt());
            covered[1] += 1;
        }
    }
    (error, covered)
}

/// Returns the task of a run, for tests of entrants.
#[cfg(test)]
pub(super) fn test_task(case: &Case, of: CaseRun) -> Task {
    EvaluationRun::new(case, of).unwrap_or_else(|e| panic!("{e}")).task
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entrant::Alarm;

    #[test]
    fn requested_times_lie_between_changes() {
        let all = requested_times(&[45.0], 30.0, 90.0, false);
        let labels: Vec<&str> = all.iter().map(|(l, _)| l.as_str()).collect();
        assert_eq!(labels, ["before", "+2", "+4", "+8", "+13", "+18", "+28"]);
        let six = requested_times(&[40.0, 52.0], 30.0, 120.0, false);
        assert_eq!(six.iter().filter(|(l, _)| l == "+8").count(), 2);
        assert_eq!(six.iter().filter(|(l, _)| l == "+13").count(), 1);
        assert_eq!(requested_times(&[], 30.0, 90.0, false).len(), 6);
        assert!(
            requested_times(&[15.0], 30.0, 90.0, false)
                .iter()
                .all(|(_, t)| *t >= 30.0)
        );
    }

    struct FixedResult(EntrantResult);

    impl Entrant for FixedResult {
        fn name(&self) -> String {
            "says".to_owned()
        }

        fn follow(&self, _: &Task) -> Result<EntrantResult, String> {
            Ok(self.0.clone())
        }
    }

    /// The true response has no error, and an alarm at the true time finds the change.
    #[test]
    fn true_response_has_error_zero_and_no_response_error_one() {
        let case = super::super::cases()
            .into_iter()
            .find(|c| c.name == "change-K_e_dot-100")
            .unwrap();
        let posed = EvaluationRun::new(
            &case,
            CaseRun {
                seeds: crate::Seeds::Open,
                number: 0,
            },
        )
        .unwrap();
        let alarm = |t_s| Alarm { t_s, of_remnant: false };
        let said = (posed.task.asked_s.iter())
            .map(|t| {
                let lines = posed.task.lines_rad_s.iter();
                let response: Vec<Complex64> = lines.map(|w| posed.run.truth.response(*w, *t)).collect();
                ReportedResponse {
                    covariance: Some(vec![[1e-12, 1e-12, 0.0]; response.len()]),
                    response,
                    parameters: vec![("K_e", posed.run.truth.operator(*t).gain, Some(0.1))],
                }
            })
            .collect();
        let answer = EntrantResult {
            estimates: said,
            alarms: Some(vec![alarm(33.0), alarm(48.5), alarm(56.0), alarm(80.0)]),
            findings: Vec::new(),
        };
        let line = posed.line(&FixedResult(answer));
        assert!(line.moments.iter().all(|m| m.error < 1e-12 && m.covered == [14, 14]));
        assert!(line.moments.iter().all(|m| m.parameters["K_e"].1 == Some(true)));
        assert_eq!(line.changes[0].after_s, Some(3.5));
        assert_eq!(line.false_alarms, Some(2));
        assert!((line.exposed_s - 48.0).abs() < 0.05, "{}", line.exposed_s);
        let silent = posed.line(&FixedResult(EntrantResult::default()));
        assert!(silent.moments.iter().all(|m| m.error == 1.0) && silent.false_alarms.is_none());
    }
}
