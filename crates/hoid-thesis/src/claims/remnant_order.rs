//! Claims on the order m* of the noise model of Box-Jenkins models.

use super::{
    claim::{Claim, Source, Theme},
    evidence::Evidence,
    rules::{CLOSE_BIAS, LARGE_BIAS, Part, RELEVANT_DIFFERENCE},
    settings::{
        DELAYS, DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, NMS_PARAMETERS, NOISE_LEVELS, REMNANT_ORDERS, Setting,
        TRUE_DELAY, bias_of, settings,
    },
    statistics::{interquartile_range, mean_of, median_bias, median_magnitude, median_or_nan, spread},
    value::Value,
};

const PLANS: &[&str] = &["bias"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "vaf-same-for-all-m",
        theme: Theme::RemnantOrder,
        statement: "\"The BJ estimator presents a homogeneous average VAF value for all model remnant orders\" (m0 = 3).",
        reference: "V.A.2, Fig. 7; 6.1.3, Fig. E.5",
        measure: "Spread of the mean VAF over m* = 1 to 4 in C1, m0 = 3, by n_k* = 25 to 30 and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_vaf_homogeneous),
    },
    Claim {
        id: "vaf-lower-with-m4-at-m1",
        theme: Theme::RemnantOrder,
        statement: "At m0 = 1 \"a model remnant order equal to 4 (the simulation one is 1 for this case) provides lower VAF results\".",
        reference: "V.A.2; 6.1.3, Figs. E.1, E.9",
        measure: "Mean paired difference in VAF, m* = 4 minus m* = 1, at m0 = 1 in C1 and C2, for each n_k* and noise level: below -0.1 points.",
        plans: PLANS,
        source: Source::Data(check_vaf_lower_at_fourth_order),
    },
    Claim {
        id: "vaf-bj-as-arx",
        theme: Theme::RemnantOrder,
        statement: "VAF: \"No significant differences are found between BJ and ARX for cases with a time delay close to n_k* = 29\".",
        reference: "V.A.2, Fig. 8",
        measure: "Magnitude of the mean paired difference in VAF, BJ minus ARX, C1, m0 = 3, n_k* = 28 to 30, m* = 1 to 4.",
        plans: PLANS,
        source: Source::Data(check_vaf_of_arx),
    },
    Claim {
        id: "vaf-does-not-find-delay",
        theme: Theme::RemnantOrder,
        statement: "There are \"limitations in the VAF metric to find the actual n_k\".",
        reference: "Conclusions of Part II; 6.1.3",
        measure: "Share of records in which the VAF of BJ(m* = 1) over n_k* = 25 to 30 is largest at 29, C1 and C2, by m0 and noise level: below 0.9.",
        plans: PLANS,
        source: Source::Data(check_vaf_and_delay),
    },
    Claim {
        id: "m1-same-bias",
        theme: Theme::RemnantOrder,
        statement: "\"The use of a fixed model remnant order m* = 1 does not change the bias obtained by BJ.\"",
        reference: "V.A.2, Fig. 9; VIII; 6.1.3, Figs. C.6, C.14",
        measure: "Median paired difference in bias, m* = 1 minus m* = m0, m0 = 2 to 4, C1 and C2, n_k* = 29, percentage points.",
        plans: PLANS,
        source: Source::Data(check_same_bias),
    },
    Claim {
        id: "m1-better-at-m4",
        theme: Theme::RemnantOrder,
        statement: "With m* = 1 \"the bias in m0 = 4 is even slightly diminished\".",
        reference: "V.A.2, Fig. 9",
        measure: "Magnitude of the median bias of b0 and b1, m* = 1 minus m* = 4, m0 = 4, C1, n_k* = 29, by noise level: below -0.1 percentage points.",
        plans: PLANS,
        source: Source::Data(check_better_at_fourth_order),
    },
    Claim {
        id: "m1-small-loss-at-high-orders",
        theme: Theme::RemnantOrder,
        statement: "m* = 1 \"could imply a small decrease in accuracy estimation for high simulation remnant orders\".",
        reference: "6.1.3",
        measure: "Median paired difference in response_error, m* = 1 minus m* = m0, averaged over the noise levels, m0 = 3 and 4, C1 and C2, n_k* = 29: at least 0.1 percentage points.",
        plans: PLANS,
        source: Source::Data(check_loss_at_high_orders),
    },
    Claim {
        id: "m1-wider-boxes",
        theme: Theme::RemnantOrder,
        statement: "With m* = 1 \"the interquartile range may increase slightly\".",
        reference: "6.1.3, Figs. C.6, C.14",
        measure: "Interquartile range of the bias with m* = 1 divided by that with m* = m0, averaged over the noise levels, m0 = 2 to 4, C1 and C2, n_k* = 29: from 1 to 1.5.",
        plans: PLANS,
        source: Source::Data(check_wider_boxes),
    },
    Claim {
        id: "m1-gain-and-zero-by-delay",
        theme: Theme::RemnantOrder,
        statement: "With m* = 1 the NMS values are very similar, but the \"bias in K_e and T_L become noticeably higher when the model time delay differs from the simulation one\".",
        reference: "6.1.3, Figs. C.7, C.15",
        measure: "Median |bias| with m* = 1 minus that with m* = m0 at n_k* = 25 to 28 and 30, m0 = 2 to 4, C1: above 0 for K_e and T_L; within 5 points for the NMS parameters.",
        plans: PLANS,
        source: Source::Data(check_bias_by_delay),
    },
    Claim {
        id: "m1-remnant-wrong",
        theme: Theme::RemnantOrder,
        statement: "\"The remnant parameters are obviously wrongly estimated for the m* = 1 case.\"",
        reference: "6.1.3, Figs. C.8, C.16",
        measure: "Magnitude of the median bias of T_n and K_n with m* = 1, m0 = 2 to 4, C1, n_k* = 29, backward Euler.",
        plans: PLANS,
        source: Source::Data(check_wrong_remnant_parameters),
    },
    Claim {
        id: "delay-over-order",
        theme: Theme::RemnantOrder,
        statement: "\"The time delay is a more determinant factor than the remnant order in terms of relative bias reduction.\"",
        reference: "6.1.3, Figs. E.2, E.4, E.6, E.8",
        measure: "Spread of the median |bias| over n_k* (m* = m0) minus that over m* (n_k* = 29), C1, by coefficient, m0 and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_delay_more_important_than_order),
    },
    Claim {
        id: "match-matters-at-m1",
        theme: Theme::RemnantOrder,
        statement: "Only at m0 = 1 a \"model remnant order that matches the simulation one reduces the bias significantly\".",
        reference: "6.1.3, Fig. E.2",
        measure: "Median |bias| with m* = m0 divided by the mean for the other orders, n_k* = 29, C1, by coefficient and noise level: below 1/2 at m0 = 1, above 1/2 at m0 = 2 to 4.",
        plans: PLANS,
        source: Source::Data(check_order_match),
    },
    Claim {
        id: "order-over-delay-for-remnant",
        theme: Theme::RemnantOrder,
        statement: "Innovation variance and d1: \"the time delay becomes irrelevant in terms of bias reduction, while the remnant order is fundamental\".",
        reference: "6.1.3, Figs. E.2, E.4, E.6, E.8",
        measure: "Spread of the medians over m* (n_k* = 29) divided by that over n_k* (m* = m0), C1, by m0 and noise level: above 1.",
        plans: PLANS,
        source: Source::Data(check_order_more_important_than_delay),
    },
];

fn check_vaf_homogeneous(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut parts = Vec::new();
    for delays in [&DELAYS[..3], &DELAYS[3..]] {
        let mut part = Part::new(&format!(
            "spread of the mean VAF over m* within 1 point, n_k* = {} to {}",
            delays[0], delays[2]
        ));
        for at in settings(&["C1"], &[3], &NOISE_LEVELS) {
            for nk in delays {
                let queries = REMNANT_ORDERS.map(|m| at.bj("vaf", m, *nk));
                part.add_below(
                    at.label(&format!("n_k* = {nk}")),
                    study.evaluate(&queries, &|s| spread(s.iter().map(|v| mean(v))))?,
                    1.0,
                );
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_vaf_and_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("share of records with the largest VAF at n_k* = 29, below 0.9");
    for at in settings(&["C1", "C2"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        let queries = DELAYS.map(|nk| at.bj("vaf", 1, nk));
        let found = study.evaluate(&queries, &|s| {
            let best = |i: usize| {
                DELAYS
                    .iter()
                    .zip(s)
                    .max_by(|a, b| a.1[i].total_cmp(&b.1[i]))
                    .map(|(nk, _)| *nk)
            };
            let hits = (0..s[0].len()).filter(|i| best(*i) == Some(TRUE_DELAY)).count();
            hits as f64 / s[0].len() as f64
        })?;
        part.add_below(at.label(""), found, 0.9);
    }
    Ok(vec![part])
}

fn mean(values: &[f64]) -> f64 {
    mean_of(values).value
}

fn check_vaf_lower_at_fourth_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("VAF of m* = 4 minus that of m* = 1, below -0.1 points");
    for at in settings(&["C1", "C2"], &[1], &NOISE_LEVELS) {
        for nk in DELAYS {
            let queries = [at.bj("vaf", 4, nk), at.bj("vaf", 1, nk)];
            let found = study.evaluate(&queries, &|s| mean(&s[0]) - mean(&s[1]))?;
            part.add_below(at.label(&format!("n_k* = {nk}")), found, -RELEVANT_DIFFERENCE);
        }
    }
    Ok(vec![part])
}

fn check_vaf_of_arx(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|VAF of BJ minus that of ARX| within 1 point");
    for at in settings(&["C1"], &[3], &NOISE_LEVELS) {
        for nk in 28..=30 {
            for m in REMNANT_ORDERS {
                let queries = [at.bj("vaf", m, nk), at.arx("vaf", nk)];
                let found = study.evaluate(&queries, &|s| mean(&s[0]) - mean(&s[1]))?;
                part.add_below(at.label(&format!("n_k* = {nk}, m* = {m}")), found.abs(), 1.0);
            }
        }
    }
    Ok(vec![part])
}

fn check_same_bias(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|paired difference in bias, m* = 1 minus m* = m0| within 5 points");
    for at in settings(&["C1", "C2"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let fit = |m| at.bj(&bias_of(name), m, TRUE_DELAY);
            part.add_below(
                at.label(name),
                study.difference(&fit(1), &fit(at.m0))?.abs(),
                CLOSE_BIAS,
            );
        }
    }
    Ok(vec![part])
}

fn check_better_at_fourth_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|median bias| with m* = 1 minus that with m* = 4, below -0.1 points");
    for at in settings(&["C1"], &[4], &NOISE_LEVELS) {
        for name in ["b0", "b1"] {
            let queries = [1, 4].map(|m| at.bj(&bias_of(name), m, TRUE_DELAY));
            part.add_below(
                at.label(name),
                study.evaluate(&queries, &|s| median_bias(&s[0]) - median_bias(&s[1]))?,
                -RELEVANT_DIFFERENCE,
            );
        }
    }
    Ok(vec![part])
}

fn check_loss_at_high_orders(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("response_error with m* = 1 minus that with m* = m0, averaged over P_n, above 0.1 points");
    for at in settings(&["C1", "C2"], &[3, 4], &[0.1]) {
        let mut levels = Vec::new();
        for level in NOISE_LEVELS {
            let fit = |m| Setting { level, ..at }.bj("response_error", m, TRUE_DELAY);
            levels.push(study.difference(&fit(1), &fit(at.m0))?);
        }
        part.add_above(
            format!("{}, m0 = {}", at.condition, at.m0),
            Value::mean(&levels),
            RELEVANT_DIFFERENCE,
        );
    }
    Ok(vec![part])
}

fn check_wider_boxes(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part =
        Part::new("interquartile range with m* = 1 divided by that with m* = m0, averaged over P_n, from 1 to 1.5");
    for at in settings(&["C1", "C2"], &HIGHER_REMNANT_ORDERS, &[0.1]) {
        for name in DISCRETE_PARAMETERS {
            let fits =
                NOISE_LEVELS.map(|level| [1, at.m0].map(|m| Setting { level, ..at }.bj(&bias_of(name), m, TRUE_DELAY)));
            let found = study.evaluate(&fits.concat(), &|s| {
                s.chunks(2)
                    .map(|pair| interquartile_range(&pair[0]) / interquartile_range(&pair[1]))
                    .sum::<f64>()
                    / NOISE_LEVELS.len() as f64
            })?;
            part.add_between(format!("{}, m0 = {}, {name}", at.condition, at.m0), found, 1.0, 1.5);
        }
    }
    Ok(vec![part])
}

fn check_bias_by_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut higher = Part::new("K_e and T_L: increase in the median |bias| with m* = 1, above 0");
    let mut same = Part::new("omega_nm and zeta_nm: |change in the median |bias| with m* = 1| within 5 points");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        for nk in DELAYS.into_iter().filter(|nk| *nk != TRUE_DELAY) {
            let change = |name: &str| {
                let queries = [1, at.m0].map(|m| at.bj(&bias_of(name), m, nk));
                study.evaluate(&queries, &|s| median_magnitude(&s[0]) - median_magnitude(&s[1]))
            };
            for name in ["K_e", "T_L"] {
                higher.add_above(at.label(&format!("n_k* = {nk}, {name}")), change(name)?, 0.0);
            }
            for name in NMS_PARAMETERS {
                same.add_below(
                    at.label(&format!("n_k* = {nk}, {name}")),
                    change(name)?.abs(),
                    CLOSE_BIAS,
                );
            }
        }
    }
    Ok(vec![higher, same])
}

fn check_wrong_remnant_parameters(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut parts = Vec::new();
    for name in ["T_n", "K_n"] {
        let mut part = Part::new(&format!("|median bias| of {name} above 25 %"));
        for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
            let found = study.median(&at.bj(&format!("bias_{name}_backward_euler"), 1, TRUE_DELAY))?;
            part.add_above(at.label(""), found.abs(), LARGE_BIAS);
        }
        parts.push(part);
    }
    Ok(parts)
}

/// Queries for a quantity: for all delays with m* = m0, followed by those for all orders at the true delay.
fn delay_and_order_queries(at: Setting, quantity: &str) -> Vec<hoid_study::Query> {
    let delays = DELAYS.map(|nk| at.bj(quantity, at.m0, nk));
    delays
        .into_iter()
        .chain(REMNANT_ORDERS.map(|m| at.bj(quantity, m, TRUE_DELAY)))
        .collect()
}

fn check_delay_more_important_than_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("spread over n_k* minus that over m*, above 0");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let found = study.evaluate(&delay_and_order_queries(at, &bias_of(name)), &|s| {
                let (delays, orders) = s.split_at(DELAYS.len());
                spread(delays.iter().map(|v| median_magnitude(v))) - spread(orders.iter().map(|v| median_magnitude(v)))
            })?;
            part.add_above(at.label(name), found, 0.0);
        }
    }
    Ok(vec![part])
}

fn check_order_match(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut first = Part::new("m0 = 1: median |bias| with m* = 1 divided by that of the others, below 1/2");
    let mut others = Part::new("m0 >= 2: median |bias| with m* = m0 divided by that of the others, above 1/2");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let queries = REMNANT_ORDERS.map(|m| at.bj(&bias_of(name), m, TRUE_DELAY));
            let found = study.evaluate(&queries, &|s| {
                let rest = s
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| i + 1 != at.m0)
                    .map(|(_, v)| median_magnitude(v));
                3.0 * median_magnitude(&s[at.m0 - 1]) / rest.sum::<f64>()
            })?;
            match at.m0 {
                1 => first.add_below(at.label(name), found, 0.5),
                _ => others.add_above(at.label(name), found, 0.5),
            }
        }
    }
    Ok(vec![first, others])
}

fn check_order_more_important_than_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut parts = Vec::new();
    for name in ["innovation_variance", "d1"] {
        let mut part = Part::new(&format!("{name}: spread over m* divided by that over n_k*, above 1"));
        for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
            let found = study.evaluate(&delay_and_order_queries(at, name), &|s| {
                let (delays, orders) = s.split_at(DELAYS.len());
                spread(orders.iter().map(|v| median_or_nan(v))) / spread(delays.iter().map(|v| median_or_nan(v)))
            })?;
            part.add_above(at.label(""), found, 1.0);
        }
        parts.push(part);
    }
    Ok(parts)
}
