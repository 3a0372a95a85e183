//! The five expectations of the recursive Box-Jenkins estimator at the end of Part II (6.2.2), compared with results
//! obtained in the setting of Part I.

use super::{
    claim::{Claim, Source, Theme},
    evidence::Evidence,
    rules::{ACCEPTABLE_BIAS, CLOSE_BIAS, HEAVY_REDUCTION, Part},
    settings::{
        DISCRETE_PARAMETERS, NOISE_LEVELS, RECURSIVE_NOISE_LEVELS, REMNANT_ORDERS, Setting, name_with_f, settings,
    },
    value::Value,
};
use hoid_study::{OPERATOR_PARAMETERS, Query};

const PLANS: &[&str] = &["recursive"];
const THESIS_SECTION: &str = "6.2.2";
const GAINS: [&str; 3] = ["K_e", "T_L", "K_e_dot"];
/// Time span of the transition after the change at 40.96 s, s.
const TRANSITION_S: (f64, f64) = (40.96, 51.2);
/// Starts in the plan, whose poles or gains are close to the true values (Table 6.1).
const START_NAMES: [&str; 9] = ["base", "IC1", "IC2", "IC3", "IC4", "IC5", "IC6", "IC7", "IC8"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "expect-diminished-at-m1",
        theme: Theme::Recursive,
        statement: "Recursive BJ is expected to \"Diminish the huge bias encountered in recursive ARX results for a first-order remnant filter\".",
        reference: THESIS_SECTION,
        measure: "Magnitude of the bias of the median trace over the last 30.72 s, RPEM minus RLS, m0 = 1, C3 to C6, by coefficient and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_bias_diminished),
    },
    Claim {
        id: "expect-t-l-stable",
        theme: Theme::Recursive,
        statement: "... to \"Solve the instabilities in T_L online estimation when the controlled element acts as a second-order integrator\".",
        reference: THESIS_SECTION,
        measure: "Share of runs in which T_L has an RMS error above 100 % or no value, RPEM divided by RLS, C2, by m0: below 1/4.",
        plans: PLANS,
        source: Source::Data(check_t_l_stable),
    },
    Claim {
        id: "expect-stable-transitions",
        theme: Theme::Recursive,
        statement: "... to \"Improve the stability of the transitions between estimations from controlled elements with first- to second-order integrator dynamics\".",
        reference: THESIS_SECTION,
        measure: "Interquartile range of the trace over the runs, averaged over the 10.24 s after t_M, RPEM minus RLS, C3 and C4, K_e, T_L and K_e_dot, by m0 and noise level, percentage points.",
        plans: PLANS,
        source: Source::Data(check_transitions),
    },
    Claim {
        id: "expect-low-error-at-high-orders",
        theme: Theme::Recursive,
        statement: "... to \"Provide online estimation results with a low error when high remnant filter orders are implemented in the simulation\".",
        reference: THESIS_SECTION,
        measure: "RPEM, m0 = 3 and 4, by operator parameter and noise level: magnitude of the bias of the median trace over the last 30.72 s, C3 to C6, and median RMS error of the trace, C1 and C2.",
        plans: PLANS,
        source: Source::Data(check_low_error),
    },
    Claim {
        id: "expect-depends-on-start",
        theme: Theme::Recursive,
        statement: "... to \"Be quite dependent on the initial conditions of the discrete-time parameters\".",
        reference: "6.2.2; V.B calls it \"independent of initial conditions set by the user\"",
        measure: "RPEM started from Table 6.1 minus RPEM started from the batch fit of the first 30.72 s, C4, P_n = 0.1, by start, m0 and operator parameter: |median paired difference in RMS error| and |difference in bias over the last 30.72 s|, above 5 points.",
        plans: &["recursive-starts"],
        source: Source::Data(check_dependence_on_start),
    },
];

fn check_bias_diminished(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("|bias| of RPEM minus that of RLS, below 0");
    for at in settings(&["C3", "C4", "C5", "C6"], &[1], &RECURSIVE_NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let rls = study.trace_bias(&at.rls(""), name)?.abs();
            let rpem = study.trace_bias(&at.rpem(""), &name_with_f(name))?.abs();
            part.add_below(at.label(name), rpem.minus(rls), 0.0);
        }
    }
    Ok(vec![part])
}

/// Share of the runs with an error above 100 % or without an estimate.
fn failed_share(errors: &[Vec<f64>]) -> f64 {
    let all = errors.concat();
    let far = all.iter().filter(|error| error.is_nan() || **error > 100.0);
    far.count() as f64 / all.len() as f64
}

fn check_t_l_stable(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("share of runs with an RMS error of T_L above 100 %: RPEM divided by RLS below 1/4");
    for m0 in REMNANT_ORDERS {
        let at = settings(&["C2"], &[m0], &RECURSIVE_NOISE_LEVELS);
        let of = |one: fn(Setting) -> Query| at.iter().map(|at| one(*at)).collect::<Vec<_>>();
        let (rls, rpem) = (of(|at| at.rls("rms_T_L")), of(|at| at.rpem("rms_T_L")));
        let ratio = study.evaluate(&[rpem.clone(), rls.clone()].concat(), &|s| {
            let (rpem, rls) = s.split_at(s.len() / 2);
            failed_share(rpem) / failed_share(rls)
        })?;
        part.add_below(format!("C2, m0 = {m0}"), ratio, HEAVY_REDUCTION);
        for (name, queries) in [("RLS", rls), ("RPEM", rpem)] {
            part.add_shown(
                format!("share of {name} at m0 = {m0}"),
                study.evaluate(&queries, &|s| failed_share(s))?,
            );
        }
    }
    Ok(vec![part])
}

fn check_transitions(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut parts = Vec::new();
    for name in GAINS {
        let mut part = Part::new(&format!(
            "{name}: interquartile range of RPEM minus that of RLS, below 0"
        ));
        for at in settings(&["C3", "C4"], &REMNANT_ORDERS, &RECURSIVE_NOISE_LEVELS) {
            let [rls, rpem] = [at.rls(""), at.rpem("")].map(|query| study.trace_range(&query, name, TRANSITION_S));
            part.add_below(at.label(""), rpem?.minus(rls?), 0.0);
        }
        parts.push(part);
    }
    Ok(parts)
}

fn check_low_error(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut bias = Part::new("|bias of the median trace| within 10 %");
    for at in settings(&["C3", "C4", "C5", "C6"], &[3, 4], &RECURSIVE_NOISE_LEVELS) {
        for name in OPERATOR_PARAMETERS {
            bias.add_below(
                at.label(name),
                study.trace_bias(&at.rpem(""), name)?.abs(),
                ACCEPTABLE_BIAS,
            );
        }
    }
    let mut error = Part::new("median RMS error of the trace within 10 %");
    for at in settings(&["C1", "C2"], &[3, 4], &RECURSIVE_NOISE_LEVELS) {
        for name in OPERATOR_PARAMETERS {
            error.add_below(
                at.label(name),
                study.median(&at.rpem(&format!("rms_{name}")))?,
                ACCEPTABLE_BIAS,
            );
        }
    }
    Ok(vec![bias, error])
}

fn check_dependence_on_start(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive-starts")?;
    let mut whole = Part::new("|difference in RMS error from 10 s on| above 5 points");
    let mut last = Part::new("|difference in bias over the last 30.72 s| above 5 points");
    for at in settings(&["C4"], &REMNANT_ORDERS, &NOISE_LEVELS[..1]) {
        for start in START_NAMES {
            for name in OPERATOR_PARAMETERS {
                let given = |quantity: &str| at.query(quantity).name("RPEM, given").start(start);
                let fitted = |quantity: &str| at.query(quantity).name("RPEM");
                let rms = format!("rms_{name}");
                let label = at.label(&format!("{start}, {name}"));
                let of_all = study.difference(&given(&rms), &fitted(&rms))?;
                whole.add_above(label.clone(), of_all.abs(), CLOSE_BIAS);
                let end: Value = study
                    .trace_bias(&given("loss"), name)?
                    .minus(study.trace_bias(&fitted("loss"), name)?);
                last.add_above(label, end.abs(), CLOSE_BIAS);
            }
        }
    }
    Ok(vec![whole, last])
}
