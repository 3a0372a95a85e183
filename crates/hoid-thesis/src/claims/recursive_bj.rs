//! Claims on the recursive prediction-error method for BJ(m* = 1) models, and its comparison with recursive least
//! squares.

use super::{
    claim::{Claim, Source, Theme},
    evidence::{Evidence, Study},
    rules::{ACCEPTABLE_BIAS, Part},
    settings::{
        DISCRETE_PARAMETERS, HIGHER_REMNANT_ORDERS, NMS_PARAMETERS, RECURSIVE_NOISE_LEVELS, REMNANT_ORDERS, Setting,
        name_with_f, settings,
    },
    statistics::{median_or_nan, share_value},
    value::Value,
};
use hoid_study::Query;

const PLANS: &[&str] = &["recursive"];
const GAINS: [&str; 3] = ["K_e", "T_L", "K_e_dot"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "rpem-less-bias",
        theme: Theme::Recursive,
        statement: "For m0 >= 2 RLS \"still shows a considerable bias with respect to BJ outcome\".",
        reference: "V.B, Fig. 11",
        measure: "Magnitude of the bias of the median trace over the last 30.72 s, RLS minus RPEM, C4, by coefficient, m0 and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_less_bias),
    },
    Claim {
        id: "rpem-5-times-slower",
        theme: Theme::Recursive,
        statement: "\"ARX converges to its final estimation 5 times faster\"; \"the BJ structure needs 500 % more time to process\".",
        reference: "V.B; VII; VIII, Figs. 11, 12",
        measure: "Settling time (to 90 % of its own step) of the median trace of RPEM divided by that of RLS, C4, by parameter, m0 and noise level: from 2.5 to 7.5.",
        plans: PLANS,
        source: Source::Data(check_five_times_slower),
    },
    Claim {
        id: "rpem-slower",
        theme: Theme::Recursive,
        statement: "\"The RPEM algorithm denotes a slower adaptation capacity.\"",
        reference: "V.B, Figs. 11, 12",
        measure: "Settling time (to 90 % of its own step) of the median trace, RPEM minus RLS, C4, by parameter, m0 and noise level, s.",
        plans: PLANS,
        source: Source::Data(check_slower_adaptation),
    },
    Claim {
        id: "rpem-diverges",
        theme: Theme::Recursive,
        statement: "RPEM \"may turn into divergence problems due to excessive oscillations in some cases\".",
        reference: "V.B",
        measure: "Share of RPEM runs in which a coefficient exceeds 10 or is not a number, and share in which the RMS error of T_L exceeds 100 %, C1 to C6, all m0 and noise levels: more than 1 in 1000.",
        plans: PLANS,
        source: Source::Data(check_divergence),
    },
    Claim {
        id: "rls-better-gain-and-zero",
        theme: Theme::Recursive,
        statement: "For m0 >= 2 \"ARX offers more stable, precise results than BJ in K_e, T_L and K_e_dot, while the BJ model provides a more adequate outcome in NMS parameters\".",
        reference: "V.B, Fig. 12; VII",
        measure: "Median paired difference in the RMS error of the trace, RPEM minus RLS, C4, m0 = 2 to 4, by parameter and noise level.",
        plans: PLANS,
        source: Source::Data(check_better_arx_gain),
    },
    Claim {
        id: "rls-0-to-5-percent",
        theme: Theme::Recursive,
        statement: "\"Except for a first-order remnant, the RLS algorithm usually captures the HO gain and zero with 0-5 % less bias.\"",
        reference: "VIII",
        measure: "100 (1 - RLS / RPEM) for the magnitude of the bias of the median trace of K_e and T_L over the last 30.72 s, C4, m0 = 2 to 4: from 0 to 5 %; the same for the median RMS error of the trace.",
        plans: PLANS,
        source: Source::Data(check_arx_bias_zero_to_five_less),
    },
    Claim {
        id: "rpem-nms-25-percent",
        theme: Theme::Recursive,
        statement: "\"BJ is able to approximate the real Neuro-Muscular (NMS) dynamics with 25 % less error.\"",
        reference: "VIII",
        measure: "100 (1 - RPEM / RLS) for the magnitude of the bias of the median trace of omega_nm and zeta_nm over the last 30.72 s, C4, m0 = 2 to 4: from 12.5 to 37.5 %; the same for the median RMS error of the trace.",
        plans: PLANS,
        source: Source::Data(check_nms_error),
    },
    Claim {
        id: "rpem-outperforms-at-m1",
        theme: Theme::Recursive,
        statement: "\"When a m0 = 1 simulation is conducted, the BJ model clearly outperforms ARX.\"",
        reference: "VIII; 6.2.2",
        measure: "Median paired difference in the RMS error of the trace, RPEM minus RLS, m0 = 1, C1 to C6, all parameters and noise levels.",
        plans: PLANS,
        source: Source::Data(check_first_order_remnant),
    },
    Claim {
        id: "rpem-t-l-oscillates",
        theme: Theme::Recursive,
        statement: "\"Great oscillations are given in T_L estimations from BJ structures\" (recursive).",
        reference: "V.B, Fig. 12; VII",
        measure: "Median RMS error of T_L minus the larger of the errors of K_e and K_e_dot, RPEM, C4, m0 = 2 to 4, by noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_t_l_oscillations),
    },
    Claim {
        id: "rpem-m2-coupling",
        theme: Theme::Recursive,
        statement: "\"An additional error is produced when m0 = 2 in BJ estimations since coupling can occur in poles.\"",
        reference: "V.B, Fig. 12",
        measure: "Median RMS error of the trace at m0 = 2 minus the larger of the errors at m0 = 3 and 4, RPEM, C4, \
                  by parameter and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_pole_coupling),
    },
    Claim {
        id: "rpem-tracks",
        theme: Theme::Recursive,
        statement: "RPEM \"is able to correctly track HO adaptations to CE dynamics transitions\".",
        reference: "VII",
        measure: "Magnitude of the bias of the median trace of K_e, T_L and K_e_dot over the last 30.72 s, C3 to C6, RPEM, by m0 and noise level.",
        plans: PLANS,
        source: Source::Data(check_tracking),
    },
    Claim {
        id: "rpem-noisier-in-s2",
        theme: Theme::Recursive,
        statement: "RPEM has \"strong oscillations that are given in state s2\".",
        reference: "VII",
        measure: "Median RMS error of K_e and T_L in C2 minus that in C1, RPEM, by m0 and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_second_state_oscillations),
    },
    Claim {
        id: "rpem-matrix-helps",
        theme: Theme::Recursive,
        statement: "\"RPEM could be implemented with a forgetting matrix ... diminishing the persistent bias\" in NMS coefficients.",
        reference: "VII",
        measure: "Median paired difference in the RMS error of omega_nm and zeta_nm, RPEM with a forgetting matrix minus RPEM with a factor, C3 to C6, P_n = 0.1.",
        plans: &["forgetting"],
        source: Source::Data(check_forgetting_matrix),
    },
];

fn check_less_bias(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("|bias| of RLS minus that of RPEM, above 0");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let rls = study.trace_bias(&at.rls(""), name)?.abs();
            let rpem = study.trace_bias(&at.rpem(""), &name_with_f(name))?.abs();
            part.add_above(at.label(name), rls.minus(rpem), 0.0);
        }
    }
    Ok(vec![part])
}

fn check_five_times_slower(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut parts = Vec::new();
    for name in GAINS {
        let mut part = Part::new(&format!(
            "settling time of {name}, RPEM divided by RLS, from 2.5 to 7.5"
        ));
        for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
            let [rls, rpem] = [at.rls(""), at.rpem("")].map(|query| study.settling(&query, name));
            let (rls, rpem) = (rls?, rpem?);
            part.add_effect(at.label(""), rpem.divided_by(rls), 5.0);
            if at.m0 == 2 && at.level == 0.1 {
                part.add_shown(format!("settling time of {name} by RLS, {}, s", at.label("")), rls);
                part.add_shown(format!("settling time of {name} by RPEM, {}, s", at.label("")), rpem);
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_slower_adaptation(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut parts = Vec::new();
    for name in GAINS {
        let mut part = Part::new(&format!("settling time of {name}, RPEM minus RLS, above 0 s"));
        for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
            let [rls, rpem] = [at.rls(""), at.rpem("")].map(|query| study.settling(&query, name));
            part.add_above(at.label(""), rpem?.minus(rls?), 0.0);
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_divergence(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut diverged = Part::new("share of diverged runs above 0.001");
    diverged.add_above(
        "all conditions, orders and levels".to_owned(),
        study.share(&Query::of("diverged").name("RPEM"))?,
        1e-3,
    );
    let mut oscillates = Part::new("share of runs with an RMS error of T_L above 100 %: more than 0.001");
    let mut beyond = Vec::new();
    for at in settings(
        &["C1", "C2", "C3", "C4", "C5", "C6"],
        &REMNANT_ORDERS,
        &RECURSIVE_NOISE_LEVELS,
    ) {
        let errors = study.sample(&at.rpem("rms_T_L"))?;
        beyond.extend(
            errors
                .iter()
                .map(|error| f64::from(u8::from(*error > 100.0 || error.is_nan()))),
        );
    }
    oscillates.add_above(
        "all conditions, orders and levels".to_owned(),
        share_value(&beyond),
        1e-3,
    );
    Ok(vec![diverged, oscillates])
}

/// Median over the runs of the difference between the RMS errors of a parameter estimated by RPEM and by RLS in the
/// same run.
fn rms(study: Study<'_>, at: Setting, name: &str) -> Result<Value, String> {
    let quantity = format!("rms_{name}");
    study.difference(&at.rpem(&quantity), &at.rls(&quantity))
}

/// Percentage by which the median RMS error for the first query is smaller than that for the second, in the same runs.
fn rms_reduction(study: Study<'_>, one: Query, other: Query) -> Result<Value, String> {
    study.evaluate(&[one, other], &|s| {
        100.0 * (1.0 - median_or_nan(&s[0]) / median_or_nan(&s[1]))
    })
}

fn check_better_arx_gain(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut gains = Part::new("K_e, T_L, K_e_dot: RMS error of RPEM minus that of RLS, above 0");
    let mut nms = Part::new("omega_nm, zeta_nm: RMS error of RPEM minus that of RLS, below 0");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        for name in GAINS {
            gains.add_above(at.label(name), rms(study, at, name)?, 0.0);
        }
        for name in NMS_PARAMETERS {
            nms.add_below(at.label(name), rms(study, at, name)?, 0.0);
        }
    }
    Ok(vec![gains, nms])
}

fn check_arx_bias_zero_to_five_less(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut bias = Part::new("|bias| of RLS is less than that of RPEM by 0 to 5 %");
    let mut error = Part::new("RMS error of RLS is less than that of RPEM by 0 to 5 %");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        for name in ["K_e", "T_L"] {
            let [rls, rpem] = [at.rls(""), at.rpem("")].map(|query| study.trace_bias(&query, name));
            let rms = format!("rms_{name}");
            bias.add_effect_between(at.label(name), rls?.abs().percent_less_than(rpem?.abs()), 0.0, 5.0);
            error.add_effect_between(
                at.label(name),
                rms_reduction(study, at.rls(&rms), at.rpem(&rms))?,
                0.0,
                5.0,
            );
        }
    }
    Ok(vec![bias, error])
}

fn check_nms_error(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut bias = Part::new("|bias| of RPEM is less than that of RLS by 12.5 to 37.5 %");
    let mut error = Part::new("RMS error of RPEM is less than that of RLS by 12.5 to 37.5 %");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        for name in NMS_PARAMETERS {
            let [rls, rpem] = [at.rls(""), at.rpem("")].map(|query| study.trace_bias(&query, name));
            let rms = format!("rms_{name}");
            bias.add_effect(at.label(name), rpem?.abs().percent_less_than(rls?.abs()), 25.0);
            error.add_effect(at.label(name), rms_reduction(study, at.rpem(&rms), at.rls(&rms))?, 25.0);
        }
    }
    Ok(vec![bias, error])
}

fn check_first_order_remnant(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut parts = Vec::new();
    for (names, label) in [
        (&GAINS[..], "K_e, T_L, K_e_dot"),
        (&NMS_PARAMETERS[..], "omega_nm, zeta_nm"),
    ] {
        let mut part = Part::new(&format!("{label}: RMS error of RPEM minus that of RLS, below 0"));
        for at in settings(&["C1", "C2", "C3", "C4", "C5", "C6"], &[1], &RECURSIVE_NOISE_LEVELS) {
            for name in names {
                part.add_below(at.label(name), rms(study, at, name)?, 0.0);
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_t_l_oscillations(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("RMS error of T_L minus the larger of those of K_e and K_e_dot, above 0");
    for at in settings(&["C4"], &HIGHER_REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
        let queries = ["rms_T_L", "rms_K_e", "rms_K_e_dot"].map(|quantity| at.rpem(quantity));
        part.add_above(
            at.label(""),
            study.evaluate(&queries, &|s| {
                median_or_nan(&s[0]) - median_or_nan(&s[1]).max(median_or_nan(&s[2]))
            })?,
            0.0,
        );
    }
    Ok(vec![part])
}

fn check_pole_coupling(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("RMS error at m0 = 2 minus the larger of those at m0 = 3 and 4, above 0");
    for at in settings(&["C4"], &[2], &RECURSIVE_NOISE_LEVELS) {
        for name in GAINS.into_iter().chain(NMS_PARAMETERS) {
            let queries = HIGHER_REMNANT_ORDERS.map(|m0| Setting { m0, ..at }.rpem(&format!("rms_{name}")));
            part.add_above(
                at.label(name),
                study.evaluate(&queries, &|s| {
                    median_or_nan(&s[0]) - median_or_nan(&s[1]).max(median_or_nan(&s[2]))
                })?,
                0.0,
            );
        }
    }
    Ok(vec![part])
}

fn check_tracking(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut parts = Vec::new();
    for name in GAINS {
        let mut part = Part::new(&format!("{name}: |bias of the median trace| within 10 %"));
        for at in settings(&["C3", "C4", "C5", "C6"], &[1, 2, 3, 4], &RECURSIVE_NOISE_LEVELS) {
            part.add_below(
                at.label(""),
                study.trace_bias(&at.rpem(""), name)?.abs(),
                ACCEPTABLE_BIAS,
            );
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_second_state_oscillations(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("RMS error in C2 minus that in C1, above 0");
    for at in settings(&["C1"], &[1, 2, 3, 4], &RECURSIVE_NOISE_LEVELS) {
        for name in ["K_e", "T_L"] {
            let quantity = format!("rms_{name}");
            let [first, second] =
                ["C1", "C2"].map(|condition| study.median(&Setting { condition, ..at }.rpem(&quantity)));
            part.add_above(at.label(name), second?.minus(first?), 0.0);
        }
    }
    Ok(vec![part])
}

fn check_forgetting_matrix(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("forgetting")?;
    let mut part = Part::new("RMS error with the matrix minus that with the factor, below 0");
    for at in settings(&["C3", "C4", "C5", "C6"], &[1, 2, 3, 4], &[0.1]) {
        for name in NMS_PARAMETERS {
            let quantity = format!("rms_{name}");
            let [matrix, factor] = ["RPEM, matrix", "RPEM, factor"].map(|of| at.query(&quantity).name(of));
            part.add_below(at.label(name), study.difference(&matrix, &factor)?, 0.0);
        }
    }
    Ok(vec![part])
}
