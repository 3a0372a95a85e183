//! Reliability of each answer of a result: the response, the crossover, the phase margin and each parameter.
//!
//! A finding against the data or the fit affects all answers. In addition, an individual answer may be undetermined,
//! such as a parameter about which the data contain no information, or a crossover whose interval contains zero. The
//! level of the result depends only on the requested answers: a result whose delay is undetermined is trustworthy if
//! the crossover is requested, and not determined if the delay is requested. By default the response is requested, and
//! an undetermined crossover or margin gives a warning.

use hoid_ident::{Fit, GreyBoxFit, MarginEstimates, SigmoidFit, diagnostics::is_undetermined, family::FamilyFit};
use hoid_model::{
    AnswerVerdict, ContinuousTransferFunction, Finding, Severity, Verdict, margins::MANUAL_CONTROL_RANGE_RAD_S,
    numbers::Z_95, operator_family::PARAMETERS, uncertainty::Estimate,
};
use hoid_track::{NoCrossover, Trace};

use crate::AnalysisError;

/// Name of the answer for the response of the person.
pub const RESPONSE_ANSWER: &str = "response";
/// Names of the answers for the crossover frequency and the phase margin of the loop.
pub const LOOP_ANSWERS: [&str; 2] = ["crossover", "phase_margin"];
/// Kind of the finding that an individual answer is undetermined.
const UNDETERMINED_ANSWER_KIND: &str = "open-answer";
/// Kinds of the findings about an individual answer, which do not affect the other answers.
const KINDS_OF_ONE_ANSWER: [&str; 2] = [UNDETERMINED_ANSWER_KIND, "large-error"];
/// Reason why a loop has neither crossover nor phase margin.
const NO_CROSSING: &str = "the loop gain does not cross 1 from above";
/// Largest standard errors at which the crossover (relative to its value) and the phase margin (in deg) count as
/// determined.
const MAX_ERRORS: [f64; 2] = [0.5, 30.0];

/// Name of an answer and, if the answer is undetermined, the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct AnswerStatus {
    /// Name of the answer: `response`, `crossover`, `phase_margin`, or the name of a parameter.
    pub name: String,
    /// Reason why the data do not determine the answer; `None` if they do.
    pub open: Option<Finding>,
}

/// A fit that assesses each of its answers separately.
pub trait Answers {
    /// Returns all answers about the operator of a record, for the given controlled element.
    fn answers(&self, record: usize, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus>;
}

/// Checks the names of the requested answers and returns them in their standard form.
///
/// # Errors
/// [`AnalysisError::Options`] for an unknown name.
pub fn requested_names(names: &[String]) -> Result<Vec<String>, AnalysisError> {
    let known = || {
        let parameters = PARAMETERS.iter().map(|(name, _)| *name);
        [RESPONSE_ANSWER].into_iter().chain(LOOP_ANSWERS).chain(parameters)
    };
    let one = |name: &String| {
        let name = match name.trim() {
            "margin" => LOOP_ANSWERS[1],
            "delay" => "tau_e",
            other => other,
        };
        known().find(|known| *known == name).map(str::to_owned).ok_or_else(|| {
            let expected = known().collect::<Vec<_>>().join(", ");
            AnalysisError::Options {
                reason: format!("for: there is no quantity {name:?}; expected one of {expected}"),
            }
        })
    };
    names.iter().map(one).collect()
}

/// Adds the findings on the requested answers to the verdict on the result, and judges each answer. By default the
/// response is requested, and an undetermined crossover or margin adds a warning.
pub fn with_answers(verdict: Verdict, answers: &[AnswerStatus], asked: &[String]) -> Verdict {
    let of = |name: &str| answers.iter().find(|answer| answer.name == name);
    let open: Vec<Finding> = if asked.is_empty() {
        // A note that the estimated loop may be unstable does not lower the level.
        let is_reported = |finding: &Finding| {
            finding.severity > Severity::Note && matches!(finding.kind, "no-crossover" | "unstable-loop")
        };
        let wanted = LOOP_ANSWERS
            .iter()
            .filter(|_| !verdict.findings().iter().any(is_reported));
        let of_loop = wanted.filter_map(|name| of(name)?.open.clone());
        of_loop
            .map(|finding| Finding {
                severity: Severity::Doubt,
                ..finding
            })
            .collect()
    } else {
        let wanted = asked.iter().filter_map(|name| match of(name) {
            Some(answer) => answer.open.clone(),
            None => Some(undetermined_finding(format!("this result does not contain {name}"))),
        });
        wanted.collect()
    };
    judged(verdict.append(open), answers)
}

/// Returns the verdict with a verdict on each answer: the findings on the result as a whole and, if the answer is
/// undetermined, the reason.
pub fn judged(verdict: Verdict, answers: &[AnswerStatus]) -> Verdict {
    let is_whole = |finding: &&Finding| !KINDS_OF_ONE_ANSWER.contains(&finding.kind);
    let whole: Vec<Finding> = verdict.findings().iter().filter(is_whole).cloned().collect();
    let of = |answer: &AnswerStatus| AnswerVerdict::of(whole.iter().chain(&answer.open).cloned());
    let each = answers.iter().map(|answer| (answer.name.clone(), of(answer)));
    verdict.with_answers(each)
}

fn undetermined_finding(message: String) -> Finding {
    Finding::undetermined(UNDETERMINED_ANSWER_KIND, message)
}

fn answer_status(name: &str, why: Option<String>) -> AnswerStatus {
    AnswerStatus {
        name: name.to_owned(),
        open: why.map(undetermined_finding),
    }
}

/// An estimate with its 95 % interval; without an interval, that of a normal distribution applies.
type MeasureWithInterval = (Estimate, Option<(f64, f64)>);

/// Assesses the crossover and the phase margin of a loop. Each is given with its interval, or with the reason why it
/// does not exist.
fn loop_answers(measures: [Result<MeasureWithInterval, &str>; 2]) -> impl Iterator<Item = AnswerStatus> {
    let words = ["the crossover", "the phase margin"];
    (0..2).map(move |k| {
        let why = match measures[k] {
            Err(reason) => Some(format!("{} is not determined: {reason}", words[k])),
            Ok((value, interval)) => {
                let normal = value.standard_error.map(|s| Z_95 * s);
                let interval = interval.or(normal.map(|half| (value.value - half, value.value + half)));
                let scale = if k == 0 { value.value } else { 1.0 };
                let wide = value.standard_error.is_none_or(|s| s > MAX_ERRORS[k] * scale);
                let zero = k == 0 && interval.is_some_and(|(low, _)| low <= 0.0);
                (wide || zero).then(|| match interval {
                    Some((low, high)) => format!("{} is not determined: 95 % interval {low:.2} to {high:.2}", words[k]),
                    None => format!("{} is not determined: it has no standard error", words[k]),
                })
            }
        };
        answer_status(LOOP_ANSWERS[k], why)
    })
}

/// Judges the crossover and the phase margin, which have normal intervals.
fn margin_answers(margins: &MarginEstimates) -> impl Iterator<Item = AnswerStatus> {
    let of = |estimate: Option<Estimate>| estimate.map(|e| (e, None)).ok_or(NO_CROSSING);
    loop_answers([of(margins.crossover_rad_s), of(margins.phase_margin_deg)])
}

impl Answers for FamilyFit {
    fn answers(&self, record: usize, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        let mut all = vec![answer_status(RESPONSE_ANSWER, None)];
        if let Some(element) = element {
            let found = self.loop_measures(record, element).ok_or(NO_CROSSING);
            all.extend(loop_answers([
                found.map(|m| (m.crossover_rad_s, m.crossover_interval)),
                found.map(|m| (m.phase_margin_deg, m.phase_margin_interval)),
            ]));
        }
        all.extend(self.operator(record).parameters.iter().map(|p| {
            let why = match (p.determined, p.prior_share > 0.5) {
                (true, _) => None,
                (false, true) => Some(format!("{} is determined by the prior alone", p.name)),
                (false, false) => Some(format!("{} is not determined by the data", p.name)),
            };
            answer_status(&p.name, why)
        }));
        all
    }
}

impl Answers for GreyBoxFit {
    fn answers(&self, record: usize, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        operator_answers(self.polynomial_fit(record), element)
    }
}

impl Answers for SigmoidFit {
    fn answers(&self, _record: usize, _element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        vec![answer_status(RESPONSE_ANSWER, None)]
    }
}

/// Returns the answers of a describing function: the response, and with a controlled element the loop.
pub(crate) fn description_answers(margins: Option<&MarginEstimates>) -> Vec<AnswerStatus> {
    let response = answer_status(RESPONSE_ANSWER, None);
    let of_loop = margins.into_iter().flat_map(margin_answers);
    std::iter::once(response).chain(of_loop).collect()
}

/// Returns the answers of a trace, which refer to its last row: the response, with a controlled element the loop, and
/// the estimated parameters of the operator.
pub(crate) fn trace_answers(trace: &Trace) -> Vec<AnswerStatus> {
    let mut all = vec![answer_status(RESPONSE_ANSWER, None)];
    let Some(row) = trace.len().checked_sub(1) else {
        return all;
    };
    if let Some(found) = trace.open_loop(row) {
        let found = found.map_err(NoCrossover::as_text);
        all.extend(loop_answers([
            found.map(|f| (f.crossover_rad_s, None)),
            found.map(|f| (f.phase_margin_deg, None)),
        ]));
    }
    let judged = trace.operator(row).map(|operator| trace.determinations(&operator));
    all.extend(judged.into_iter().flatten().map(|(name, yes)| {
        let why = (!yes).then(|| format!("{name} at the end is not determined by the record"));
        answer_status(name, why)
    }));
    all
}

/// Returns the crossover and margins of a polynomial model in the frequency range of manual control, limited to half
/// the sampling frequency: the sampled model contains no information above it.
pub fn loop_margins(fit: &Fit, element: &ContinuousTransferFunction) -> MarginEstimates {
    let (low, high) = MANUAL_CONTROL_RANGE_RAD_S;
    let high = high.min(fit.model().sample_time().nyquist_rad_s());
    fit.margins(|omega| element.response(omega), (low, high))
}

/// Returns the answers of a polynomial fit: the response, with a controlled element the loop, and the parameters of the
/// operator that the model represents.
pub(crate) fn operator_answers(fit: &Fit, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
    let margins = element
        .filter(|_| fit.model().structure().has_input())
        .map(|element| loop_margins(fit, element));
    let mut all = description_answers(margins.as_ref());
    if let Ok(operator) = fit.operator() {
        all.extend(operator.rows().iter().map(|(name, _, estimate)| {
            let why = is_undetermined(estimate)
                .then(|| format!("{name} ({estimate}) is not significantly different from zero"));
            answer_status(name, why)
        }));
    }
    all
}

#[cfg(test)]
mod tests {
    use hoid_model::VerdictLevel;

    use super::*;

    #[test]
    fn level_covers_only_the_requested_answers() {
        let answers = [
            answer_status(RESPONSE_ANSWER, None),
            answer_status("tau_e", Some("tau_e is not determined by the data".to_owned())),
        ];
        let level = |asked: &[&str]| {
            let asked: Vec<String> = asked.iter().map(|name| (*name).to_owned()).collect();
            with_answers(Verdict::of(Vec::new()), &answers, &asked).level
        };
        assert_eq!(level(&[]), VerdictLevel::Trustworthy);
        assert_eq!(level(&["response"]), VerdictLevel::Trustworthy);
        assert_eq!(level(&["response", "tau_e"]), VerdictLevel::NotDetermined);
        assert_eq!(level(&["T_I"]), VerdictLevel::NotDetermined);
        // A finding against the whole result affects each answer; an undetermined answer affects only itself.
        let whole = Verdict::of(vec![Finding::warning("leverage", "few samples")]);
        let asked = with_answers(whole, &answers, &["tau_e".to_owned()]);
        assert_eq!(asked.answers[RESPONSE_ANSWER].level, VerdictLevel::Doubtful);
        assert_eq!(asked.answers[RESPONSE_ANSWER].reasons.len(), 1);
        assert_eq!(asked.answers["tau_e"].level, VerdictLevel::NotDetermined);
        assert_eq!(asked.answers["tau_e"].reasons[0].kind, UNDETERMINED_ANSWER_KIND);
    }

    #[test]
    fn undetermined_crossover_is_doubtful_despite_a_note_on_the_loop() {
        let open = answer_status(LOOP_ANSWERS[0], Some("the crossover is not determined".to_owned()));
        let answers = [answer_status(RESPONSE_ANSWER, None), open];
        let found = |finding: Finding| with_answers(Verdict::of(vec![finding]), &answers, &[]);
        let noted = found(Finding::note(
            "unstable-loop",
            "the loop may be stable within its errors",
        ));
        assert_eq!(noted.level, VerdictLevel::Doubtful);
        assert_eq!(noted.reasons().collect::<Vec<_>>(), ["the crossover is not determined"]);
        // A reason against the loop makes a second reason redundant.
        assert_eq!(
            found(Finding::warning("unstable-loop", "the loop is unstable"))
                .findings()
                .len(),
            1
        );
    }

    #[test]
    fn crossover_with_zero_in_its_interval_is_undetermined() {
        let of = |value: f64, s: f64| {
            let one = Estimate::with_variance(value, s * s);
            let interval = Some((value - 2.0 * s, value + 2.0 * s));
            let all: Vec<AnswerStatus> = loop_answers([Ok((one, interval)), Err("there is none")]).collect();
            (all[0].open.is_some(), all[1].open.is_some())
        };
        assert_eq!(of(3.0, 0.1), (false, true));
        assert_eq!(of(1.2, 1.5), (true, true));
    }

    #[test]
    fn requested_names_are_parsed() {
        let names = |text: &str| requested_names(&text.split(',').map(str::to_owned).collect::<Vec<_>>());
        assert_eq!(
            names("crossover, delay,margin").unwrap(),
            ["crossover", "tau_e", "phase_margin"]
        );
        assert!(
            names("speed")
                .unwrap_err()
                .to_string()
                .contains("expected one of response, crossover")
        );
    }
}
