//! Reliability of each answer of a result: the response, the crossover, the phase margin and each parameter.
//!
//! A finding against the data or the fit affects all answers. In addition, an individual answer may be undetermined,
//! such as a parameter about which the data contain no information, or a crossover whose interval contains zero. The
//! level of the result depends only on the requested answers: a result whose delay is undetermined is trustworthy if
//! the crossover is requested, and not determined if the delay is requested. By default the response is requested, and
//! an undetermined crossover or margin gives a warning.

use hoid_ident::{Fit, GreyBoxFit, SigmoidFit, diagnostics::is_undetermined, family::FamilyFit};
use hoid_model::{
    ContinuousTransferFunction, Finding, Severity, Verdict, operator_family::PARAMETERS, uncertainty::Estimate,
};

use crate::AnalysisError;

/// Name of the answer for the response of the person.
pub const RESPONSE_ANSWER: &str = "response";
/// Names of the answers for the crossover frequency and the phase margin of the loop.
pub const LOOP_ANSWERS: [&str; 2] = ["crossover", "phase_margin"];
/// Kind of the finding that an individual answer is undetermined.
const UNDETERMINED_ANSWER_KIND: &str = "open-answer";
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
    /// Returns all answers, for the given controlled element.
    fn answers(&self, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus>;
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

/// Adds the findings on the requested answers to the verdict on the fit. By default the response is requested, and an
/// undetermined crossover or margin adds a warning.
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
            .map(|finding| Finding::warning(UNDETERMINED_ANSWER_KIND, finding.message))
            .collect()
    } else {
        let wanted = asked.iter().filter_map(|name| match of(name) {
            Some(answer) => answer.open.clone(),
            None => Some(undetermined_finding(format!("this result does not contain {name}"))),
        });
        wanted.collect()
    };
    verdict.append(open)
}

/// Returns the verdict on one answer: the findings on the fit as a whole and, if this answer is undetermined, the
/// reason.
pub fn answer_verdict(verdict: &Verdict, answer: &AnswerStatus) -> Verdict {
    let whole = verdict
        .findings()
        .iter()
        .filter(|finding| finding.kind != UNDETERMINED_ANSWER_KIND);
    Verdict::of(whole.chain(&answer.open).cloned().collect())
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

/// An estimate with its 95 % interval.
type MeasureWithInterval = (Estimate, Option<(f64, f64)>);

/// Assesses the crossover and the phase margin of a loop. Each is given with its interval; `None` means that it does
/// not exist.
fn loop_answers(measures: [Option<MeasureWithInterval>; 2]) -> impl Iterator<Item = AnswerStatus> {
    let words = ["the crossover", "the phase margin"];
    (0..2).map(move |k| {
        let why = match measures[k] {
            None => Some(format!(
                "{} is not determined: the loop gain does not cross 1 from above",
                words[k]
            )),
            Some((value, interval)) => {
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

impl Answers for FamilyFit {
    fn answers(&self, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        let mut all = vec![answer_status(RESPONSE_ANSWER, None)];
        if let Some(element) = element {
            let found = self.loop_measures(0, element);
            all.extend(loop_answers([
                found.map(|m| (m.crossover_rad_s, m.crossover_interval)),
                found.map(|m| (m.phase_margin_deg, m.phase_margin_interval)),
            ]));
        }
        all.extend(self.operator(0).parameters.iter().map(|p| {
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
    fn answers(&self, _element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        operator_answers(self.polynomial_fit(0))
    }
}

impl Answers for SigmoidFit {
    fn answers(&self, _element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        vec![answer_status(RESPONSE_ANSWER, None)]
    }
}

/// Returns the answers of a polynomial fit: the response, and the parameters of the operator that it represents.
pub(crate) fn operator_answers(fit: &Fit) -> Vec<AnswerStatus> {
    let mut all = vec![answer_status(RESPONSE_ANSWER, None)];
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
        assert_eq!(answer_verdict(&asked, &answers[0]).level, VerdictLevel::Doubtful);
        assert_eq!(answer_verdict(&asked, &answers[1]).level, VerdictLevel::NotDetermined);
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
            let all: Vec<AnswerStatus> = loop_answers([Some((one, interval)), None]).collect();
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
