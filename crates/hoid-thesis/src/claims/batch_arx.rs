//! Claims on batch fits of ARX(2, 2) models: bias by remnant order, delay and noise level.

use super::{
    claim::{Claim, Source, Theme},
    evidence::{Evidence, Study},
    rules::{ACCEPTABLE_BIAS, CLOSE_BIAS, LARGE_BIAS, MIN_LINEAR_R2, Part, RELEVANT_DIFFERENCE},
    settings::{
        DELAYS, DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, NMS_PARAMETERS, NOISE_LEVELS, REMNANT_ORDERS, Setting,
        TRUE_DELAY, bias_of, settings,
    },
    statistics::{linearity, median_bias, median_or_nan, share_value},
    value::Value,
};

const PLANS: &[&str] = &["bias"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "arx-large-at-m1",
        theme: Theme::BatchArx,
        statement: "\"A large relative bias is obtained for m0 = 1\" by ARX.",
        reference: "V.A.1, Fig. 5; 6.1.1, Fig. C.1",
        measure: "Magnitude of the median bias of a1, a2, b0 and b1 at each noise level, C1, n_k* = 29.",
        plans: PLANS,
        source: Source::Data(check_large_bias_at_first_order),
    },
    Claim {
        id: "arx-b-around-50",
        theme: Theme::BatchArx,
        statement: "For m0 >= 2 the ARX \"estimation error in b0 and b1 is still around 50 % in most cases\".",
        reference: "V.A.1, Fig. 5",
        measure: "Magnitude of the median bias of b0 and b1 for m0 = 2 to 4 at each noise level, C1, n_k* = 29; the bias of b0 at P_n = 0.1 is also shown with its sign.",
        plans: PLANS,
        source: Source::Data(check_b_bias_around_fifty),
    },
    Claim {
        id: "arx-a-acceptable",
        theme: Theme::BatchArx,
        statement: "For m0 >= 2 \"ARX bias is diminished to acceptable values\", except for b0 and b1.",
        reference: "V.A.1, Fig. 5; 6.1.1, Fig. C.1",
        measure: "Magnitude of the median bias of a1 and a2 for m0 = 2 to 4 at each noise level, C1, n_k* = 29.",
        plans: PLANS,
        source: Source::Data(check_acceptable_a_bias),
    },
    Claim {
        id: "arx-linear-in-delay",
        theme: Theme::BatchArx,
        statement: "\"Changes in model time delay (x-axis) produce a linear trend in computed relative bias\" of ARX.",
        reference: "V.A.1, Fig. 5; 6.1.1, Fig. C.1",
        measure: "R^2 of a straight line fitted to the median biases at n_k* = 25 to 30, by coefficient, m0 and noise level, C1.",
        plans: PLANS,
        source: Source::Data(check_bias_linear_in_delay),
    },
    Claim {
        id: "arx-no-optimum-at-29",
        theme: Theme::BatchArx,
        statement: "ARX biases \"do not oscillate around zero and no optimal results are found for actual HO time delay\".",
        reference: "6.1.1, Fig. C.1",
        measure: "Magnitude of the median bias at n_k* = 29 minus the smallest magnitude at any other delay, percentage points, by coefficient, C1.",
        plans: PLANS,
        source: Source::Data(check_no_optimal_delay),
    },
    Claim {
        id: "arx-lead-and-lag",
        theme: Theme::BatchArx,
        statement: "\"ARX estimators provide poles at lower frequencies when smaller n_k* are chosen, and vice versa.\"",
        reference: "V.A.1; 6.1.1, Figs. D.1 to D.4",
        measure: "Median paired change in omega_nm from n_k* = 29 to each other delay, % of the true value, m0 = 2 to 4, C1.",
        plans: PLANS,
        source: Source::Data(check_poles_follow_delay),
    },
    Claim {
        id: "arx-more-noise-more-bias",
        theme: Theme::BatchArx,
        statement: "\"Increments in noise level give as a result a greater bias in general\" of ARX.",
        reference: "V.A.1, Fig. 5; 6.1.1, Fig. C.1",
        measure: "Increase in the magnitude of the median bias from P_n = 0.1 to 0.2 and from 0.2 to 0.3, percentage \
                  points, by coefficient, C1, n_k* = 29.",
        plans: PLANS,
        source: Source::Data(check_bias_grows_with_noise),
    },
    Claim {
        id: "arx-null-without-remnant",
        theme: Theme::BatchArx,
        statement: "\"A null bias can be obtained in a remnant-free scenario if the ideal time delay is employed\" (ARX).",
        reference: "V.A.1; 6.1.1, Figs. C.1, C.9",
        measure: "Magnitude of the bias of the coefficients at P_n = 0, n_k* = 29, C1 and C2.",
        plans: PLANS,
        source: Source::Data(check_null_bias_without_remnant),
    },
    Claim {
        id: "arx-only-gain-ideal",
        theme: Theme::BatchArx,
        statement: "At the true delay \"Only the HO gain K_e results in Figure C.2 achieve the ideal performance\" (ARX).",
        reference: "6.1.1, Fig. C.2",
        measure: "Magnitude of the median bias of K_e, and of T_L, omega_nm and zeta_nm, m0 = 2 to 4, C1, n_k* = 29.",
        plans: PLANS,
        source: Source::Data(check_only_gain_is_unbiased),
    },
    Claim {
        id: "arx-c2-against-c1",
        theme: Theme::BatchArx,
        statement: "In C2 \"K_e and T_L present a greater bias when compared to the results for C1, while estimations of omega_nm and zeta_nm are slightly improved\" (ARX).",
        reference: "6.1.1, Figs. C.2, C.10",
        measure: "Magnitude of the median bias in C2 minus that in C1, percentage points, m0 = 2 to 4, n_k* = 29.",
        plans: PLANS,
        source: Source::Data(check_bias_in_second_condition),
    },
    Claim {
        id: "arx-poles-by-order",
        theme: Theme::BatchArx,
        statement: "\"For higher remnant orders in simulation data, the location of poles moves\" to lower frequencies (ARX).",
        reference: "V.A.2, Fig. 10; 6.1.1, Figs. D.1 to D.4",
        measure: "Median bias of omega_nm at m0 = 3 minus that at m0 = 2, and at m0 = 4 minus that at m0 = 3, percentage points, C1 and C2, n_k* = 29.",
        plans: PLANS,
        source: Source::Data(check_poles_by_order),
    },
    Claim {
        id: "arx-zero-by-noise",
        theme: Theme::BatchArx,
        statement: "\"The zero is located at lower frequencies for higher noise levels in ARX results.\"",
        reference: "V.A.2, Fig. 10",
        measure: "Increase in the median T_L (the zero is at 1 / T_L) from one noise level to the next, % of the true value, m0 = 2 to 4, C1.",
        plans: PLANS,
        source: Source::Data(check_zero_by_noise),
    },
    Claim {
        id: "arx-misses-poles-at-m1",
        theme: Theme::BatchArx,
        statement: "\"The correct location of poles is completely missed when a first-order remnant filter is simulated\" (ARX).",
        reference: "6.1.1, Figs. D.1, 10",
        measure: "Share of fits whose poles do not convert to omega_nm and zeta_nm, or whose omega_nm is wrong by more than 25 %, m0 = 1, C1 and C2.",
        plans: PLANS,
        source: Source::Data(check_poles_missed),
    },
];

/// Adds a cell for each setting and parameter: the magnitude of the median bias is claimed to be above or below a
/// limit.
fn add_bias_cells(
    study: Study<'_>,
    cells: &[Setting],
    names: &[&str],
    part: &mut Part,
    limit: f64,
    above: bool,
) -> Result<(), String> {
    for at in cells {
        for name in names {
            let found = study.median(&at.arx(&bias_of(name), TRUE_DELAY))?.abs();
            match above {
                true => part.add_above(at.label(name), found, limit),
                false => part.add_below(at.label(name), found, limit),
            }
        }
    }
    Ok(())
}

fn check_large_bias_at_first_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|median bias| above 25 %");
    add_bias_cells(
        study,
        &settings(&["C1"], &[1], &NOISE_LEVELS),
        &DISCRETE_PARAMETERS,
        &mut part,
        LARGE_BIAS,
        true,
    )?;
    for name in DISCRETE_PARAMETERS {
        let at = Setting {
            condition: "C1",
            m0: 1,
            level: 0.1,
        };
        part.add_shown(
            format!("median bias of {name} at P_n = 0.1, %"),
            study.median(&at.arx(&bias_of(name), TRUE_DELAY))?,
        );
    }
    Ok(vec![part])
}

fn check_b_bias_around_fifty(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|median bias| from 25 to 75 %");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in ["b0", "b1"] {
            let found = study.median(&at.arx(&bias_of(name), TRUE_DELAY))?;
            part.add_around(at.label(name), found.abs(), 50.0);
            if name == "b0" && at.level == 0.1 {
                part.add_shown(format!("median bias of b0 at m0 = {}, P_n = 0.1, %", at.m0), found);
            }
        }
    }
    Ok(vec![part])
}

fn check_acceptable_a_bias(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let mut part = Part::new("|median bias| within 10 %");
    add_bias_cells(
        evidence.study("bias")?,
        &settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS),
        &["a1", "a2"],
        &mut part,
        ACCEPTABLE_BIAS,
        false,
    )?;
    Ok(vec![part])
}

fn check_bias_linear_in_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut parts = Vec::new();
    for (orders, label) in [(&REMNANT_ORDERS[..1], "m0 = 1"), (&REMNANT_ORDERS[1..], "m0 >= 2")] {
        let mut part = Part::new(&format!("R^2 of a straight line over n_k*, at least 0.9, {label}"));
        for at in settings(&["C1"], orders, &NOISE_LEVELS) {
            for name in DISCRETE_PARAMETERS {
                let queries = DELAYS.map(|nk| at.arx(&bias_of(name), nk));
                let found = study.evaluate(&queries, &|s| {
                    linearity(&s.iter().map(|v| median_or_nan(v)).collect::<Vec<_>>())
                })?;
                part.add_above(at.label(name), found, MIN_LINEAR_R2);
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_no_optimal_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("|median bias| at n_k* = 29 minus the smallest at another delay, above 0");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let queries = DELAYS.map(|nk| at.arx(&bias_of(name), nk));
            let found = study.evaluate(&queries, &|s| {
                let others = s.iter().enumerate().filter(|(i, _)| DELAYS[*i] != TRUE_DELAY);
                let best = others.map(|(_, v)| median_bias(v)).fold(f64::INFINITY, f64::min);
                DELAYS
                    .iter()
                    .position(|nk| *nk == TRUE_DELAY)
                    .map_or(f64::NAN, |i| median_bias(&s[i]))
                    - best
            })?;
            part.add_above(at.label(name), found, 0.0);
        }
    }
    Ok(vec![part])
}

fn check_poles_follow_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut lower = Part::new("omega_nm at n_k* < 29 lower than at n_k* = 29");
    let mut higher = Part::new("omega_nm at n_k* = 30 higher than at n_k* = 29");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        let omega = |nk| at.arx("bias_omega_nm", nk);
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

fn check_bias_grows_with_noise(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("increase in |median bias|, above 0");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS[..2]) {
        let more = Setting {
            level: if at.level < 0.15 { 0.2 } else { 0.3 },
            ..at
        };
        for name in DISCRETE_PARAMETERS {
            let [less, more] = [at, more].map(|at| study.median(&at.arx(&bias_of(name), TRUE_DELAY)));
            part.add_above(at.label(name), more?.abs().minus(less?.abs()), 0.0);
        }
    }
    Ok(vec![part])
}

fn check_null_bias_without_remnant(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let mut part = Part::new("|bias| within 0.001 %");
    add_bias_cells(
        evidence.study("bias")?,
        &settings(&["C1", "C2"], &[1], &[0.0]),
        &DISCRETE_PARAMETERS,
        &mut part,
        1e-3,
        false,
    )?;
    Ok(vec![part])
}

fn check_only_gain_is_unbiased(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let cells = settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS);
    let mut gain = Part::new("|median bias| of K_e within 5 %");
    add_bias_cells(study, &cells, &["K_e"], &mut gain, CLOSE_BIAS, false)?;
    let mut others = Part::new("|median bias| of T_L, omega_nm, zeta_nm above 5 %");
    add_bias_cells(
        study,
        &cells,
        &["T_L", "omega_nm", "zeta_nm"],
        &mut others,
        CLOSE_BIAS,
        true,
    )?;
    Ok(vec![gain, others])
}

/// Compares a bias measure in C2 with the same measure in C1: the bias of K_e and T_L is claimed to be larger in C2,
/// the bias of the neuromuscular parameters smaller.
pub(super) fn compare_conditions(
    size: &dyn Fn(Setting, &str) -> Result<Value, String>,
    orders: &[usize],
) -> Result<Vec<Part>, String> {
    let mut worse = Part::new("K_e and T_L: |bias| in C2 minus that in C1, above 0");
    let mut better = Part::new("omega_nm and zeta_nm: |bias| in C2 minus that in C1, below 0");
    for at in settings(&["C1"], orders, &NOISE_LEVELS) {
        let change = |name: &str| {
            let [first, second] = ["C1", "C2"].map(|condition| size(Setting { condition, ..at }, &bias_of(name)));
            Ok::<_, String>(second?.minus(first?))
        };
        for name in ["K_e", "T_L"] {
            worse.add_above(at.label(name), change(name)?, 0.0);
        }
        for name in NMS_PARAMETERS {
            better.add_below(at.label(name), change(name)?, 0.0);
        }
    }
    Ok(vec![worse, better])
}

fn check_bias_in_second_condition(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    compare_conditions(
        &|at, quantity| Ok(study.median(&at.arx(quantity, TRUE_DELAY))?.abs()),
        &HIGHER_REMNANT_ORDERS,
    )
}

fn check_poles_by_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("change in the median bias of omega_nm from each m0 to the next, below 0");
    for at in settings(&["C1", "C2"], &HIGHER_REMNANT_ORDERS[1..], &NOISE_LEVELS) {
        let [lower, higher] =
            [at.m0 - 1, at.m0].map(|m0| study.median(&Setting { m0, ..at }.arx("bias_omega_nm", TRUE_DELAY)));
        part.add_below(at.label(""), higher?.minus(lower?), 0.0);
    }
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &[0.1]) {
        part.add_shown(
            format!("median bias of omega_nm at m0 = {}, P_n = 0.1, C1, %", at.m0),
            study.median(&at.arx("bias_omega_nm", TRUE_DELAY))?,
        );
    }
    Ok(vec![part])
}

fn check_zero_by_noise(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("increase in the median T_L from each noise level to the next, above 0.1 %");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS[..2]) {
        let more = Setting {
            level: if at.level < 0.15 { 0.2 } else { 0.3 },
            ..at
        };
        let [less, more] = [at, more].map(|at| study.median(&at.arx("bias_T_L", TRUE_DELAY)));
        part.add_above(at.label(""), more?.minus(less?), RELEVANT_DIFFERENCE);
    }
    Ok(vec![part])
}

fn check_poles_missed(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut part = Part::new("share of fits that miss the poles, above 0.9");
    for at in settings(&["C1", "C2"], &[1], &NOISE_LEVELS) {
        let omega = study.sample(&at.arx("bias_omega_nm", TRUE_DELAY))?;
        let missed: Vec<f64> = omega
            .iter()
            .map(|bias| f64::from(u8::from(bias.is_nan() || bias.abs() > LARGE_BIAS)))
            .collect();
        part.add_above(at.label(""), share_value(&missed), 0.9);
    }
    Ok(vec![part])
}
