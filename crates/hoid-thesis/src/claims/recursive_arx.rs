//! Claims on recursive least squares for ARX models, with a forgetting factor (V.B) and with a forgetting matrix
//! (6.2.1).

use super::{
    claim::{Claim, Source, Theme},
    evidence::Evidence,
    rules::{ACCEPTABLE_BIAS, CLOSE_BIAS, HEAVY_REDUCTION, LARGE_BIAS, Part},
    settings::{
        DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, NMS_PARAMETERS, NOISE_LEVELS, RECURSIVE_NOISE_LEVELS, Setting,
        bias_of, name_with_f, settings,
    },
    statistics::median_or_nan,
};

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "rls-large-at-m1",
        theme: Theme::Recursive,
        statement: "m0 = 1: \"ARX models lead to significant relative bias while BJ provides a much more precise estimation with almost null bias after full convergence\".",
        reference: "V.B, Fig. 11",
        measure: "Magnitude of the bias of the median trace over the last 30.72 s, C4, m0 = 1, RLS and RPEM, by coefficient and noise level.",
        plans: &["recursive"],
        source: Source::Data(check_large_bias_at_first_order),
    },
    Claim {
        id: "rls-10-times-less",
        theme: Theme::Recursive,
        statement: "\"When simulations with m0 >= 2 are conducted, the bias in ARX estimations is reduced by almost 10 times.\"",
        reference: "V.B, Fig. 12",
        measure: "Bias of the median trace over the last 30.72 s at m0 = 1 divided by that at m0 = 2 to 4, RLS, C4, for the coefficients; the same ratio of the median RMS error for omega_nm and zeta_nm.",
        plans: &["recursive"],
        source: Source::Data(check_ten_times_smaller_bias),
    },
    Claim {
        id: "rls-nms-persistent",
        theme: Theme::Recursive,
        statement: "The bias of ARX for m0 >= 2 \"is still persistent in NMS coefficients\"; \"it will always have a bias\".",
        reference: "V.B, Fig. 12; VII",
        measure: "Magnitude of the bias of the median trace of omega_nm and zeta_nm over the last 30.72 s, RLS, C4, m0 = 2 to 4.",
        plans: &["recursive"],
        source: Source::Data(check_persistent_bias),
    },
    Claim {
        id: "batch-represents-recursion",
        theme: Theme::Recursive,
        statement: "Batch-fitting results \"also represent the real functioning of RLS and RPEM algorithms in recursive estimation\".",
        reference: "V.B, Figs. 11, 12",
        measure: "Bias of the median trace over the last 30.72 s minus the median bias of the batch fit of that span, C4, percentage points, by coefficient, m0 and noise level.",
        plans: &["recursive"],
        source: Source::Data(check_agreement_with_batch),
    },
    Claim {
        id: "rls-a2-violates",
        theme: Theme::Recursive,
        statement: "m0 = 1: \"condition a2 > 0 is not fulfilled at multiple occasions\", with \"important divergences in the computation of T_L\".",
        reference: "6.2.1, Figs. G.1, G.5",
        measure: "Median share of the trace that does not convert to an operator at m0 = 1 and at m0 = 2 to 4, RLS with matrix, C3.",
        plans: &["recursive-arx"],
        source: Source::Data(check_violated_a2_condition),
    },
    Claim {
        id: "rls-gain-always-accurate",
        theme: Theme::Recursive,
        statement: "\"Nonetheless the estimation of the HO gain is always accurate\" (recursive ARX).",
        reference: "6.2.1, Figs. G.5 to G.8",
        measure: "Magnitude of the bias of the median trace of K_e over the last 30.72 s, RLS with matrix, C3, m0 = 2 to 4; at m0 = 1, where models do not convert to an operator, the bias of the static gain at the end.",
        plans: &["recursive-arx"],
        source: Source::Data(check_accurate_gain),
    },
    Claim {
        id: "rls-heavily-reduced",
        theme: Theme::Recursive,
        statement: "\"When the simulation remnant order is increased, the bias is heavily reduced\" (recursive ARX).",
        reference: "6.2.1, Figs. G.1 to G.4",
        measure: "Bias of the median trace over the last 30.72 s at m0 = 2 to 4 divided by that at m0 = 1, RLS with matrix, C3, by coefficient.",
        plans: &["recursive-arx"],
        source: Source::Data(check_bias_heavily_reduced),
    },
    Claim {
        id: "rls-more-noise-more-error",
        theme: Theme::Recursive,
        statement: "\"An increment in noise level clearly produces a bigger error in b0 and b1 parameters\" (recursive ARX).",
        reference: "6.2.1, Figs. G.1 to G.4",
        measure: "Increase in the magnitude of the bias of the median trace over the last 30.72 s from one noise level to the next, m0 = 2 to 4, C3, percentage points.",
        plans: &["recursive-arx"],
        source: Source::Data(check_bias_grows_with_noise),
    },
];

fn check_large_bias_at_first_order(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut arx = Part::new("RLS: |bias of the median trace| above 25 %");
    let mut bj = Part::new("RPEM: |bias of the median trace| within 5 %");
    for at in settings(&["C4"], &[1], &RECURSIVE_NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            arx.add_above(at.label(name), study.trace_bias(&at.rls(""), name)?.abs(), LARGE_BIAS);
            bj.add_below(
                at.label(name),
                study.trace_bias(&at.rpem(""), &name_with_f(name))?.abs(),
                CLOSE_BIAS,
            );
        }
    }
    Ok(vec![arx, bj])
}

fn check_ten_times_smaller_bias(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut discrete = Part::new("coefficients: bias at m0 = 1 divided by that at higher m0, from 5 to 15");
    let mut nms = Part::new("omega_nm and zeta_nm: RMS error at m0 = 1 divided by that at higher m0, from 5 to 15");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        let first = Setting { m0: 1, ..at };
        for name in DISCRETE_PARAMETERS {
            let [reference, found] = [first, at].map(|at| study.trace_bias(&at.rls(""), name));
            discrete.add_effect(at.label(name), reference?.abs().divided_by(found?.abs()), 10.0);
        }
        for name in NMS_PARAMETERS {
            let [reference, found] = [first, at].map(|at| study.median(&at.rls(&format!("rms_{name}"))));
            nms.add_effect(at.label(name), reference?.divided_by(found?), 10.0);
        }
    }
    Ok(vec![discrete, nms])
}

fn check_persistent_bias(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("|bias of the median trace| above 5 %");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        for name in NMS_PARAMETERS {
            part.add_above(at.label(name), study.trace_bias(&at.rls(""), name)?.abs(), CLOSE_BIAS);
        }
    }
    Ok(vec![part])
}

fn check_agreement_with_batch(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut arx = Part::new("|RLS minus OLS| within 5 points");
    let mut bj = Part::new("|RPEM minus PEM| within 5 points");
    for at in settings(&["C4"], &[1, 2, 3, 4], &RECURSIVE_NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let with_f_name = name_with_f(name);
            let ols = study.median(&at.query(&bias_of(name)).name("OLS last"))?;
            let pem = study.median(&at.query(&bias_of(&with_f_name)).name("PEM last"))?;
            arx.add_below(
                at.label(name),
                study.trace_bias(&at.rls(""), name)?.minus(ols).abs(),
                CLOSE_BIAS,
            );
            bj.add_below(
                at.label(name),
                study.trace_bias(&at.rpem(""), &with_f_name)?.minus(pem).abs(),
                CLOSE_BIAS,
            );
        }
    }
    Ok(vec![arx, bj])
}

fn check_violated_a2_condition(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive-arx")?;
    let mut first = Part::new("m0 = 1: share of the trace that does not convert, above 0.25");
    let mut others = Part::new("m0 >= 2: share of the trace that does not convert, below 0.01");
    for at in settings(&["C3"], &[1, 2, 3, 4], &NOISE_LEVELS) {
        let found = study.median(&at.rls("share_not_convertible"))?;
        match at.m0 {
            1 => first.add_above(at.label(""), found, 0.25),
            _ => others.add_below(at.label(""), found, 0.01),
        }
    }
    Ok(vec![first, others])
}

fn check_accurate_gain(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive-arx")?;
    let mut first = Part::new("m0 = 1: |median bias of (b0 + b1) / (1 + a1 + a2) at the end| within 10 %");
    let mut others = Part::new("m0 >= 2: |bias of the median trace of K_e| within 10 %");
    for at in settings(&["C3"], &[1], &NOISE_LEVELS) {
        let queries = DISCRETE_PARAMETERS.map(|name| at.rls(name));
        let k_e = study.truth(&queries[0])?.operator[0];
        let found = study.evaluate(&queries, &|s| {
            let gains: Vec<f64> = (0..s[0].len())
                .map(|i| (s[2][i] + s[3][i]) / (1.0 + s[0][i] + s[1][i]))
                .collect();
            100.0 * (median_or_nan(&gains) - k_e) / k_e
        })?;
        first.add_below(at.label(""), found.abs(), ACCEPTABLE_BIAS);
    }
    for at in settings(&["C3"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        others.add_below(
            at.label(""),
            study.trace_bias(&at.rls(""), "K_e")?.abs(),
            ACCEPTABLE_BIAS,
        );
    }
    Ok(vec![first, others])
}

fn check_bias_heavily_reduced(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive-arx")?;
    let mut part = Part::new("|bias| at higher m0 divided by that at m0 = 1, below 0.25");
    for at in settings(&["C3"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let [reference, found] = [Setting { m0: 1, ..at }, at].map(|at| study.trace_bias(&at.rls(""), name));
            part.add_below(
                at.label(name),
                found?.abs().divided_by(reference?.abs()),
                HEAVY_REDUCTION,
            );
        }
    }
    Ok(vec![part])
}

fn check_bias_grows_with_noise(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive-arx")?;
    let mut part = Part::new("increase in |bias| from each noise level to the next, above 0");
    for at in settings(&["C3"], &HIGHER_REMNANT_ORDERS, &NOISE_LEVELS[..2]) {
        let more = Setting {
            level: if at.level < 0.15 { 0.2 } else { 0.3 },
            ..at
        };
        for name in ["b0", "b1"] {
            let [less, more] = [at, more].map(|at| study.trace_bias(&at.rls(""), name));
            part.add_above(at.label(name), more?.abs().minus(less?.abs()), 0.0);
        }
    }
    Ok(vec![part])
}
