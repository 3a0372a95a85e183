//! Claims on the noise level, the remnant time constant and the sample time.

use super::{
    claim::{Claim, Source, Theme},
    evidence::Evidence,
    rules::{CLOSE_BIAS, Part},
    settings::{DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, REMNANT_ORDERS, bias_of, name_with_f, settings},
};
use hoid_study::Query;

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "noise-level-mean",
        theme: Theme::Noise,
        statement: "\"The average obtained noise level only presents small deviations with respect to the demanded ones.\"",
        reference: "A.4, Fig. A.1",
        measure: "Mean obtained level, (var u - var u0) / var u, minus the demanded level, in magnitude, C1, m0 = 1 to 4, 18 levels: within 0.02.",
        plans: &["noise-level"],
        source: Source::Data(check_mean_level),
    },
    Claim {
        id: "noise-level-scatter",
        theme: Theme::Noise,
        statement: "\"The variability of the resultant P_n is reduced for the entire domain.\"",
        reference: "A.4, Fig. A.1",
        measure: "Standard deviation of the obtained level of one run, C1, m0 = 1 to 4, 18 levels: within 0.05.",
        plans: &["noise-level"],
        source: Source::Data(check_level_scatter),
    },
    Claim {
        id: "t-n-little-effect",
        theme: Theme::Noise,
        statement: "The remnant time constant \"does not have much effect on the estimation accuracy\".",
        reference: "VII; 6 (\"low relevance\")",
        measure: "Median bias at T_n = 0.2 s minus that at 0.06 s, C1 and C2, n_k* = 29, BJ(m* = 1), and ARX at m0 = 2 to 4, percentage points.",
        plans: &["remnant-time-constant"],
        source: Source::Data(check_time_constant),
    },
    Claim {
        id: "pade-need-not-hurt",
        theme: Theme::Noise,
        statement: "Decimation with a Pade delay: \"the BJ algorithm performance does not have to necessarily diminish in this case\".",
        reference: "Conclusions of Part II; VII",
        measure: "Median paired difference in response_error, BJ with a Pade delay of order 1 to 3 at Ts = 0.02 to 0.08 s minus BJ at 0.01 s, C1, m0 = 1 and 2: within 5 points.",
        plans: &["decimation"],
        source: Source::Data(check_pade_decimation),
    },
];

fn check_mean_level(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("noise-level")?;
    let mut part = Part::new("|mean obtained minus demanded level| within 0.02");
    for at in settings(&["C1"], &REMNANT_ORDERS, &specified_levels()) {
        let mut found = study.mean(&at.query("noise_level_obtained"))?;
        found.value -= at.level;
        part.add_below(at.label(""), found.abs(), 0.02);
    }
    Ok(vec![part])
}

fn check_level_scatter(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("noise-level")?;
    let mut part = Part::new("standard deviation of the obtained level within 0.05");
    for at in settings(&["C1"], &REMNANT_ORDERS, &specified_levels()) {
        let found = study.evaluate(&[at.query("noise_level_obtained")], &|s| {
            hoid_study::Statistics::of(&s[0]).sd
        })?;
        part.add_below(at.label(""), found, 0.05);
    }
    Ok(vec![part])
}

/// Noise levels specified in the plan.
fn specified_levels() -> [f64; 18] {
    std::array::from_fn(|i| (5 * (i + 1)) as f64 / 100.0)
}

fn check_time_constant(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("remnant-time-constant")?;
    let mut parts = Vec::new();
    for (name, orders) in [("BJ", &REMNANT_ORDERS[..]), ("ARX", &HIGHER_REMNANT_ORDERS[..])] {
        let mut part = Part::new(&format!("{name}: |change in the median bias| within 5 points"));
        for at in settings(&["C1", "C2"], orders, &[0.1, 0.3]) {
            for coefficient in DISCRETE_PARAMETERS {
                let quantity = bias_of(&if name == "BJ" {
                    name_with_f(coefficient)
                } else {
                    coefficient.to_owned()
                });
                let fit = |t_n_s| study.median(&at.query(&quantity).name(name).t_n_s(t_n_s));
                part.add_below(at.label(coefficient), fit(0.2)?.minus(fit(0.06)?).abs(), CLOSE_BIAS);
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_pade_decimation(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("decimation")?;
    let mut parts = Vec::new();
    for order in 1..=3 {
        let mut part = Part::new(&format!(
            "Pade of order {order}: response_error minus that at 0.01 s, within 5 points"
        ));
        for m0 in [1, 2] {
            let fit = |name: &str, decimate| {
                Query::of("response_error")
                    .remnant_order(m0)
                    .name(name)
                    .decimate(decimate)
            };
            let full = fit("BJ, whole delay", 1);
            for decimate in 2..=8 {
                let found = study.difference(&fit(&format!("BJ, Pade {order}"), decimate), &full)?;
                part.add_below(format!("m0 = {m0}, Ts = 0.0{decimate} s"), found, CLOSE_BIAS);
            }
        }
        parts.push(part);
    }
    Ok(parts)
}
