//! Claims on batch fits of Box-Jenkins models with m* = m0: bias by remnant order, delay and noise
//! level.

use super::{
    batch_arx::compare_conditions,
    claim::{Claim, Source, Theme},
    evidence::Evidence,
    rules::{ACCEPTABLE_BIAS, CLOSE_BIAS, LARGE_BIAS, MIN_LINEAR_R2, Part},
    settings::{
        DELAYS, DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, NOISE_LEVELS, REMNANT_ORDERS, Setting, TRUE_DELAY,
        WITHOUT_REMNANT, bias_of, settings,
    },
    statistics::{linearity, median_or_nan},
    value::Value,
};

const PLANS: &[&str] = &["bias"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "bj-same-for-all-orders",
        theme: Theme::BatchBj,
        statement: "\"The remnant filter order no longer meaningfully affects the bias and accuracy in BJ estimation.\"",
        reference: "V.A.1, Fig. 6; VIII; 6.1.2",
        measure: "Median bias at m0 = 2 to 4 minus that at m0 = 1, BJ(m* = m0), C1 and C2, n_k* = 29, percentage \
                  points, by coefficient and noise level.",
        plans: PLANS,
        source: Source::Data(check_bias_independent_of_order),
    },
    Claim {
        id: "bj-close-to-zero",
        theme: Theme::BatchBj,
        statement: "BJ: \"relative bias values are close to zero for increasing values in noise level\".",
        reference: "V.A.1, Fig. 6",
        measure: "Magnitude of the median bias, BJ(m* = m0), C1, n_k* = 29, by coefficient, m0 and noise level.",
        plans: PLANS,
        source: Source::Data(check_bias_close_to_zero),
    },
    Claim {
        id: "bj-around-noise-free",
        theme: Theme::BatchBj,
        statement: "BJ: \"results fluctuate around the bias of the remnant-free case at each model time delay\".",
        reference: "V.A.1, Fig. 6; 6.1.2, Fig. C.3",
        measure: "Median bias minus that at P_n = 0, BJ(m* = m0), C1, n_k* = 25 to 30, percentage points, by coefficient, m0 and noise level.",
        plans: PLANS,
        source: Source::Data(check_bias_around_noise_free),
    },
    Claim {
        id: "bj-linear-in-delay",
        theme: Theme::BatchBj,
        statement: "\"The BJ estimator creates lag or lead depending on the assumed model time delay, hence, a linear trend is also found.\"",
        reference: "V.A.1, Fig. 6",
        measure: "R^2 of a straight line fitted to the median biases at n_k* = 25 to 30, BJ(m* = m0), by coefficient, m0 and noise level, C1.",
        plans: PLANS,
        source: Source::Data(check_bias_linear_in_delay),
    },
    Claim {
        id: "bj-lead-and-lag",
        theme: Theme::BatchBj,
        statement: "\"BJ poles are placed at lower frequencies for smaller model time delays to create additional lag, and vice versa.\"",
        reference: "6.1.2, Figs. D.5 to D.8",
        measure: "Median paired change in omega_nm from n_k* = 29 to each other delay, % of the true value, BJ(m* = m0), C1.",
        plans: PLANS,
        source: Source::Data(check_poles_follow_delay),
    },
    Claim {
        id: "bj-almost-exact",
        theme: Theme::BatchBj,
        statement: "BJ(m* = 1): \"almost 100 % accurate estimations in all scenarios\".",
        reference: "V.A.2, Fig. 10",
        measure: "Median response_error of BJ(m* = 1), C1, n_k* = 29, by m0 and noise level.",
        plans: PLANS,
        source: Source::Data(check_almost_exact_estimates),
    },
    Claim {
        id: "bj-m2-worst-without-remnant",
        theme: Theme::BatchBj,
        statement: "Remnant-free: \"a remnant order equal to 2 produces the highest deviations\" of BJ.",
        reference: "6.1.2, Figs. D.5 to D.8",
        measure: "response_error of BJ(m* = 2) minus the largest of the other orders, without remnant, C1, n_k* = 25 to 28 and 30, %.",
        plans: PLANS,
        source: Source::Data(check_second_order_worst),
    },
    Claim {
        id: "bj-t-n-100-percent",
        theme: Theme::BatchBj,
        statement: "Remnant time constant T_n at orders above 1: \"relative biases around 100 % are obtained\".",
        reference: "6.1.2, Fig. C.5",
        measure: "Magnitude of the median bias of T_n (backward Euler, as in B.2), BJ(m* = m0), m0 = 2 to 4, C1, n_k* = 29; the bias with exact retrieval is also shown.",
        plans: PLANS,
        source: Source::Data(check_remnant_time_constant),
    },
    Claim {
        id: "bj-remnant-gain",
        theme: Theme::BatchBj,
        statement: "\"The estimation of the remnant gain also presents important errors for m-th orders greater than 1.\"",
        reference: "6.1.2, Fig. C.5",
        measure: "Magnitude of the median bias of K_n (backward Euler, as in B.2), BJ(m* = m0), m0 = 2 to 4, C1, n_k* = 29; the bias with exact retrieval is also shown.",
        plans: PLANS,
        source: Source::Data(check_remnant_gain),
    },
    Claim {
        id: "bj-c2-against-c1",
        theme: Theme::BatchBj,
        statement: "In C2 \"K_e and T_L associated with the HO zero present a less precise estimation, while the neuromuscular dynamics are better captured\" (BJ).",
        reference: "6.1.2, Figs. C.4, C.12",
        measure: "Median |bias| in C2 minus that in C1, percentage points, BJ(m* = m0), n_k* = 29, by m0 and noise level.",
        plans: PLANS,
        source: Source::Data(check_bias_in_second_condition),
    },
];

fn check_bias_independent_of_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|median bias minus that at m0 = 1| within 5 points");
    for at in settings(&["C1", "C2"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let first = study.median(&Setting { m0: 1, ..at }.bj(&bias_of(name), 1, TRUE_DELAY))?;
            let found = study.median(&at.bj(&bias_of(name), at.m0, TRUE_DELAY))?;
            part.add_below(at.label(name), found.minus(first).abs(), CLOSE_BIAS);
        }
    }
    Ok(vec![part])
}

fn check_bias_close_to_zero(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|median bias| within 5 %");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            part.add_below(
                at.label(name),
                study.median(&at.bj(&bias_of(name), at.m0, TRUE_DELAY))?.abs(),
                CLOSE_BIAS,
            );
        }
    }
    Ok(vec![part])
}

fn check_bias_around_noise_free(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut parts = Vec::new();
    for (is_true, label) in [(true, "n_k* = 29"), (false, "other n_k*")] {
        let mut part = Part::new(&format!("|median bias minus that at P_n = 0| within 5 points, {label}"));
        for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
            for nk in DELAYS.into_iter().filter(|nk| (*nk == TRUE_DELAY) == is_true) {
                for name in DISCRETE_PARAMETERS {
                    let fit = |at: Setting| study.median(&at.bj(&bias_of(name), at.m0, nk));
                    let change = fit(at)?.minus(fit(Setting { level: 0.0, ..at })?);
                    part.add_below(at.label(&format!("n_k* = {nk}, {name}")), change.abs(), CLOSE_BIAS);
                }
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_bias_linear_in_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("R^2 of a straight line over n_k*, at least 0.9");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let queries = DELAYS.map(|nk| at.bj(&bias_of(name), at.m0, nk));
            let found = study.evaluate(&queries, &|s| {
                linearity(&s.iter().map(|v| median_or_nan(v)).collect::<Vec<_>>())
            })?;
            part.add_above(at.label(name), found, MIN_LINEAR_R2);
        }
    }
    Ok(vec![part])
}

fn check_poles_follow_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut lower = Part::new("omega_nm at n_k* < 29 lower than at n_k* = 29");
    let mut higher = Part::new("omega_nm at n_k* = 30 higher than at n_k* = 29");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        let omega = |nk| at.bj("bias_omega_nm", at.m0, nk);
        for nk in DELAYS.into_iter().filter(|nk| *nk != TRUE_DELAY) {
            let change = study.difference(&omega(nk), &omega(TRUE_DELAY))?;
            let label = at.label(&format!("n_k* = {nk}"));
            match nk < TRUE_DELAY {
                true => lower.add_below(label, change, 0.0),
                false => higher.add_above(label, change, 0.0),
            }
        }
    }
    Ok(vec![lower, higher])
}

fn check_almost_exact_estimates(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("median response_error within 10 %");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        part.add_below(
            at.label(""),
            study.median(&at.bj("response_error", 1, TRUE_DELAY))?,
            ACCEPTABLE_BIAS,
        );
    }
    Ok(vec![part])
}

fn check_second_order_worst(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("response_error of m* = 2 minus the largest of the others, above 0");
    for nk in DELAYS.into_iter().filter(|nk| *nk != TRUE_DELAY) {
        let queries = REMNANT_ORDERS.map(|m| WITHOUT_REMNANT.bj("response_error", m, nk));
        let found = study.evaluate(&queries, &|s| {
            median_or_nan(&s[1])
                - [0, 2, 3]
                    .map(|i| median_or_nan(&s[i]))
                    .into_iter()
                    .fold(f64::MIN, f64::max)
        })?;
        part.add_above(WITHOUT_REMNANT.label(&format!("n_k* = {nk}")), found, 0.0);
    }
    for m in REMNANT_ORDERS {
        part.add_shown(
            format!("response_error of m* = {m} at n_k* = 25, %"),
            study.median(&WITHOUT_REMNANT.bj("response_error", m, 25))?,
        );
    }
    Ok(vec![part])
}

/// Tests the bias of a remnant parameter retrieved as in the thesis (backward Euler), and shows it next to the bias of
/// the exact retrieval.
fn check_remnant_parameter(
    evidence: &Evidence<'_>,
    name: &str,
    mut part: Part,
    test: &dyn Fn(&mut Part, String, Value),
) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        let found = study.median(&at.bj(&format!("bias_{name}_backward_euler"), at.m0, TRUE_DELAY))?;
        test(&mut part, at.label(""), found.abs());
        if at.level == 0.1 {
            part.add_shown(
                format!("median bias of {name} at m0 = {}, backward Euler, %", at.m0),
                found,
            );
            let exact = study.median(&at.bj(&bias_of(name), at.m0, TRUE_DELAY))?;
            part.add_shown(format!("median bias of {name} at m0 = {}, exact, %", at.m0), exact);
        }
    }
    Ok(vec![part])
}

fn check_remnant_time_constant(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let part = Part::new("|median bias| of T_n from 50 to 150 %");
    check_remnant_parameter(evidence, "T_n", part, &|part, label, found| {
        part.add_around(label, found, 100.0)
    })
}

fn check_remnant_gain(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let part = Part::new("|median bias| of K_n above 25 %");
    check_remnant_parameter(evidence, "K_n", part, &|part, label, found| {
        part.add_above(label, found, LARGE_BIAS)
    })
}

fn check_bias_in_second_condition(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    compare_conditions(
        &|at, quantity| study.median_magnitude(&at.bj(quantity, at.m0, TRUE_DELAY)),
        &REMNANT_ORDERS,
    )
}
