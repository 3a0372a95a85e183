//! A second fit to the records with each sample held to its neighbours: what it says of the first.
//!
//! Where no sample is held the second fit is the first, and is not made.

use hoid_ident::{
    Estimator, Fit,
    family::{FamilyEstimator, FamilyFit},
    faults::{resistant, second_opinion},
};
use hoid_model::{Detrend, Finding, Record};

/// Standard errors by which a level may move a parameter.
const LEVEL: f64 = 2.0;

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
    let pairs = beside(estimator, fit, &held(records)?)?;
    second_opinion(
        pairs
            .iter()
            .map(|(name, value, error, other)| (name.as_str(), *value, *error, *other)),
    )
}

/// What a level that is left in e and u does to a fit of polynomials, by a fit without their means: a
/// doubt where a parameter moves by more than [`LEVEL`] standard errors.
pub fn of_level(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Finding> {
    let without: Vec<Record> = records.iter().map(|r| r.clone().detrended(Detrend::Mean)).collect();
    let pairs = beside(estimator, fit, &without)?;
    let moved: Vec<String> = pairs
        .iter()
        .filter_map(|(name, value, error, other)| {
            let off = (value - other).abs() / error.filter(|e| *e > 0.0)?;
            (off > LEVEL).then(|| format!("{name} by {off:.1}"))
        })
        .collect();
    (!moved.is_empty()).then(|| {
        Finding::doubt(
            "level",
            format!(
                "an offset of e or u moves {} standard errors: take the means out with --detrend mean",
                moved.join(", ")
            ),
        )
    })
}

/// Name, value and standard error of a parameter, and its value in another fit.
type Beside = (String, f64, Option<f64>, f64);

/// The parameters of a fit beside those of the same model of other records: the operator's where
/// there is one in both.
fn beside(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Vec<Beside>> {
    let other = Estimator {
        start: Some(fit.model().theta().to_vec()),
        ..estimator.with_orders(fit.orders())
    };
    let other = other.fit(records).ok()?;
    Some(match (fit.operator(), other.operator()) {
        (Ok(one), Ok(two)) => {
            let (one, two) = (one.rows(), two.rows());
            let pairs = one.iter().zip(&two);
            pairs
                .map(|((name, _, a), (_, _, b))| ((*name).to_owned(), a.value, a.standard_error, b.value))
                .collect()
        }
        _ => {
            let pairs = fit.parameters().into_iter().zip(other.parameters());
            pairs
                .map(|((name, a), (_, b))| (name, a.value, a.standard_error, b.value))
                .collect()
        }
    })
}

/// Of an operator of the family: its form and the orders of its noise model stay.
pub fn of_family(estimator: &FamilyEstimator, fit: &FamilyFit, records: &[Record]) -> Option<Finding> {
    let (nc, nd) = fit.noise_orders;
    let other = FamilyEstimator {
        forms: vec![fit.form],
        nc: nc..=nc,
        nd: nd..=nd,
        excitation: None,
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
