//! A second fit to the records with each sample held to its neighbours, and what it says of the first.
//!
//! [`crate::faults::held`] bounds what any sample brings into the filters of a fit, in e as in u.
//! Where the same estimator says something else of the held records, by more than three standard
//! errors in a parameter, in the crossover or in the phase margin, few samples carry the fit. Where no
//! sample is held the second fit would be the first, and is not made.

use hoid_model::{ContinuousTransferFunction, Detrend, Finding, Record, margins::MANUAL_CONTROL_RANGE_RAD_S};

use crate::{
    Estimator, Fit, GreyBox, GreyBoxFit, SigmoidChange, SigmoidFit,
    family::{FamilyEstimator, FamilyFit},
    faults::{held, second_opinion},
};

/// Standard errors by which a level may move a parameter.
const LEVEL: f64 = 2.0;

/// Name, value and standard error of a quantity, and its value in the other fit.
type Beside = (String, f64, Option<f64>, f64);

/// Of a fit of polynomials, by the estimator that made it; with its loop where the controlled element is
/// known.
pub fn of_polynomials(
    estimator: &Estimator,
    fit: &Fit,
    records: &[Record],
    element: Option<&ContinuousTransferFunction>,
) -> Option<Finding> {
    let other = again(estimator, fit, &held(records)?)?;
    let pairs = parameters_beside(fit, &other).into_iter();
    said(pairs.chain(loops_beside(fit, &other, element)))
}

/// Of a grey box: the order of its remnant stays.
pub fn of_grey_box(
    estimator: &GreyBox,
    fit: &GreyBoxFit,
    records: &[Record],
    element: Option<&ContinuousTransferFunction>,
) -> Option<Finding> {
    let held = held(records)?;
    let other = GreyBox {
        order: fit.order()..=fit.order(),
        ..estimator.clone()
    };
    let other = other.fit(&held).ok()?;
    let pairs = fit.parameters().into_iter().zip(other.parameters());
    let pairs = pairs.map(|((name, a), (_, b))| (name, a.value, a.standard_error, b.value));
    said(pairs.chain(loops_beside(fit.polynomial_fit(0), other.polynomial_fit(0), element)))
}

/// Of an operator of the family: its form and the orders of its noise model stay.
pub fn of_family(
    estimator: &FamilyEstimator,
    fit: &FamilyFit,
    records: &[Record],
    element: Option<&ContinuousTransferFunction>,
) -> Option<Finding> {
    let (nc, nd) = fit.noise_orders;
    let other = FamilyEstimator {
        forms: vec![fit.form],
        nc: nc..=nc,
        nd: nd..=nd,
        excitation: None,
        ..estimator.clone()
    };
    let other = other.fit_beside(&held(records)?, None).ok()?;
    let parameters = fit.operators.iter().zip(&other.operators).flat_map(|(one, two)| {
        let both = one.parameters.iter().zip(&two.parameters);
        both.filter(|(a, _)| a.determined)
            .map(|(a, b)| (a.name.clone(), a.value, a.standard_error, b.value))
    });
    let measures = |of: &FamilyFit| of.loop_measures(0, element?);
    let loops = measures(fit).zip(measures(&other)).map_or(Vec::new(), |(a, b)| {
        [
            ("the crossover", a.crossover_rad_s, b.crossover_rad_s),
            ("the phase margin", a.phase_margin_deg, b.phase_margin_deg),
        ]
        .map(|(name, a, b)| (name.to_owned(), a.value, a.standard_error, b.value))
        .to_vec()
    });
    said(parameters.chain(loops))
}

/// Of an operator whose gains change once. One fit that finds a change where the other finds none is a
/// difference whatever its size.
pub fn of_sigmoid(estimator: &SigmoidChange, fit: &SigmoidFit, records: &[Record]) -> Option<Finding> {
    let held = held(records)?;
    let other = SigmoidChange {
        likelihood_intervals: false,
        start: Some(fit.parameters().iter().map(|p| p.estimate.value).collect()),
        ..estimator.clone()
    };
    let other = other.fit(&held).ok()?;
    if fit.change_found() != other.change_found() {
        return Some(Finding::doubt(
            "leverage",
            "few samples carry the fit: with each held to its neighbours the records say something else about a change; \
             look at the recording",
        ));
    }
    if !fit.change_found() {
        let (one, two) = (fit.constant_operator(), other.constant_operator());
        let pairs = one.parameters.iter().zip(&two.parameters);
        return said(pairs.map(|(a, b)| {
            (
                a.name.to_owned(),
                a.estimate.value,
                a.estimate.standard_error,
                b.estimate.value,
            )
        }));
    }
    let pairs = fit.parameters().into_iter().zip(other.parameters());
    said(pairs.map(|(a, b)| (a.name, a.estimate.value, a.estimate.standard_error, b.estimate.value)))
}

/// What a level that is left in e and u does to a fit of polynomials, by a fit without their means: a
/// doubt where a parameter moves by more than `LEVEL` standard errors.
pub fn of_level(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Finding> {
    let without: Vec<Record> = records.iter().map(|r| r.clone().detrended(Detrend::Mean)).collect();
    let other = again(estimator, fit, &without)?;
    let moved: Vec<String> = parameters_beside(fit, &other)
        .into_iter()
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

/// The same model fitted to other records, from where the fit is.
fn again(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Fit> {
    let other = Estimator {
        start: Some(fit.model().theta().to_vec()),
        ..estimator.with_orders(fit.orders())
    };
    other.fit(records).ok()
}

/// The parameters of two fits: the operator's where there is one in both.
fn parameters_beside(fit: &Fit, other: &Fit) -> Vec<Beside> {
    match (fit.operator(), other.operator()) {
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
    }
}

/// Crossover and phase margin of two fits with the same controlled element.
fn loops_beside(fit: &Fit, other: &Fit, element: Option<&ContinuousTransferFunction>) -> Vec<Beside> {
    let Some(element) = element else { return Vec::new() };
    let margins = |of: &Fit| {
        let (low, high) = MANUAL_CONTROL_RANGE_RAD_S;
        let high = high.min(of.model().sample_time().nyquist_rad_s());
        of.margins(|omega| element.response(omega), (low, high))
    };
    let (one, two) = (margins(fit), margins(other));
    let both = [
        ("the crossover", one.crossover_rad_s, two.crossover_rad_s),
        ("the phase margin", one.phase_margin_deg, two.phase_margin_deg),
    ];
    let pairs = both.into_iter().filter_map(|(name, a, b)| Some((name, a?, b?)));
    pairs
        .map(|(name, a, b)| (name.to_owned(), a.value, a.standard_error, b.value))
        .collect()
}

fn said(pairs: impl IntoIterator<Item = Beside>) -> Option<Finding> {
    let all: Vec<Beside> = pairs.into_iter().collect();
    second_opinion(
        all.iter()
            .map(|(name, value, error, other)| (name.as_str(), *value, *error, *other)),
    )
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel, Structure,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn simulated(condition: Condition) -> Record {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        simulator.run(RunSeed::default(), false).unwrap()
    }

    /// The record with one sample of e that is wrong.
    fn spoilt(record: &Record) -> [Record; 1] {
        let mut e = record.input().to_vec();
        e[4000] = 30.0;
        let u = Channel::new("u", "", record.output().to_vec());
        [Record::new(record.sample_time(), Channel::new("e", "", e), u).unwrap()]
    }

    #[test]
    fn a_sample_that_carries_a_fit_is_told_by_all_kinds_of_fits() {
        let record = simulated(Condition::C1);
        let (clean, bad) = ([record.clone()], spoilt(&record));
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let element = Some(&element);
        let bj = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29));
        let of_bj = |records: &[Record]| of_polynomials(&bj, &bj.fit(records).unwrap(), records, element);
        assert_eq!(of_bj(&clean), None);
        let words = of_bj(&bad).unwrap().words;
        assert!(words.contains("T_L by"), "{words}");
        let grey = GreyBox::new(1..=1);
        let of_grey = |records: &[Record]| of_grey_box(&grey, &grey.fit(records).unwrap(), records, element);
        assert_eq!(of_grey(&clean), None);
        assert!(of_grey(&bad).is_some());
    }

    #[test]
    fn a_change_that_one_sample_makes_is_told() {
        let record = simulated(Condition::C4);
        let estimator = SigmoidChange {
            likelihood_intervals: false,
            ..SigmoidChange::default()
        };
        let of = |records: &[Record]| of_sigmoid(&estimator, &estimator.fit(records).unwrap(), records);
        assert_eq!(of(std::slice::from_ref(&record)), None);
        assert!(of(&spoilt(&record)).is_some());
    }
}
