//! Claims on the starting points of Box-Jenkins searches (Table 6.1), with m* = m0 and condition C1.

use super::{
    claim::{Claim, Source, Theme},
    evidence::{Evidence, Study},
    rules::{CLOSE_BIAS, LARGE_BIAS, Part, RELEVANT_DIFFERENCE},
    settings::{
        DISCRETE_PARAMETERS, NOISE_LEVELS, RECURSIVE_NOISE_LEVELS, REMNANT_ORDERS, Setting, TRUE_DELAY, bias_of,
        name_with_f, settings,
    },
    statistics::{jackknife, median_of, share_value},
    value::Value,
};
use hoid_numerics::statistics::mean;
use hoid_study::Query;

const PLANS: &[&str] = &["initial-conditions"];

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "ic-medians-close-to-zero",
        theme: Theme::InitialConditions,
        statement: "\"The medians of relative bias differences are null or close to zero\" for all starts.",
        reference: "6.1.4, Figs. F.1 to F.8",
        measure: "Median paired difference in bias from the base start, percentage points, for all starts, coefficients, orders m0, noise levels and n_k* = 26 to 30.",
        plans: PLANS,
        source: Source::Data(check_medians),
    },
    Claim {
        id: "ic-single-runs-differ",
        theme: Theme::InitialConditions,
        statement: "\"Several particular simulations can lead to considerable differences with respect to the base case.\"",
        reference: "6.1.4, Figs. F.1 to F.8",
        measure: "Share of fits whose b0 differs from that of the base start by more than 25 % of the true value, over all cells, by start: more than 1 in 1000.",
        plans: PLANS,
        source: Source::Data(check_single_runs),
    },
    Claim {
        id: "ic-poles-matter-more",
        theme: Theme::InitialConditions,
        statement: "\"The BJ model optimization is more sensitive to high initial deviations for the poles than for the zero location.\"",
        reference: "6.1.4, Figs. F.1 to F.8; Conclusions of Part II",
        measure: "Mean |difference in bias| of b0 and b1 from the base start: IC1 and IC2 (a changed) minus IC3 and IC6 (b changed), at least 0.1 percentage points.",
        plans: PLANS,
        source: Source::Data(check_pole_sensitivity),
    },
    Claim {
        id: "ic3-improves",
        theme: Theme::InitialConditions,
        statement: "IC3, closest to the reference: \"relative bias results are even improved when compared to the base case\".",
        reference: "6.1.4, Fig. F.3",
        measure: "Mean paired difference in |bias|, IC3 minus base start, below -0.1 percentage points, n_k* = 29, by coefficient, m0 and noise level.",
        plans: PLANS,
        source: Source::Data(check_third_start_improves),
    },
    Claim {
        id: "ic-convergence-fails",
        theme: Theme::InitialConditions,
        statement: "\"Initial conditions with high deviations from real values may lead to convergence failure.\"",
        reference: "VII; 6.1.4",
        measure: "Share of searches that do not converge, or end at a loss more than 1 % above that of the base start, n_k* = 29, over all cells with remnant, by start (IC1 to IC8, and three with high deviations, such as f1 = .5, f2 = .3, b0 = b1 = 1, d1 = .5): more than 1 in 100.",
        plans: PLANS,
        source: Source::Data(check_convergence),
    },
    Claim {
        id: "ic-from-ols-fails",
        theme: Theme::InitialConditions,
        statement: "Convergence failure is \"quite relevant regarding PEM initialization by a prior OLS estimation\", which may be highly biased.",
        reference: "VII",
        measure: "Share of PEM fits from OLS that fail, do not converge or have an error of a1 above 25 %, m0 = 1, C1 to C6 and all noise levels, first and last 30.72 s: more than 1 in 100. The search here first assumes zero initial states, then estimates them.",
        plans: &["recursive"],
        source: Source::Data(check_ols_start),
    },
];

const START_NAMES: [&str; 8] = ["IC1", "IC2", "IC3", "IC4", "IC5", "IC6", "IC7", "IC8"];
const FAR_START_NAMES: [&str; 3] = ["far1", "far2", "far3"];
const IC_DELAYS: [usize; 5] = [26, 27, 28, 29, 30];

fn fit_query(at: Setting, quantity: &str, nk: usize, start: &str) -> Query {
    at.query(&name_with_f(quantity)).name("BJ").nk(nk).start(start)
}

/// Bias of the fit from a start minus bias of the fit from the base start, for each replication, in percentage points.
fn bias_differences(study: Study<'_>, at: Setting, name: &str, nk: usize, start: &str) -> Result<Vec<f64>, String> {
    let of = |start: &str| study.sample(&fit_query(at, &bias_of(name), nk, start));
    Ok(of(start)?.iter().zip(&of("base")?).map(|(a, b)| a - b).collect())
}

fn check_medians(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("initial-conditions")?;
    let mut part = Part::new("|median difference| within 5 points");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for start in START_NAMES {
            for nk in IC_DELAYS {
                for name in DISCRETE_PARAMETERS {
                    let found = median_of(&bias_differences(study, at, name, nk, start)?);
                    part.add_below(
                        at.label(&format!("{start}, n_k* = {nk}, {name}")),
                        found.abs(),
                        CLOSE_BIAS,
                    );
                }
            }
        }
    }
    Ok(vec![part])
}

fn check_single_runs(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("initial-conditions")?;
    let mut part = Part::new("share of differences larger than 25 points, above 0.001");
    for start in START_NAMES {
        let mut beyond = Vec::new();
        for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
            for nk in IC_DELAYS {
                let found = bias_differences(study, at, "b0", nk, start)?;
                beyond.extend(found.iter().map(|d| f64::from(u8::from(d.abs() > LARGE_BIAS))));
            }
        }
        part.add_above(start.to_owned(), share_value(&beyond), 1e-3);
    }
    Ok(vec![part])
}

fn mean_magnitude(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    mean(&finite)
}

fn check_pole_sensitivity(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("initial-conditions")?;
    let mut part = Part::new("mean |difference| for starts with a changed minus that with b changed, above 0.1 points");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for nk in IC_DELAYS {
            for name in ["b0", "b1"] {
                let of = |start| bias_differences(study, at, name, nk, start);
                let samples = [of("IC1")?, of("IC2")?, of("IC3")?, of("IC6")?];
                let found = jackknife(&samples, &|s| {
                    let each: Vec<f64> = s.iter().map(|v| mean_magnitude(v)).collect();
                    0.5 * (each[0] + each[1] - each[2] - each[3])
                });
                part.add_above(at.label(&format!("n_k* = {nk}, {name}")), found, RELEVANT_DIFFERENCE);
            }
        }
    }
    Ok(vec![part])
}

fn check_third_start_improves(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("initial-conditions")?;
    let mut part = Part::new("mean difference in |bias|, IC3 minus base start, below -0.1 points");
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        for name in DISCRETE_PARAMETERS {
            let of = |start| fit_query(at, &bias_of(name), 29, start);
            let found = study.evaluate(&[of("IC3"), of("base")], &|s| {
                mean_magnitude(&s[0]) - mean_magnitude(&s[1])
            })?;
            part.add_below(at.label(name), found, -RELEVANT_DIFFERENCE);
        }
    }
    Ok(vec![part])
}

fn check_convergence(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("initial-conditions")?;
    let mut near = Part::new("IC1 to IC8: share of failed searches above 0.01");
    for start in START_NAMES {
        near.add_above(start.to_owned(), failure_share(study, "BJ", start)?, 0.01);
    }
    let mut far = Part::new("high deviations: share of failed searches above 0.01");
    for start in FAR_START_NAMES {
        far.add_above(start.to_owned(), failure_share(study, "BJ far", start)?, 0.01);
    }
    Ok(vec![near, far])
}

/// Share of the searches at the true delay that do not converge, or that end in a worse minimum than the search from
/// the base start.
fn failure_share(study: Study<'_>, name: &str, start: &str) -> Result<Value, String> {
    let mut failed = Vec::new();
    for at in settings(&["C1"], &REMNANT_ORDERS, &NOISE_LEVELS) {
        let from = |name: &str, start: &str, quantity: &str| {
            study.sample(&at.query(quantity).name(name).nk(TRUE_DELAY).start(start))
        };
        let (converged, loss, base) = (
            from(name, start, "converged")?,
            from(name, start, "loss")?,
            from("BJ", "base", "loss")?,
        );
        for ((converged, loss), base) in converged.iter().zip(&loss).zip(&base) {
            // If a search fails, its loss is NaN.
            let reached = *converged == 1.0 && *loss <= 1.01 * base;
            failed.push(f64::from(u8::from(!reached)));
        }
    }
    Ok(share_value(&failed))
}

fn check_ols_start(evidence: &Evidence<'_>) -> Result<Vec<Part>, String> {
    let study = evidence.study("recursive")?;
    let mut part = Part::new("share of failed fits from OLS above 0.01");
    for name in ["PEM first", "PEM last"] {
        let mut wrong = Vec::new();
        for at in settings(&["C1", "C2", "C3", "C4", "C5", "C6"], &[1], &RECURSIVE_NOISE_LEVELS) {
            let converged = study.sample(&at.query("converged").name(name))?;
            let f1 = study.sample(&at.query("f1").name(name))?;
            // The poles are the same in all conditions.
            let truth = study.truth(&at.query("f1").name(name))?.discrete[0];
            let off = |f1: f64| f1.is_nan() || (f1 - truth).abs() > LARGE_BIAS / 100.0 * truth.abs();
            wrong.extend(
                converged
                    .iter()
                    .zip(&f1)
                    .map(|(c, f1)| f64::from(u8::from(*c != 1.0 || off(*f1)))),
            );
        }
        part.add_above(name.to_owned(), share_value(&wrong), 0.01);
    }
    Ok(vec![part])
}
