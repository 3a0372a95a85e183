//! What speaks for and against a trace, and what the estimate of one sample is worth.
//!
//! A trace is as good as its start and as its rows. Of the start fit all findings of
//! [`hoid_ident::judgement`] count, none as more than a doubt: the recursion may leave it. Of the
//! rows from which the estimate moves on, at most [`ROWS`] are looked at, evenly apart:
//!
//! | kind | what was observed |
//! |---|---|
//! | `start-explains-little` | VAF of the simulated start fit on its span below 20 % |
//! | `not-convertible` | more than 5 % of the rows stand for no operator |
//! | `gain` | K_e and K_e_dot are both open (within two standard errors of zero) in most rows |
//! | `undetermined-parameter` | one of them is |
//! | `neuromuscular-lag` | poles of no person, or omega_nm at its bound, in a quarter of the rows |
//! | `delay-at-bound` | the tracked delay rests at an end of its range in a quarter of the rows |
//! | `covariance-blown-up` | a standard error 30 times its median: the data say too little to forget |
//! | `steps-shortened` | more than 5 % of the steps made shorter by stability or a bound |
//! | `faults` | more than 10 % of the samples were faults |
//! | `held-back` | outliers that the guard held back (a note), in more than 1 % of the samples (a doubt) |
//! | `hostile-span` | spans that no tracking makes, at which the estimate stood still |
//! | `restarted` | the guard began the estimate again |
//! | `steps-in-signals` | jumps of e or u that stayed (a note) |
//! | `gain-sign` | K_e is significantly positive in some rows and negative in others |
//! | `idle-head` | a head in which neither e nor u moves: left out of the start span (a note), or in it (a doubt) |
//! | `not-followed` | what the last seconds of the record say against the last row |
//! | `not-finite` | an estimate that is no number |

use hoid_ident::{
    Choice, IdentError,
    judgement::{gain_findings, is_open, neuromuscular_finding, operator_step},
};
use hoid_model::{
    Finding, NotConvertible, Record, SampleTime, Severity, Verdict, VerdictLevel,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::{
    guard::{GuardAction, GuardKind, TrackFault},
    trace::Trace,
    tracker::Tracker,
};

/// Rows that are looked at.
const ROWS: usize = 400;
/// VAF in % of the simulated start fit below which it explains little.
const LEAST_START_VAF: f64 = 20.0;
/// Shares of rows, steps and samples beyond which something is said.
const NOT_CONVERTIBLE: f64 = 0.05;
const MOST: f64 = 0.5;
const QUARTER: f64 = 0.25;
const SHORTENED: f64 = 0.05;
const FAULTS: f64 = 0.1;
const HELD: f64 = 0.01;
const SIGN: f64 = 0.02;
/// Share of the rows with a negative lead beyond which it is told.
const NEGATIVE_LEAD: f64 = 0.1;
/// Spans that are named one by one.
const NAMED: usize = 3;
/// After a restart the estimate is doubtful for so long, s.
const UNSETTLED_S: f64 = 10.0;
/// Lengths of the end of the record at which the last row is held against it, s.
const LAST_S: [f64; 2] = [16.0, 30.0];
/// p-value of one of ten comparisons below which they differ.
const UNLIKELY: f64 = 1e-4;
/// Standard error over its median beyond which the covariance has blown up.
const BLOWN_UP: f64 = 30.0;
/// Upper bound of omega_nm of the physical recursions as a share of the Nyquist frequency, less
/// rounding.
const AT_FASTEST: f64 = 0.4999;

type Operator = Result<OperatorEstimate, NotConvertible>;

/// True where the coefficients are not meant to be an operator.
fn is_other(operator: &Operator) -> bool {
    matches!(
        operator,
        Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. } | NotConvertible::OtherForm { .. })
    )
}

impl Trace {
    /// What the trace is worth, on the record that it was made of and with the search that chose
    /// its orders, where there was one.
    ///
    /// # Errors
    /// Those of the residuals of the start fit.
    pub fn verdict(&self, record: &Record, choice: Option<&Choice>) -> Result<Verdict, IdentError> {
        let mut all = self.start_findings(record, choice)?;
        let rows = self.rows_judged();
        if rows.iter().any(|row| self.theta(*row).iter().any(|v| !v.is_finite())) {
            all.push(Finding::undetermined(
                "not-finite",
                "the estimate is no number in some rows",
            ));
            return Ok(Verdict::of(all));
        }
        let operators: Vec<Operator> = rows.iter().map(|row| self.operator(*row)).collect();
        all.extend(self.operator_findings(&operators));
        all.extend(self.covariance_finding(&rows));
        all.extend(self.count_findings());
        all.extend(self.guard_findings());
        all.extend(self.idle_finding(record));
        all.extend(self.not_followed(record));
        Ok(Verdict::of(all))
    }

    /// Findings of the start fit, none graver than a doubt.
    fn start_findings(&self, record: &Record, choice: Option<&Choice>) -> Result<Vec<Finding>, IdentError> {
        let (Some(fit), Some((from, to))) = (self.start(), self.options().start_span(record)) else {
            return Ok(Vec::new());
        };
        let span = [record.span(from, to)?];
        let of_start = |finding: &Finding| Finding {
            severity: match finding.kind {
                // A tracker is there to follow it.
                "not-constant" => Severity::Note,
                _ => finding.severity.min(Severity::Doubt),
            },
            words: format!("start fit: {}", finding.words),
            ..finding.clone()
        };
        let mut all: Vec<Finding> = fit.verdict(&span, choice)?.findings().iter().map(of_start).collect();
        if fit.model().structure().has_input() {
            let vaf = fit.quality(&span)?.vaf_simulation;
            if vaf < LEAST_START_VAF {
                all.push(Finding::doubt(
                    "start-explains-little",
                    format!(
                        "the start fit explains {vaf:.0} % of u (VAF of the simulation, expected {LEAST_START_VAF:.0} % or more); \
                         take a longer span, or another"
                    ),
                ));
            }
        }
        Ok(all)
    }

    /// Rows from which the estimate moves on, evenly apart, the last among them.
    fn rows_judged(&self) -> Vec<usize> {
        let from = self.updated_from_s() - self.sample_time().s() / 2.0;
        let first = self.times_s().partition_point(|t| *t < from);
        let count = self.len().saturating_sub(first);
        let step = count.div_ceil(ROWS).max(1);
        let mut rows: Vec<usize> = (first..self.len()).rev().step_by(step).collect();
        rows.reverse();
        rows
    }

    fn operator_findings(&self, operators: &[Operator]) -> Vec<Finding> {
        let mut all = Vec::new();
        if operators.is_empty() || operators.iter().all(is_other) {
            return all;
        }
        let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
        let found: Vec<&OperatorEstimate> = operators.iter().filter_map(|o| o.as_ref().ok()).collect();
        let lacking = share(operators.len() - found.len(), operators.len());
        if lacking > NOT_CONVERTIBLE {
            let reason = operators.iter().find_map(|o| o.as_ref().err());
            let reason = reason.map_or(String::new(), |r| format!(", as {r}"));
            all.push(Finding::doubt(
                "not-convertible",
                format!("{:.0} % of the rows stand for no operator{reason}", 100.0 * lacking),
            ));
        }
        let rows_with =
            |is: &dyn Fn(&OperatorEstimate) -> bool| share(found.iter().filter(|o| is(o)).count(), found.len());
        all.extend(gains_over_rows(&rows_with));
        all.extend(sign_finding(&rows_with));
        all.extend(lead_finding(&rows_with));
        let nyquist = self.sample_time().nyquist_rad_s();
        let bounded = self.options().method.is_physical();
        let senseless = rows_with(&|o| {
            let omega = o.omega_nm_rad_s.value;
            neuromuscular_finding(omega, o.zeta_nm.value, self.sample_time()).is_some()
                || (bounded && omega >= AT_FASTEST * nyquist)
        });
        if senseless > QUARTER {
            all.push(Finding::doubt(
                "neuromuscular-lag",
                format!(
                    "in {:.0} % of the rows the two poles are a lag and say nothing of the neuromuscular system (omega_nm near \
                     or above the Nyquist frequency, or zeta_nm above 3)",
                    100.0 * senseless
                ),
            ));
        }
        if let Some((low, high)) = self.options().method.track_delay_s().filter(|(low, high)| high > low) {
            let near = 1e-6 * (high - low);
            let at_end = rows_with(&|o| o.tau_e_s.value <= low + near || o.tau_e_s.value >= high - near);
            if at_end > QUARTER {
                all.push(Finding::doubt(
                    "delay-at-bound",
                    format!(
                        "in {:.0} % of the rows the delay rests at an end of its range {low} to {high} s; widen it",
                        100.0 * at_end
                    ),
                ));
            }
        }
        all
    }

    /// A standard error that grew without bound, of the coefficients that have one.
    fn covariance_finding(&self, rows: &[usize]) -> Option<Finding> {
        // The beginning may start from nothing.
        let rows = &rows[rows.len() / 2..];
        let names = self.parameter_names();
        let estimates: Vec<Vec<Estimate>> = rows.iter().map(|row| self.parameters(*row)).collect();
        let grown = |i: usize| {
            let errors: Vec<f64> = estimates.iter().filter_map(|e| e[i].standard_error).collect();
            let mut sorted = errors.clone();
            sorted.sort_by(f64::total_cmp);
            let median = *sorted.get(sorted.len() / 2)?;
            let largest = *sorted.last()?;
            (median > 0.0 && largest > BLOWN_UP * median).then_some(largest / median)
        };
        let (name, ratio) = names
            .iter()
            .enumerate()
            .filter_map(|(i, name)| Some((name, grown(i)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Finding::doubt(
            "covariance-blown-up",
            format!(
                "the standard error of {name} grows to {ratio:.0} times its median: for a while the data say too little for the \
                 memory in use; take a longer one"
            ),
        ))
    }

    fn count_findings(&self) -> Vec<Finding> {
        let counts = self.counts();
        let mut all = Vec::new();
        let samples = counts.samples.max(1) as f64;
        if counts.skipped as f64 > FAULTS * samples {
            let share = 100.0 * counts.skipped as f64 / samples;
            all.push(Finding::doubt(
                "faults",
                format!("{share:.0} % of the samples are faults in e or u, at which the estimate stays"),
            ));
        }
        let last = self.times_s().last().copied().unwrap_or(f64::NAN);
        let before = (last - self.updated_from_s()) / self.sample_time().s();
        let moved = if before.is_finite() {
            before.max(1.0).min(samples)
        } else {
            samples
        };
        if counts.shortened as f64 > SHORTENED * moved {
            all.push(Finding::doubt(
                "steps-shortened",
                format!(
                    "{:.0} % of the steps were made shorter to stay stable or within bounds: the estimate is not where the data \
                     want it",
                    100.0 * counts.shortened as f64 / moved
                ),
            ));
        }
        all
    }
}

impl Trace {
    /// What the guard did.
    fn guard_findings(&self) -> Vec<Finding> {
        let mut all = Vec::new();
        let of = |is: &dyn Fn(&TrackFault) -> bool| -> Vec<TrackFault> {
            self.faults().iter().filter(|fault| is(fault)).copied().collect()
        };
        let samples = |faults: &[TrackFault]| -> f64 {
            faults
                .iter()
                .map(|f| ((f.to_s - f.from_s) / self.sample_time().s()).round())
                .sum()
        };
        let held = of(&|f| f.kind == GuardKind::Outlier);
        if !held.is_empty() {
            let count = samples(&held);
            let words = format!("{count} samples held back as outliers ({})", named(&held));
            all.push(match count > HELD * self.counts().samples as f64 {
                true => Finding::doubt("held-back", words),
                false => Finding::note("held-back", words),
            });
        }
        let steps = of(&|f| f.kind == GuardKind::Step);
        if !steps.is_empty() {
            let words = format!(
                "{} jumps that stayed, taken as they came ({})",
                steps.len(),
                named(&steps)
            );
            all.push(Finding::note("steps-in-signals", words));
        }
        let spans = of(&|f| !matches!(f.kind, GuardKind::Outlier | GuardKind::Step));
        if !spans.is_empty() {
            all.push(Finding::doubt(
                "hostile-span",
                format!(
                    "the estimate stands still in {} spans in which e and u are no tracking ({})",
                    spans.len(),
                    named(&spans)
                ),
            ));
        }
        let again = of(&|f| matches!(f.action, GuardAction::Restarted | GuardAction::Relearnt));
        if !again.is_empty() {
            all.push(Finding::doubt(
                "restarted",
                format!("the estimate was begun again after {} of them", again.len()),
            ));
        }
        all
    }

    /// What the last seconds of the record say against the last row: a delay that is another now, or an
    /// estimate that has not come back. A step of [`operator_step`] that is [`UNLIKELY`] beside its own
    /// error and that of the row; of a delay that is a whole number of samples, beyond one and a half.
    fn not_followed(&self, record: &Record) -> Option<Finding> {
        let row = self.len().checked_sub(1)?;
        let operator = self.operator(row).ok()?;
        let end = self.times_s()[row] + self.sample_time().s();
        let of_row = |name: &str| {
            let rows = operator.rows();
            rows.iter()
                .find(|(known, ..)| *known == name)
                .and_then(|(_, _, e)| e.standard_error)
        };
        let mut worst: Option<(f64, String)> = None;
        for length in LAST_S {
            let from = end - length;
            if from < record.time_s(0) {
                continue;
            }
            let steps = record
                .span(from, end)
                .ok()
                .and_then(|span| operator_step(&operator.parameters(), &span));
            for step in steps.into_iter().flatten() {
                let (name, own) = (step.name, of_row(step.name));
                let whole_samples = name == "tau_e" && own.is_none();
                let grid = if whole_samples {
                    1.5 * self.sample_time().s()
                } else {
                    0.0
                };
                let p_value = step.p_value(own.unwrap_or(0.0), grid);
                if p_value < UNLIKELY && worst.as_ref().is_none_or(|(known, _)| p_value < *known) {
                    let words = format!(
                        "the last {length:.0} s ask for another {name} than the last row, by {}: the person changed in a way \
                         that the estimate does not follow, or it has not come back; begin it again there",
                        step.by
                    );
                    worst = Some((p_value, words));
                }
            }
        }
        worst.map(|(_, words)| Finding::doubt("not-followed", words))
    }

    /// An idle head of the record.
    fn idle_finding(&self, record: &Record) -> Option<Finding> {
        let idle_s = self.idle_s();
        let (from, _) = self.options().start_span(record)?;
        if idle_s <= 0.0 {
            return None;
        }
        let left_out = from - record.time_s(0) >= idle_s - 0.5 * self.sample_time().s();
        let words = format!("neither e nor u moves in the first {idle_s:.1} s");
        Some(if left_out {
            Finding::note("idle-head", format!("{words}: left out of the start fit"))
        } else {
            Finding::doubt(
                "idle-head",
                format!("{words}, which are in the start fit; begin it after them"),
            )
        })
    }
}

/// The first spans in words.
fn named(faults: &[TrackFault]) -> String {
    let one = |f: &TrackFault| format!("{} in {} at {:.2} to {:.2} s", f.kind, f.channel, f.from_s, f.to_s);
    let mut text = faults.iter().take(NAMED).map(one).collect::<Vec<_>>().join("; ");
    if faults.len() > NAMED {
        text.push_str("; ...");
    }
    text
}

/// A gain that changes its sign: nobody does, a channel that was turned over does.
fn sign_finding(rows_with: &ShareOfRows<'_>) -> Option<Finding> {
    let beyond = |e: &Estimate, sign: f64| e.standard_error.is_some_and(|s| sign * e.value > 3.0 * s);
    let positive = rows_with(&|o| beyond(&o.k_e, 1.0));
    let negative = rows_with(&|o| beyond(&o.k_e, -1.0));
    (positive > SIGN && negative > SIGN).then(|| {
        Finding::doubt(
            "gain-sign",
            format!(
                "K_e is positive in {:.0} % of the rows and negative in {:.0} %: look whether the sign of e or u changes",
                100.0 * positive,
                100.0 * negative
            ),
        )
    })
}

/// True where K_e and K_e_dot have opposite signs by two standard errors each: a negative lead.
fn leads_backwards(o: &OperatorEstimate) -> bool {
    let sign = |e: &Estimate| match is_open(e) {
        true => 0.0,
        false => e.value.signum(),
    };
    sign(&o.k_e) * sign(&o.k_e_dot) < 0.0
}

/// A lead below zero: nobody has one; a gain and a lead that stand for a lag do.
fn lead_finding(rows_with: &ShareOfRows<'_>) -> Option<Finding> {
    let negative = rows_with(&leads_backwards);
    (negative > NEGATIVE_LEAD).then(|| {
        Finding::doubt(
            "negative-lead",
            format!(
                "the lead T_L is negative in {:.0} % of the rows, by two standard errors of K_e and of K_e_dot: a gain and a \
                 lead are not the form of this person, who may have a lag; K_e, T_L and K_e_dot are none of their parameters \
                 then, only the response is theirs (hoid identify finds the form)",
                100.0 * negative
            ),
        )
    })
}

/// Share of the rows whose operator has a property.
type ShareOfRows<'a> = dyn Fn(&dyn Fn(&OperatorEstimate) -> bool) -> f64 + 'a;

/// Gains that are open in most rows.
fn gains_over_rows(rows_with: &ShareOfRows<'_>) -> Option<Finding> {
    let both = rows_with(&|o| is_open(&o.k_e) && is_open(&o.k_e_dot));
    if both > MOST {
        return Some(Finding::undetermined(
            "gain",
            format!(
                "in {:.0} % of the rows no gain stands two standard errors from zero: there is too little response to e for \
                 the memory in use",
                100.0 * both
            ),
        ));
    }
    type Gain = fn(&OperatorEstimate) -> Estimate;
    let gains: [(&str, Gain); 2] = [("K_e", |o| o.k_e), ("K_e_dot", |o| o.k_e_dot)];
    let open: Vec<String> = gains
        .into_iter()
        .map(|(name, of)| (name, rows_with(&|o| is_open(&of(o)))))
        .filter(|(_, share)| *share > MOST)
        .map(|(name, share)| format!("{name} (in {:.0} % of the rows)", 100.0 * share))
        .collect();
    (!open.is_empty()).then(|| {
        Finding::doubt(
            "undetermined-parameter",
            format!(
                "{} within two standard errors of zero for most of the record; take a longer memory",
                open.join(" and ")
            ),
        )
    })
}

impl Tracker {
    /// What the estimate of this moment is worth, for the operator that
    /// [`Tracker::operator`] gives.
    pub fn level(&self, operator: &Result<OperatorEstimate, NotConvertible>) -> VerdictLevel {
        if self.theta().iter().any(|v| !v.is_finite()) {
            return VerdictLevel::NotDetermined;
        }
        let unsettled = self.is_paused() || self.since_restart_s().is_some_and(|s| s < UNSETTLED_S);
        let level = self.level_of_estimate(operator);
        if unsettled {
            level.max(VerdictLevel::Doubtful)
        } else {
            level
        }
    }

    fn level_of_estimate(&self, operator: &Result<OperatorEstimate, NotConvertible>) -> VerdictLevel {
        // Without an error of any of them, nothing says that they are known.
        let known = |e: &Estimate| e.standard_error.is_some_and(|s| s > 0.0);
        if !self.parameters().iter().any(known) {
            return VerdictLevel::Doubtful;
        }
        match operator {
            Ok(operator) => level_of_operator(operator, self.sample_time),
            Err(_) if !is_other(operator) => VerdictLevel::Doubtful,
            Err(_) => {
                let open = self.response_is_open();
                if open {
                    VerdictLevel::NotDetermined
                } else {
                    VerdictLevel::Trustworthy
                }
            }
        }
    }

    /// True where the model has an input and no coefficient of B stands two standard errors from
    /// zero.
    fn response_is_open(&self) -> bool {
        let (names, estimates) = (self.parameter_names(), self.parameters());
        let mut of_b = names
            .iter()
            .zip(&estimates)
            .filter(|(name, _)| name.starts_with('b'))
            .peekable();
        of_b.peek().is_some() && of_b.all(|(_, e)| is_open(e))
    }
}

fn level_of_operator(operator: &OperatorEstimate, sample_time: SampleTime) -> VerdictLevel {
    let gains = gain_findings(&[("", *operator)]);
    let senseless = neuromuscular_finding(operator.omega_nm_rad_s.value, operator.zeta_nm.value, sample_time);
    let open = gains.iter().any(|finding| finding.severity == Severity::Undetermined);
    if open {
        VerdictLevel::NotDetermined
    } else if !gains.is_empty()
        || senseless.is_some()
        || leads_backwards(operator)
        || !operator.parameters().is_stable()
    {
        VerdictLevel::Doubtful
    } else {
        VerdictLevel::Trustworthy
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{
        Channel, Orders, Structure,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{Method, StartAt, TrackOptions, track};

    fn simulated(condition: Condition) -> Record {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        simulator.run(RunSeed::default(), false).unwrap()
    }

    fn kinds(verdict: &Verdict) -> Vec<&'static str> {
        verdict.findings().iter().map(|f| f.kind).collect()
    }

    fn judged(record: &Record, options: &TrackOptions) -> Verdict {
        track(record, options, 10).unwrap().verdict(record, None).unwrap()
    }

    #[test]
    fn a_clean_run_is_trustworthy_and_a_wrong_start_is_named() {
        let record = simulated(Condition::C4);
        let verdict = judged(&record, &TrackOptions::usual(Method::physical(), 29));
        assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
        let arx = TrackOptions::usual(Method::rls(), 29);
        let verdict = judged(&record, &arx);
        assert!(verdict.reasons().any(|r| r.starts_with("start fit: ")), "{verdict}");
    }

    #[test]
    fn a_negative_lead_is_no_lead() {
        let operator = |k_e: f64, k_e_dot: f64| OperatorEstimate {
            k_e: Estimate::with_variance(k_e, 0.01),
            t_l_s: Estimate::fixed(k_e_dot / k_e),
            k_e_dot: Estimate::with_variance(k_e_dot, 0.01),
            omega_nm_rad_s: Estimate::fixed(11.0),
            zeta_nm: Estimate::fixed(0.25),
            tau_e_s: Estimate::fixed(0.2),
        };
        // Two standard errors are .2.
        for (k_e, k_e_dot, expected) in [
            (1.0, 1.0, false),
            (1.0, -0.3, true),
            (1.0, -0.1, false),
            (-1.0, 0.3, true),
            (0.1, -0.3, false),
            (-1.0, -0.3, false),
        ] {
            assert_eq!(leads_backwards(&operator(k_e, k_e_dot)), expected, "{k_e}, {k_e_dot}");
        }
        let share = |negative: f64| move |_: &dyn Fn(&OperatorEstimate) -> bool| negative;
        assert!(lead_finding(&share(0.05)).is_none());
        assert_eq!(lead_finding(&share(0.4)).unwrap().kind, "negative-lead");
    }

    #[test]
    fn an_output_without_a_response_is_not_determined() {
        let record = simulated(Condition::C1);
        let mut state = 3_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let noise = Channel::new("u", "", (0..record.len()).map(|_| draw()).collect());
        let input = Channel::new("e", "", record.input().to_vec());
        let other = Record::new(record.sample_time(), input, noise).unwrap();
        let trace = track(&other, &TrackOptions::usual(Method::physical(), 29), 10).unwrap();
        let verdict = trace.verdict(&other, None).unwrap();
        assert_ne!(verdict.level, VerdictLevel::Trustworthy);
        assert!(kinds(&verdict).contains(&"start-explains-little"), "{verdict}");
    }

    /// A trace of C1 whose rows are as they are wanted.
    fn changed(change: impl FnOnce(&mut Trace)) -> Vec<&'static str> {
        let record = simulated(Condition::C1);
        let mut trace = track(&record, &TrackOptions::usual(Method::physical(), 29), 100).unwrap();
        change(&mut trace);
        kinds(&trace.verdict(&record, None).unwrap())
    }

    #[test]
    fn each_size_of_the_trace_has_its_finding() {
        assert!(changed(|_| ()).is_empty());
        let counted = changed(|trace| (trace.counts.shortened, trace.counts.skipped) = (1000, 1000));
        assert_eq!(counted, ["faults", "steps-shortened"]);
        let open = |e: &mut Estimate| e.standard_error = Some(e.value.abs());
        let one = changed(|trace| trace.operator.iter_mut().for_each(|o| open(&mut o.k_e)));
        assert_eq!(one, ["undetermined-parameter"]);
        let both = changed(|trace| {
            for o in &mut trace.operator {
                open(&mut o.k_e);
                open(&mut o.k_e_dot);
            }
        });
        assert_eq!(both, ["gain"]);
        let lag = changed(|trace| trace.operator.iter_mut().for_each(|o| o.zeta_nm.value = 4.0));
        assert_eq!(lag, ["neuromuscular-lag"]);
        let none = changed(|trace| trace.operator.iter_mut().for_each(|o| o.t_l_s.value = f64::NAN));
        assert_eq!(none, ["not-convertible"]);
        let grown = changed(|trace| {
            let last = trace.covariance.len() - 1;
            trace.covariance[last] *= 1e4;
        });
        assert_eq!(grown, ["covariance-blown-up"]);
        let broken = changed(|trace| *trace.theta.last_mut().unwrap() = f64::NAN);
        assert_eq!(broken, ["not-finite"]);
    }

    #[test]
    fn a_delay_that_jumps_is_not_followed_by_a_fixed_one() {
        let record = simulated(Condition::C1);
        let late = |at: usize, by: usize| {
            let u = |t: usize| record.output()[if t >= at { t - by } else { t }];
            let u = Channel::new("u", "", (0..record.len()).map(u).collect());
            let e = Channel::new("e", "", record.input().to_vec());
            Record::new(record.sample_time(), e, u).unwrap()
        };
        let options = TrackOptions::usual(Method::physical(), 29);
        let told = |record: &Record| kinds(&judged(record, &options)).contains(&"not-followed");
        assert!(told(&late(5000, 20)));
        assert!(!told(&late(5000, 0)));
        // Shorter than what is looked at.
        assert!(
            judged(&record.span(0.0, 12.0).unwrap(), &options)
                .findings()
                .iter()
                .all(|f| f.kind != "not-followed")
        );
    }

    #[test]
    fn the_level_of_a_moment_follows_the_estimate() {
        let options = TrackOptions {
            start: StartAt::Nothing,
            ..TrackOptions::usual(Method::physical(), 29)
        };
        let record = simulated(Condition::C1);
        let mut tracker = Tracker::new(&options, None, record.sample_time()).unwrap();
        // From nothing nothing is known.
        assert_ne!(tracker.level(&tracker.operator()), VerdictLevel::Trustworthy);
        let usual = TrackOptions::usual(Method::physical(), 29);
        let mut known = Tracker::new(&usual, Some(&record), record.sample_time()).unwrap();
        for (e, u) in record.input().iter().zip(record.output()) {
            tracker.step(*e, *u);
            known.step(*e, *u);
        }
        let mut operator = known.operator().unwrap();
        assert_eq!(known.level(&Ok(operator)), VerdictLevel::Trustworthy);
        operator.zeta_nm.value = 4.0;
        assert_eq!(known.level(&Ok(operator)), VerdictLevel::Doubtful);
        for gain in [&mut operator.k_e, &mut operator.k_e_dot] {
            gain.standard_error = Some(gain.value.abs());
        }
        assert_eq!(known.level(&Ok(operator)), VerdictLevel::NotDetermined);
        assert_eq!(known.level(&Err(NotConvertible::ZeroGain)), VerdictLevel::Doubtful);
    }

    #[test]
    fn orders_of_no_operator_are_judged_by_their_coefficients() {
        let record = simulated(Condition::C1);
        let orders = Orders {
            na: 3,
            nb: 3,
            nk: 29,
            ..Orders::default()
        };
        let options = TrackOptions::new(Method::rls(), Structure::Arx, orders);
        let tracker = Tracker::new(&options, Some(&record), record.sample_time()).unwrap();
        assert_eq!(tracker.level(&tracker.operator()), VerdictLevel::Trustworthy);
        let verdict = judged(&record, &options);
        assert!(!kinds(&verdict).contains(&"not-convertible"), "{verdict}");
    }
}
