//! Claims that compare batch fits of Box-Jenkins models with m* = m0 with batch fits of ARX models.

use super::{
    claim::{Claim, Source, Theme},
    evidence::Evidence,
    rules::{HEAVY_REDUCTION, Part},
    settings::{
        DELAYS, DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, NOISE_LEVELS, REMNANT_ORDERS, Setting, TRUE_DELAY,
        WITHOUT_REMNANT, bias_of, settings,
    },
    statistics::{median_magnitude, median_or_nan},
};

const PLANS: &[&str] = &["bias"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "bj-reduces-bias-at-m1",
        theme: Theme::BatchBj,
        statement: "\"The important bias found in first-order remnant order simulations is now highly reduced\" by BJ.",
        reference: "V.A.1, Fig. 6; 6.1.2, Fig. C.3",
        measure: "Median |bias| of BJ(m* = 1) divided by that of ARX, m0 = 1, C1, n_k* = 29, by coefficient and noise level.",
        plans: PLANS,
        source: Source::Data(check_bias_reduced_at_first_order),
    },
    Claim {
        id: "bj-5000-percent",
        theme: Theme::BatchBj,
        statement: "\"BJ offers a 5000 % more accurate estimation when the remnant order is m* = 1.\"",
        reference: "VII",
        measure: "Median |bias| of ARX divided by that of BJ(m* = 1), m0 = 1, C1, n_k* = 29: around 50.",
        plans: PLANS,
        source: Source::Data(check_fifty_times_smaller_bias),
    },
    Claim {
        id: "bj-more-robust",
        theme: Theme::BatchBj,
        statement: "\"BJ presents more robustness than ARX when facing high noise levels.\"",
        reference: "VIII; Conclusions of Part II",
        measure: "Magnitude of the change in the median bias from P_n = 0.1 to 0.3: BJ(m* = m0) minus ARX, C1, n_k* = \
                  29, percentage points.",
        plans: PLANS,
        source: Source::Data(check_more_robust),
    },
    Claim {
        id: "bj-half-the-error",
        theme: Theme::BatchBj,
        statement: "For m0 >= 2 \"BJ estimators still provide a response with around 50 % less estimation error\" than ARX.",
        reference: "V.A.1, Figs. 5, 6",
        measure: "100 (1 - median |bias| of BJ(m* = m0) / median |bias| of ARX), m0 = 2 to 4, C1, n_k* = 29, by coefficient and noise level.",
        plans: PLANS,
        source: Source::Data(check_half_the_error),
    },
    Claim {
        id: "bj-always-outperforms",
        theme: Theme::BatchBj,
        statement: "Except for the remnant-free case, \"the BJ model always outperforms the ARX one, both in magnitude and phase estimation\".",
        reference: "6.1.2, Figs. D.9, D.18",
        measure: "Median paired difference in response_error (the root mean square of |H - H0| / |H0| at the lines of the forcing function), BJ(m* = m0) minus ARX, C1 and C2, n_k* = 29, %.",
        plans: PLANS,
        source: Source::Data(check_bj_outperforms_arx),
    },
    Claim {
        id: "bj-worse-without-remnant",
        theme: Theme::BatchBj,
        statement: "\"In remnant-free cases, BJ models present higher deviations than ARX models\" at wrong delays.",
        reference: "6.1.2, Figs. D.5 to D.8",
        measure: "response_error of BJ(m*) minus that of ARX, without remnant, n_k* = 25 to 28 and 30, C1, m* = 1 to 4, %.",
        plans: PLANS,
        source: Source::Data(check_bj_worse_without_remnant),
    },
];

fn check_bias_reduced_at_first_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("median |bias| of BJ divided by that of ARX, below 0.25");
    for at in settings(&["C1"], &[1], &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let queries = [at.bj(&bias_of(name), 1, TRUE_DELAY), at.arx(&bias_of(name), TRUE_DELAY)];
            part.add_below(
                at.label(name),
                study.evaluate(&queries, &|s| median_magnitude(&s[0]) / median_magnitude(&s[1]))?,
                HEAVY_REDUCTION,
            );
        }
    }
    Ok(vec![part])
}

fn check_fifty_times_smaller_bias(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("median |bias| of ARX divided by that of BJ, from 25 to 75");
    for at in settings(&["C1"], &[1], &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let queries = [at.bj(&bias_of(name), 1, TRUE_DELAY), at.arx(&bias_of(name), TRUE_DELAY)];
            part.add_effect(
                at.label(name),
                study.evaluate(&queries, &|s| median_magnitude(&s[1]) / median_magnitude(&s[0]))?,
                50.0,
            );
        }
    }
    Ok(vec![part])
}

fn check_more_robust(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|change| of BJ minus that of ARX, below 0");
    for at in settings(&["C1"], &REMNANT_ORDERS, &[0.1]) {
        let noisy = Setting { level: 0.3, ..at };
        for name in DISCRETE_PARAMETERS {
            let name_of_bias = bias_of(name);
            let queries = [
                at.bj(&name_of_bias, at.m0, TRUE_DELAY),
                noisy.bj(&name_of_bias, at.m0, TRUE_DELAY),
                at.arx(&name_of_bias, TRUE_DELAY),
                noisy.arx(&name_of_bias, TRUE_DELAY),
            ];
            let found = study.evaluate(&queries, &|s| {
                (median_or_nan(&s[1]) - median_or_nan(&s[0])).abs()
                    - (median_or_nan(&s[3]) - median_or_nan(&s[2])).abs()
            })?;
            part.add_below(format!("C1, m0 = {}, {name}", at.m0), found, 0.0);
        }
    }
    Ok(vec![part])
}

fn check_half_the_error(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("reduction in the median |bias|, from 25 to 75 %");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let queries = [
                at.bj(&bias_of(name), at.m0, TRUE_DELAY),
                at.arx(&bias_of(name), TRUE_DELAY),
            ];
            let found = study.evaluate(&queries, &|s| {
                100.0 * (1.0 - median_magnitude(&s[0]) / median_magnitude(&s[1]))
            })?;
            part.add_effect(at.label(name), found, 50.0);
        }
    }
    Ok(vec![part])
}

fn check_bj_outperforms_arx(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("response_error of BJ minus that of ARX, below 0");
    for at in settings(&["C1", "C2"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        let pair = [
            at.bj("response_error", at.m0, TRUE_DELAY),
            at.arx("response_error", TRUE_DELAY),
        ];
        part.add_below(at.label(""), study.difference(&pair[0], &pair[1])?, 0.0);
    }
    Ok(vec![part])
}

fn check_bj_worse_without_remnant(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("response_error of BJ minus that of ARX, above 0");
    for nk in DELAYS.into_iter().filter(|nk| *nk != TRUE_DELAY) {
        let arx = study.median(&WITHOUT_REMNANT.arx("response_error", nk))?;
        for m in REMNANT_ORDERS {
            let bj = study.median(&WITHOUT_REMNANT.bj("response_error", m, nk))?;
            part.add_above(
                WITHOUT_REMNANT.label(&format!("m* = {m}, n_k* = {nk}")),
                bj.minus(arx),
                0.0,
            );
        }
    }
    Ok(vec![part])
}
