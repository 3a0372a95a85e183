//! The head of a page: the verdict on the result, a summary in one sentence, and the parameters with their errors. The
//! remainder of the page supports this summary.

use hoid_model::{Verdict, VerdictLevel, numbers::format_significant, uncertainty::Estimate};
use minijinja::{Value, context};

use crate::cells;

/// Summary of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSummary {
    /// Verdict on the fit.
    pub verdict: Verdict,
    /// The result as a sentence, from [`sentence`].
    pub sentence: Option<String>,
    /// The parameters; empty if the models on the page list them.
    pub parameters: Vec<ParameterRow>,
}

/// A parameter of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterRow {
    /// Name of the parameter, such as `T_L`.
    pub name: String,
    /// Unit of the parameter; empty if it has none or none was declared.
    pub unit: String,
    /// Value and standard error; `None` if the data do not determine the parameter.
    pub estimate: Option<Estimate>,
    /// The 95 % interval; an open end is infinite.
    pub interval: Option<(f64, f64)>,
    /// Remarks on the parameter, such as the share of a prior.
    pub remark: String,
}

impl FitSummary {
    pub(crate) fn to_value(&self) -> Value {
        let row = |r: &ParameterRow| {
            let end = |v: f64| {
                if v.is_finite() {
                    format_significant(v, 3)
                } else {
                    "open".to_owned()
                }
            };
            let interval = r.interval.map(|(low, high)| format!("{} to {}", end(low), end(high)));
            let name = cells::symbol(&r.name).0;
            let value = r.estimate.map(cells::cell);
            context! { name, unit => &r.unit, value, interval, remark => &r.remark }
        };
        context! {
            verdict => verdict(&self.verdict),
            sentence => &self.sentence,
            rows => self.parameters.iter().map(row).collect::<Vec<Value>>(),
        }
    }
}

/// A verdict as template values: its level, whether the result is trustworthy, reasons, and notes.
pub(crate) fn verdict(v: &Verdict) -> Value {
    context! {
        level => v.level.name(),
        good => v.level == VerdictLevel::Trustworthy,
        reasons => v.reasons().map(str::to_owned).collect::<Vec<String>>(),
        notes => v.notes().map(str::to_owned).collect::<Vec<String>>(),
    }
}

/// Word, name and unit of each parameter that occurs in the sentence about an operator, in the order of the sentence.
const WORDS: [(&str, &str, &str); 7] = [
    ("gain", "K", ""),
    ("gain", "K_e", ""),
    ("K/T_I", "K_over_T_I", ""),
    ("integral gain", "K_I", ""),
    ("lead", "T_L", " s"),
    ("lag", "T_I", " s"),
    ("delay", "tau_e", " s"),
];

/// The result as text, such as "gain 6.1, lead 0.60 s, delay 0.15 s; crossover 2.9 ± 0.1 rad/s, phase margin 34 ± 3°".
/// Quantities that are missing or not finite are omitted; `None` if nothing remains.
pub fn sentence<'a>(
    parameters: impl IntoIterator<Item = (&'a str, f64)>,
    crossover_rad_s: Option<Estimate>,
    phase_margin_deg: Option<Estimate>,
) -> Option<String> {
    let known: Vec<(&str, f64)> = parameters.into_iter().filter(|(_, value)| value.is_finite()).collect();
    // K/T_I is given only if the gain K is not determined.
    let has_gain = known.iter().any(|(name, _)| *name == "K");
    let of = |(word, name, unit): &(&str, &str, &str)| {
        let found = known.iter().find(|(known, _)| known == name);
        let found = found.filter(|_| !(has_gain && *name == "K_over_T_I"));
        found.map(|(_, value)| format!("{word} {}{unit}", format_significant(*value, 2)))
    };
    let of_person: Vec<String> = WORDS.iter().filter_map(of).collect();
    let measure = |word: &str, e: Option<Estimate>, unit: &str| {
        let e = e.filter(|e| e.value.is_finite())?;
        Some(match e.standard_error.filter(|error| error.is_finite()) {
            Some(error) => {
                let (value, error) = crate::numbers::with_uncertainty(e.value, Some(error));
                format!("{word} {value} \u{b1} {error}{unit}")
            }
            None => format!("{word} {}{unit}", format_significant(e.value, 3)),
        })
    };
    let of_loop: Vec<String> = [
        measure("crossover", crossover_rad_s, " rad/s"),
        measure("phase margin", phase_margin_deg, "\u{b0}"),
    ]
    .into_iter()
    .flatten()
    .collect();
    let parts: Vec<String> = [of_person, of_loop]
        .into_iter()
        .filter(|p| !p.is_empty())
        .map(|p| p.join(", "))
        .collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summary_contains_only_known_values() {
        let loop_of = |v: f64, e: f64| Some(Estimate::with_variance(v, e * e));
        let person = [("K_e", 6.123), ("T_L", 0.6), ("omega_nm", 9.0), ("tau_e", 0.15)];
        let words = sentence(person, loop_of(2.93, 0.11), loop_of(34.2, 2.6)).unwrap();
        assert!(words.starts_with("gain 6.1, lead 0.6"), "{words}");
        assert!(
            words.contains("delay 0.15 s; crossover 2.93 \u{b1} 0.11 rad/s, phase margin 34.2 \u{b1} 2.6\u{b0}"),
            "{words}"
        );
        assert_eq!(sentence([("T_L", f64::INFINITY)], None, None), None);
        assert_eq!(sentence([("T_L", 0.5)], None, None).unwrap(), "lead 0.5 s");
        let integrating = sentence([("K_over_T_I", 0.37), ("tau_e", 0.2)], None, None);
        assert_eq!(integrating.unwrap(), "K/T_I 0.37, delay 0.2 s");
        let lagging = sentence([("K", 3.0), ("K_over_T_I", 0.37), ("T_I", 8.0)], None, None);
        assert_eq!(lagging.unwrap(), "gain 3, lag 8 s");
        let known = Estimate::fixed(3.0);
        assert_eq!(sentence([], Some(known), None).unwrap(), "crossover 3 rad/s");
    }
}
