//! A second fit to the records with each sample held to its neighbours: what it says of the first.
//!
//! Where no sample is held the second fit is the first, and is not made.

use hoid_ident::{
    Estimator, Fit,
    family::{FamilyEstimator, FamilyFit},
    faults::{resistant, second_opinion},
};
use hoid_model::{Finding, Record};

/// The records with their samples held; `None` where none is.
fn held(records: &[Record]) -> Option<Vec<Record>> {
    let all: Vec<Option<Record>> = records.iter().map(resistant).collect();
    all.iter().any(Option::is_some).then(|| {
        let pairs = all.into_iter().zip(records);
        pairs
            .map(|(held, as_is)| held.unwrap_or_else(|| as_is.clone()))
            .collect()
    })
}

/// Of a fit of polynomials, by the estimator that made it.
pub fn of_polynomials(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Finding> {
    let other = Estimator {
        start: Some(fit.model().theta().to_vec()),
        ..estimator.with_orders(fit.orders())
    };
    let other = other.fit(&held(records)?).ok()?;
    match (fit.operator(), other.operator()) {
        (Ok(one), Ok(two)) => {
            let (one, two) = (one.rows(), two.rows());
            let pairs = one.iter().zip(&two);
            second_opinion(pairs.map(|((name, _, a), (_, _, b))| (*name, a.value, a.standard_error, b.value)))
        }
        _ => {
            let (one, two) = (fit.parameters(), other.parameters());
            let pairs = one.iter().zip(&two);
            second_opinion(pairs.map(|((name, a), (_, b))| (name.as_str(), a.value, a.standard_error, b.value)))
        }
    }
}

/// Of an operator of the family: its form and the orders of its noise model stay.
pub fn of_family(estimator: &FamilyEstimator, fit: &FamilyFit, records: &[Record]) -> Option<Finding> {
    let (nc, nd) = fit.noise_orders;
    let other = FamilyEstimator {
        forms: vec![fit.form],
        nc: nc..=nc,
        nd: nd..=nd,
        ..estimator.clone()
    };
    let other = other.fit_beside(&held(records)?, None).ok()?;
    let pairs = fit.operators.iter().zip(&other.operators).flat_map(|(one, two)| {
        let both = one.parameters.iter().zip(&two.parameters);
        both.filter(|(a, _)| a.determined)
            .map(|(a, b)| (a.name.as_str(), a.value, a.standard_error, b.value))
    });
    second_opinion(pairs)
}
