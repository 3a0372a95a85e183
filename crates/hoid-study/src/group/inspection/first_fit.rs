//! Form and noise-model order found for the first run. They are evidence for the settings of the analysis, not its
//! result.

use hoid_ident::{
    Estimator,
    family::FamilyEstimator,
    order_selection::{Criterion, default_operator_ranges, fit_or_choose},
};
use hoid_model::{Record, Structure};

use super::evidence::Evidence;

/// Orders of the noise model to try.
const ORDERS: std::ops::RangeInclusive<usize> = 1..=6;
/// Number of orders above the selected one that the analysis may use for the other runs.
const EXTRA_ORDERS: usize = 2;

/// Evidence from the first run.
pub struct FirstFit {
    pub nd: Option<(usize, usize)>,
    pub evidence: Vec<Evidence>,
}

/// Fits Box-Jenkins models with several orders of the noise model, and the forms of the family.
pub fn fit_first_run(record: &Record) -> FirstFit {
    let mut evidence = Vec::new();
    let mut nd = None;
    let mut ranges = default_operator_ranges(Structure::BoxJenkins, record.sample_time());
    ranges.nd = ORDERS;
    if let Ok(combinations) = ranges.combinations() {
        let estimator = Estimator::new(Structure::BoxJenkins, combinations[0]);
        match fit_or_choose(
            &estimator,
            &ranges,
            Criterion::Bic,
            std::slice::from_ref(record),
            &|| {},
        ) {
            Ok((fit, _)) => {
                let chosen = fit.orders().nd;
                nd = Some((1, (chosen + EXTRA_ORDERS).min(*ORDERS.end())));
                let dead_time = (fit.orders().nk as f64 - 1.0) * record.sample_time().s();
                evidence.push(Evidence::new(
                    "[analysis]",
                    "nd",
                    format!("for the first run BIC chooses nd = {chosen}, with a dead time of {dead_time:.3} s"),
                ));
            }
            Err(reason) => evidence.push(Evidence::new(
                "[analysis]",
                "nd",
                format!("the first run cannot be fitted: {reason}"),
            )),
        }
    }
    let words = match FamilyEstimator::default().fit(std::slice::from_ref(record)) {
        Ok(fit) => format!(
            "for the first run alone the form is {} ({})",
            fit.form, fit.verdict.level
        ),
        Err(reason) => format!("the first run cannot be fitted: {reason}"),
    };
    evidence.push(Evidence::new("[analysis]", "form", words));
    FirstFit { nd, evidence }
}
