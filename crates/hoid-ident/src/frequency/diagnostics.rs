//! Findings about a describing function.
//!
//! For n runs in which u is not related to the excitation, the squared coherence `gamma^2` at a line exceeds x with the
//! probability `(1 - x)^{n-1}` (N. R. Goodman, 1957, in J. S. Bendat and A. G. Piersol, *Random Data*, 2010, section
//! 9.2); one in twenty is above `1 - 0.05^{1/(n-1)}`. Therefore `-(n-1) ln(1 - gamma^2)` has an exponential
//! distribution with mean 1, and twice the sum over K lines has a chi-square distribution with 2K degrees of freedom
//! (R. A. Fisher's combination of tests). This tests all lines together; two periods are sufficient.
//!
//! | finding | severity |
//! |---|---|
//! | `unrelated`: the coherences of all lines together do not differ from chance | undetermined |
//! | `low-coherence`: the coherence of single lines does not differ from chance | warning if a line next to the crossover or at least half of the lines are affected, otherwise a note |
//! | `few-runs`: a single run gives no errors, and two runs give inaccurate errors | warning |
//! | `periods-as-runs`: the errors are computed from the periods of one or two runs | note |
//! | `no-reference`: the channel of the excitation is not known | note |
//! | `no-crossover`, `large-error`: there is no crossover between the lines; a standard error is large relative to the value | warning |
//! | `several-crossovers`: the magnitude falls through 0 dB more than once | note |
//! | `leakage`: the excitation has power at frequencies other than its lines | warning above 1 %, otherwise a note |
//! | `offset-not-whole`: the offset is close to an integer number of samples, which may have been meant | note |

use hoid_model::{Finding, Record};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{
    describe::DescribingFunction,
    excitation::{Excitation, channel_values},
    open_loop::OpenLoop,
    options::Realisation,
    spectrum::{coefficients, power},
    window::Window,
};
use crate::{IdentError, derived_quantities::MarginEstimates};

/// Significance level of the tests against chance.
const SIGNIFICANCE_LEVEL: f64 = 0.05;
/// Share of the power of the excitation outside its lines above which the cause cannot be rounding in the file.
const MAX_ROUNDING_LEAKAGE: f64 = 1e-4;
const LARGE_LEAKAGE: f64 = 1e-2;
/// An offset may have been meant to be an integer number of samples if its distance from an integer is in this range.
const NEAR_INTEGER_RANGE: (f64, f64) = (1e-6, 0.05);

/// Input data of the diagnostics.
pub(super) struct DiagnosticInputs<'a> {
    pub function: &'a DescribingFunction,
    pub excitation: &'a Excitation,
    pub channel: Option<&'a str>,
    pub realisation: Realisation,
    /// Open loop and its margins, if there is a controlled element.
    pub open_loop: Option<(&'a OpenLoop, &'a MarginEstimates)>,
    pub offset_samples: f64,
}

/// Returns the squared coherence that one in twenty sets of n unrelated runs exceeds; `None` for one run.
pub fn chance_coherence(n: usize) -> Option<f64> {
    (n > 1).then(|| 1.0 - SIGNIFICANCE_LEVEL.powf(1.0 / (n as f64 - 1.0)))
}

/// Returns the probability that the coherences of n unrelated runs, combined over all lines, are at least as large as
/// these; `None` for one run.
fn probability_by_chance(coherences: &[f64], n: usize) -> Option<f64> {
    let sum: f64 = coherences
        .iter()
        .map(|c| -(n as f64 - 1.0) * (1.0 - c.clamp(0.0, 1.0)).ln())
        .sum();
    if n < 2 || coherences.is_empty() || sum.is_nan() {
        return None;
    }
    let chi_square = ChiSquared::new(2.0 * coherences.len() as f64).ok()?;
    // The sum is infinite if a coherence is 1, i.e. without any remnant.
    Some(if sum.is_finite() { chi_square.sf(2.0 * sum) } else { 0.0 })
}

/// Returns all findings about the describing function of these records.
pub(super) fn findings(found: &DiagnosticInputs<'_>, records: &[Record]) -> Result<Vec<Finding>, IdentError> {
    let mut findings = Vec::new();
    findings.extend(runs_finding(found, records.len()));
    findings.extend(coherence_finding(found));
    if let Some((open_loop, margins)) = found.open_loop {
        findings.extend(loop_findings(open_loop, margins));
    }
    if found.channel.is_none() {
        findings.push(Finding::note(
            "no-reference",
            "the excitation channel is unknown: the ratios u/e are averaged, and this average is biased where \
             the remnant is large compared with e",
        ));
    }
    findings.extend(leakage_finding(found, records)?);
    let offset = found.offset_samples;
    let off = (offset - offset.round()).abs();
    if NEAR_INTEGER_RANGE.0 < off && off < NEAR_INTEGER_RANGE.1 {
        findings.push(Finding::note(
            "offset-not-whole",
            format!(
                "the offset is {offset:.4} samples: if {} samples are meant, give the offset in samples",
                offset.round()
            ),
        ));
    }
    Ok(findings)
}

fn runs_finding(found: &DiagnosticInputs<'_>, records: usize) -> Option<Finding> {
    let (n, periods) = (found.function.runs.len(), found.realisation == Realisation::Period);
    let what = match (periods, records) {
        (true, 1) => "periods of one run",
        (true, _) => "periods of two runs",
        (false, _) => "runs",
    };
    match n {
        1 => Some(Finding::warning(
            "few-runs",
            "one period of one run gives neither errors nor coherence: record more runs or longer runs",
        )),
        2 => Some(Finding::warning(
            "few-runs",
            format!(
                "the errors come from only two {what} and may be wrong by up to a factor of six at individual lines: \
                 record more runs"
            ),
        )),
        _ if periods => Some(Finding::note(
            "periods-as-runs",
            format!(
                "the errors are computed from {n} {what}, which differ less than runs do; record three or more runs \
                 to include the differences between runs"
            ),
        )),
        _ => None,
    }
}

fn coherence_finding(found: &DiagnosticInputs<'_>) -> Option<Finding> {
    let n = found.function.runs.len();
    // Without the excitation, the coherence is between e and u, which is large in any closed loop.
    found.channel?;
    let least = chance_coherence(n)?;
    let lines = &found.function.lines;
    let coherences: Vec<f64> = lines.iter().filter_map(|line| line.coherence).collect();
    let by_chance = probability_by_chance(&coherences, n)?;
    if by_chance > SIGNIFICANCE_LEVEL {
        return Some(Finding::undetermined(
            "unrelated",
            format!(
                "u does not follow the excitation: {n} unrelated runs would have coherences at least as large with a \
                 probability of {by_chance:.2}"
            ),
        ));
    }
    let low: Vec<usize> = (0..lines.len())
        .filter(|k| lines[*k].coherence.is_some_and(|c| c < least))
        .collect();
    // With two runs the coherence of a single line exceeds chance only if it is near 1; `few-runs` already reports this
    // limit.
    if low.is_empty() || n < 3 {
        return None;
    }
    let at: Vec<String> = low.iter().map(|k| format!("{:.2}", lines[*k].omega_rad_s)).collect();
    let words = format!(
        "at {} rad/s u may be unrelated to the excitation: the coherence is below {least:.2}, a value that 5 % of \
         sets of {n} unrelated runs exceed",
        at.join(", ")
    );
    let crossover = found.open_loop.and_then(|(_, m)| m.crossover_rad_s);
    let is_next_to_crossover = |k: &usize| {
        crossover.is_some_and(|c| {
            let above = lines.partition_point(|line| line.omega_rad_s <= c.value);
            *k == above || *k + 1 == above
        })
    };
    Some(
        if 2 * low.len() >= lines.len() || low.iter().any(is_next_to_crossover) {
            Finding::warning("low-coherence", words)
        } else {
            Finding::note("low-coherence", words)
        },
    )
}

fn loop_findings(open_loop: &OpenLoop, margins: &MarginEstimates) -> Vec<Finding> {
    let sizes: Vec<f64> = open_loop.response.iter().map(|l| l.norm()).collect();
    let (Some(low), Some(high)) = (open_loop.omega_rad_s.first(), open_loop.omega_rad_s.last()) else {
        return Vec::new();
    };
    let Some(crossover) = margins.crossover_rad_s else {
        let where_ = if sizes.iter().all(|l| *l < 1.0) {
            format!("the open-loop gain is below 1 at all lines: any crossover is below {low:.3} rad/s")
        } else if sizes.iter().all(|l| *l >= 1.0) {
            format!("the open-loop gain is above 1 at all lines: the crossover is above {high:.3} rad/s")
        } else {
            "the open-loop gain does not cross 1 from above between the lines".to_owned()
        };
        return vec![Finding::warning(
            "no-crossover",
            format!("{where_}; check that the controlled element is correct and in the units of the record"),
        )];
    };
    let mut findings = Vec::new();
    let again = sizes.windows(2).filter(|l| l[0] >= 1.0 && l[1] < 1.0).count();
    if again > 1 {
        findings.push(Finding::note(
            "several-crossovers",
            format!(
                "the open-loop gain crosses 1 from above {again} times between the lines; the lowest crossover is \
                 reported"
            ),
        ));
    }
    let large = |name: &str, unit: &str, e: hoid_model::uncertainty::Estimate, part: f64| {
        let s = e.standard_error.filter(|s| *s >= part * e.value.abs())?;
        Some(Finding::warning(
            "large-error",
            format!(
                "the {name} of {:.3} {unit} has a standard error of {s:.3} {unit}",
                e.value
            ),
        ))
    };
    findings.extend(large("crossover", "rad/s", crossover, 0.5));
    findings.extend(
        margins
            .phase_margin_deg
            .and_then(|e| large("phase margin", "deg", e, 1.0)),
    );
    findings
}

/// Returns a finding if the excitation has power at frequencies other than its lines. Causes are a span that is not a
/// whole number of periods, a damaged file, or noise in the measured channel.
fn leakage_finding(found: &DiagnosticInputs<'_>, records: &[Record]) -> Result<Option<Finding>, IdentError> {
    let Some(channel) = found.channel else {
        return Ok(None);
    };
    let mut worst: Option<(f64, &str)> = None;
    for record in records {
        let values = channel_values(record, channel, "the channel of the excitation")?;
        let window = Window::from_span(record, None, None, found.excitation.period_s())?;
        let (x, n) = (coefficients(values), values.len());
        let all: f64 = (1..x.len()).map(|k| power(&x, k, n)).sum();
        let lines = found.excitation.harmonics().iter().map(|h| h * window.periods);
        let at_lines: f64 = lines.filter(|k| *k < x.len()).map(|k| power(&x, k, n)).sum();
        let off = 1.0 - at_lines / all;
        if off.is_finite() && worst.is_none_or(|(most, _)| off > most) {
            worst = Some((off, record.label()));
        }
    }
    Ok(worst.filter(|(off, _)| *off > MAX_ROUNDING_LEAKAGE).map(|(off, label)| {
        let words = format!(
            "{channel} of {label} has {:.2} % of its power at non-excited frequencies: the span is not a whole number \
             of periods, lines are missing, or {channel} is a noisy measurement",
            100.0 * off
        );
        match off > LARGE_LEAKAGE {
            true => Finding::warning("leakage", words),
            false => Finding::note("leakage", words),
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_coherence_matches_its_distribution() {
        assert_eq!(chance_coherence(1), None);
        assert!((chance_coherence(2).unwrap() - 0.95).abs() < 1e-15);
        let ten = chance_coherence(10).unwrap();
        assert!(((1.0 - ten).powi(9) - 0.05).abs() < 1e-15);
        // For a single line, the probability is that of the line itself.
        for (n, c) in [(2, 0.3), (5, 0.6), (10, ten)] {
            let expected = (1.0_f64 - c).powi(n - 1);
            let found = probability_by_chance(&[c], n as usize).unwrap();
            assert!((found - expected).abs() < 1e-12, "{n} {c}: {found}");
        }
        assert_eq!(probability_by_chance(&[1.0, 0.5], 3), Some(0.0));
        assert_eq!(probability_by_chance(&[0.5], 1), None);
        assert_eq!(probability_by_chance(&[], 5), None);
        assert_eq!(probability_by_chance(&[f64::NAN], 5), None);
    }
}
