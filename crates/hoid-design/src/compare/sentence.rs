//! Differences as sentences for a paper.

use hoid_model::numbers::{format_significant, with_uncertainty};

use super::{Difference, Variation};

/// Significance level.
pub(super) const SIGNIFICANCE_LEVEL: f64 = 0.05;

/// Returns a sentence such as `crossover fell by 0.63 rad/s from fo to so (95 % 0.14 to 1.12, t(2) = -5.5, p = 0.032,
/// d_z = -3.2, n = 3)`. If the adjusted p-value is not below .05, the sentence reports that no difference was found.
/// For an interaction it names the factor whose effect differs.
pub(super) fn sentence(difference: &Difference, adjusted: bool) -> String {
    let Difference {
        quantity,
        estimate,
        from,
        to,
        ..
    } = difference;
    let what = quantity.sentence_name();
    let unit = match quantity.unit() {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let error = Some(estimate.standard_error);
    // The ends of the interval are rounded to the digits of the value.
    let digits = |v: f64| with_uncertainty(v, error).0;
    let test = test_text(difference, adjusted);
    let (low, high) = estimate.interval;
    let is_found = difference.p_adjusted < SIGNIFICANCE_LEVEL;
    let falls = estimate.value < 0.0;
    let (size, ends) = match falls {
        true => (
            digits(-estimate.value),
            format!("{} to {}", digits(-high), digits(-low)),
        ),
        false => (digits(estimate.value), format!("{} to {}", digits(low), digits(high))),
    };
    let signed = format!("{}{unit}", digits(estimate.value));
    let signed_ends = format!("{} to {}", digits(low), digits(high));
    match (&difference.effect, is_found) {
        (Some([factor, a, b]), found) => {
            let not = if found { "differed" } else { "was not found to differ" };
            format!(
                "the effect of {factor} on {what} ({b} - {a}) {not} between {from} and {to}: {signed} (95 % {signed_ends}, {test})"
            )
        }
        (None, false) => {
            format!("no difference in {what} was found: {to} - {from} is {signed} (95 % {signed_ends}, {test})")
        }
        (None, true) if difference.variation == Variation::Within => {
            let verb = if falls { "fell" } else { "rose" };
            format!("{what} {verb} by {size}{unit} from {from} to {to} (95 % {ends}, {test})")
        }
        (None, true) => {
            let word = if falls { "lower" } else { "higher" };
            format!("{what} was {size}{unit} {word} in {to} than in {from} (95 % {ends}, {test})")
        }
    }
}

fn test_text(difference: &Difference, adjusted: bool) -> String {
    let Difference { estimate, people, .. } = difference;
    let mut parts = vec![format!(
        "t({}) = {}",
        difference.degrees_of_freedom,
        format_significant(estimate.t, 2)
    )];
    parts.push(format!("p {}", p_value_text(estimate.p)));
    if adjusted && difference.p_adjusted != estimate.p {
        parts.push(format!("Holm p {}", p_value_text(difference.p_adjusted)));
    }
    if let Some(effect) = &difference.effect_size {
        parts.push(format!("{} = {}", effect.name, format_significant(effect.value, 2)));
    }
    let of = |group: usize| people.iter().filter(|(_, g)| *g == group).count();
    parts.push(match difference.variation {
        Variation::Within => format!("n = {}", people.len()),
        Variation::Between => format!("n = {} and {}", of(0), of(1)),
    });
    parts.join(", ")
}

/// Formats a p-value, such as `= 0.032` or `< 0.0001`.
pub(super) fn p_value_text(p: f64) -> String {
    if p < 1e-4 {
        "< 0.0001".to_owned()
    } else {
        format!("= {}", format_significant(p, 2))
    }
}
