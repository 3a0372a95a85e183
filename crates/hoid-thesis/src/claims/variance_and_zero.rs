//! Claims on batch fits that do not concern the bias of the coefficients: the innovation variance by order of the
//! remnant and in C2, b at a wrong delay, and the zero in C2.
//!
//! The *modified remnant noise variance* of the thesis is the variance of the innovation that drives 1/D. The reference
//! value is the variance of the backward Euler form (eq. B.12), `sigma'^2 = (K_n (Ts/(Tn + Ts))^m)^2`. In the
//! simulations of the thesis and in those of hoid, the remnant is held exactly over a sample. The innovations of an
//! exact model therefore have a different variance, which is also shown.

use super::{
    claim::{Claim, Source, Theme},
    evidence::{Evidence, Study},
    rules::{LARGE_BIAS, MUCH_HIGHER_RATIO, Part},
    settings::{HIGHER_REMNANT_ORDERS, NOISE_LEVELS, REMNANT_ORDERS, Setting, TRUE_DELAY, bias_of, settings},
    statistics::{interquartile_range, median_magnitude, median_or_nan},
    value::Value,
};

const PLANS: &[&str] = &["bias"];
/// Delays far from the simulated delay, samples.
const FAR_DELAYS: [usize; 2] = [25, 26];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "bj-variance-by-order",
        theme: Theme::BatchBj,
        statement: "\"The modified remnant noise variance\" presents an \"important deviation with respect to the reference value as well, which increases for higher remnant orders\".",
        reference: "6.1.2, Fig. C.5",
        measure: "Magnitude of the median bias of the innovation variance relative to eq. B.12, BJ(m* = m0), C1, n_k* = 29: at m0 = 2 to 4, and its increase from each order to the next, m0 = 1 to 4.",
        plans: PLANS,
        source: Source::Data(check_variance_by_order),
    },
    Claim {
        id: "bj-remnant-in-c2",
        theme: Theme::BatchBj,
        statement: "C2: \"the results in the modified noise variance (and the remnant gain in consequence) have improved, although the variability of the obtained biases is much higher\".",
        reference: "6.1.2, Fig. C.13",
        measure: "Innovation variance (relative to eq. B.12) and K_n (backward Euler), BJ(m* = m0), n_k* = 29, by m0 and noise level: |median bias| in C2 minus that in C1; interquartile range in C2 divided by that in C1, at least 1.5.",
        plans: PLANS,
        source: Source::Data(check_remnant_in_second_condition),
    },
    Claim {
        id: "bj-b-at-wrong-delay",
        theme: Theme::BatchBj,
        statement: "BJ biases can be \"considerable for b0 and b1 in scenarios with model time delays far from the reference one, but those ones are a bit smaller than in the ARX case\".",
        reference: "6.1.2, Fig. C.3",
        measure: "Magnitude of the median bias of b0 and b1, BJ(m* = m0), C1, n_k* = 25 and 26, by m0 and noise level; the same minus the magnitude for ARX, m0 = 1 to 4.",
        plans: PLANS,
        source: Source::Data(check_wrong_delay),
    },
    Claim {
        id: "zero-in-c2",
        theme: Theme::BatchBj,
        statement: "C2, BJ: \"Similar to the ARX case, the placement of the zero is estimated less accurately than for simulation condition C1\".",
        reference: "6.1.1, 6.1.2, Figs. D.10 to D.17",
        measure: "Median magnitude of the relative error of the zero 1/T_L in C2 minus that in C1, percentage points, n_k* = 29, by noise level: BJ(m* = m0), m0 = 1 to 4, and ARX, m0 = 2 to 4.",
        plans: PLANS,
        source: Source::Data(check_zero_in_second_condition),
    },
    Claim {
        id: "zero-matters-in-c2",
        theme: Theme::BatchBj,
        statement: "Bode plots: \"the effect of correct zeros estimation is especially noticeable for condition C2\".",
        reference: "Conclusions of Part II, Figs. D.9, D.18",
        measure: "Median magnitude of the relative error of the zero 1/T_L, ARX minus BJ(m* = m0), in C2 minus the same difference in C1, percentage points, n_k* = 29, m0 = 2 to 4, by noise level.",
        plans: PLANS,
        source: Source::Data(check_importance_of_zero),
    },
];

/// The reference value of the innovation variance (eq. B.12).
fn backward_euler_variance(study: Study<'_>, at: Setting) -> Result<f64, String> {
    // These values are valid for all scenarios of the plan.
    const TS_S: f64 = 0.01;
    const T_N_S: f64 = 0.06;
    let k_n = study.truth(&at.bj("loss", at.m0, TRUE_DELAY))?.k_n;
    let m = i32::try_from(at.m0).map_err(|_| format!("m0 = {} is not a valid order of the remnant", at.m0))?;
    Ok((k_n * (TS_S / (T_N_S + TS_S)).powi(m)).powi(2))
}

/// Returns a statistic of the relative biases of the innovation variance, %.
fn variance_bias(study: Study<'_>, at: Setting, figure: fn(&[f64]) -> f64) -> Result<Value, String> {
    let query = at.bj("innovation_variance", at.m0, TRUE_DELAY);
    study.sample(&query)?;
    let reference = backward_euler_variance(study, at)?;
    study.evaluate(&[query], &|s| {
        let biases: Vec<f64> = s[0].iter().map(|v| 100.0 * (v / reference - 1.0)).collect();
        figure(&biases)
    })
}

fn check_variance_by_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut important = Part::new("|median bias| of the innovation variance above 25 %, m0 >= 2");
    let mut growth = Part::new("|median bias| of the innovation variance minus that at the next lower m0, above 0");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        let found = variance_bias(study, at, median_or_nan)?;
        let below = variance_bias(study, Setting { m0: at.m0 - 1, ..at }, median_or_nan)?;
        important.add_above(at.label(""), found.abs(), LARGE_BIAS);
        growth.add_above(at.label(""), found.abs().minus(below.abs()), 0.0);
    }
    for at in settings(&["C1"], &REMNANT_ORDERS, &[0.1]) {
        important.add_shown(
            format!("median bias at {}, relative to eq. B.12, %", at.label("")),
            variance_bias(study, at, median_or_nan)?,
        );
        let exact = study.median(&at.bj(&bias_of("innovation_variance"), at.m0, TRUE_DELAY))?;
        important.add_shown(
            format!(
                "median bias at {}, relative to the exactly held remnant, %",
                at.label("")
            ),
            exact,
        );
    }
    Ok(vec![important, growth])
}

fn check_remnant_in_second_condition(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let gain = |at: Setting, figure: fn(&[f64]) -> f64| {
        let query = at.bj("bias_K_n_backward_euler", at.m0, TRUE_DELAY);
        study.evaluate(&[query], &|s| figure(&s[0]))
    };
    let of_variance = |at: Setting, figure: fn(&[f64]) -> f64| variance_bias(study, at, figure);
    type BiasStatistic<'f> = &'f dyn Fn(Setting, fn(&[f64]) -> f64) -> Result<Value, String>;
    let measured: [(&str, BiasStatistic<'_>); 2] = [("innovation variance", &of_variance), ("K_n", &gain)];
    let mut parts = Vec::new();
    for (name, of) in measured {
        let mut better = Part::new(&format!("{name}: |median bias| in C2 minus that in C1, below 0"));
        let mut wider = Part::new(&format!(
            "{name}: interquartile range of the bias in C2 divided by that in C1, above 1.5"
        ));
        for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
            let second = Setting { condition: "C2", ..at };
            better.add_below(
                at.label(""),
                of(second, median_or_nan)?.abs().minus(of(at, median_or_nan)?.abs()),
                0.0,
            );
            let ratio = of(second, interquartile_range)?.divided_by(of(at, interquartile_range)?);
            wider.add_above(at.label(""), ratio, MUCH_HIGHER_RATIO);
        }
        parts.extend([better, wider]);
    }
    Ok(parts)
}

fn check_wrong_delay(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let mut large = Part::new("BJ: |median bias| of b0 and b1 above 25 %");
    let mut smaller = Part::new("|median bias| of b0 and b1, BJ minus ARX, below 0");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for nk in FAR_DELAYS {
            for name in ["b0", "b1"] {
                let [bj, arx] =
                    [at.bj(&bias_of(name), at.m0, nk), at.arx(&bias_of(name), nk)].map(|query| study.median(&query));
                let (bj, arx) = (bj?.abs(), arx?.abs());
                let label = at.label(&format!("n_k* = {nk}, {name}"));
                large.add_above(label.clone(), bj, LARGE_BIAS);
                smaller.add_below(label, bj.minus(arx), 0.0);
            }
        }
    }
    Ok(vec![large, smaller])
}

/// Relative errors of the zero 1/T_L (%), computed from the relative errors of T_L.
fn zero_errors(t_l_percent: &[f64]) -> Vec<f64> {
    let of = |error: &f64| 100.0 * (1.0 / (1.0 + error / 100.0) - 1.0);
    t_l_percent.iter().map(of).collect()
}

/// Median magnitude of the relative error of the zero in C2 minus the same median in C1. If `of` gives two queries, the
/// median for the second query is first subtracted from the median for the first.
fn zero_change(study: Study<'_>, of: &dyn Fn(Setting) -> Vec<hoid_study::Query>, at: Setting) -> Result<Value, String> {
    let error = |condition| {
        study.evaluate(&of(Setting { condition, ..at }), &|s| {
            let each: Vec<f64> = s.iter().map(|errors| median_magnitude(&zero_errors(errors))).collect();
            each[0] - each.get(1).unwrap_or(&0.0)
        })
    };
    Ok(error("C2")?.minus(error("C1")?))
}

fn check_zero_in_second_condition(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let bj = |at: Setting| vec![at.bj("bias_T_L", at.m0, TRUE_DELAY)];
    let arx = |at: Setting| vec![at.arx("bias_T_L", TRUE_DELAY)];
    let mut of_bj = Part::new("BJ: |error of the zero| in C2 minus that in C1, above 0");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        of_bj.add_above(at.label(""), zero_change(study, &bj, at)?, 0.0);
    }
    let mut of_arx = Part::new("ARX: |error of the zero| in C2 minus that in C1, above 0");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        of_arx.add_above(at.label(""), zero_change(study, &arx, at)?, 0.0);
    }
    Ok(vec![of_bj, of_arx])
}

fn check_importance_of_zero(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("bias")?;
    let both = |at: Setting| vec![at.arx("bias_T_L", TRUE_DELAY), at.bj("bias_T_L", at.m0, TRUE_DELAY)];
    let mut part = Part::new("|error of the zero|, ARX minus BJ, in C2 minus that in C1, above 0");
    for at in settings(&["C1"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        part.add_above(at.label(""), zero_change(study, &both, at)?, 0.0);
    }
    Ok(vec![part])
}
