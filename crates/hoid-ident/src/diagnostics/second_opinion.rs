//! Second fits to the records after removal of a component, compared with the first fit.
//!
//! | removed | cause of a difference | finding |
//! |---|---|---|
//! | deviations of a sample of e or u from its neighbours beyond a limit ([`crate::faults::limited_records`]), so no sample has a large effect on the filters of the fit | a few samples | `leverage` |
//! | components slower than 20 s or, for a slow system, than ten periods of its slowest pole ([`crate::faults::without_slow_components`]) | a drift or a step of a sensor, which the person does not follow | `slow` |
//!
//! Two fits differ if a parameter, the crossover or the phase margin differs by more than three standard errors. The
//! standard error is the one from the first fit or, if larger, the one from the information lost in the second fit,
//! `sqrt(se'^2 - se^2)`. If nothing is removed, there is no second fit, because it would be identical to the first.
//!
//! The operator of polynomials is compared in the same way with the operator estimated directly (`operator`): an
//! efficient estimate and another estimate from the same data differ by the variance `se'^2 - se^2` (J. A. Hausman,
//! *Econometrica* 46 (1978) 1251-1271).

use std::f64::consts::TAU;

use hoid_model::{
    ContinuousTransferFunction, Detrend, Finding, Record, VerdictLevel,
    margins::MANUAL_CONTROL_RANGE_RAD_S,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::{
    Estimator, Fit, GreyBox, GreyBoxFit, SigmoidChange, SigmoidFit,
    family::{FamilyEstimator, FamilyFit},
    faults::{SLOW_PERIOD_S, limited_records, without_slow_components},
    progress,
};

/// Components are slow if their period is longer than this number of periods of the slowest pole of a system.
const SLOW_PERIOD_FACTOR: f64 = 10.0;
/// Two fits differ if an estimate differs by more than this number of standard errors.
const SIGNIFICANT_DIFFERENCE: f64 = 3.0;
/// Largest acceptable change in a parameter due to a level, in standard errors.
const MAX_LEVEL_EFFECT: f64 = 2.0;

/// Name of a quantity, and its estimates from the first and the second fit.
type ComparedEstimate = (String, Estimate, Estimate);

/// Component that is removed from the records before the second fit.
#[derive(Debug, Clone, Copy)]
enum RemovedComponent {
    Outliers,
    /// Components slower than this period, s.
    SlowComponents(f64),
}

impl RemovedComponent {
    const ALL: [Self; 2] = [Self::Outliers, Self::SlowComponents(SLOW_PERIOD_S)];

    /// Returns the records without the component; `None` if there is nothing to remove.
    fn records(self, records: &[Record]) -> Option<Vec<Record>> {
        match self {
            Self::Outliers => limited_records(records),
            Self::SlowComponents(period_s) => without_slow_components(records, period_s),
        }
    }

    /// Returns a warning if the first and the second fit differ in any of these quantities.
    fn finding(self, pairs: impl IntoIterator<Item = ComparedEstimate>) -> Option<Finding> {
        let differ = significant_differences(pairs)?;
        Some(match self {
            Self::Outliers => Finding::warning(
                "leverage",
                format!(
                    "the fit depends on a few samples: limiting the deviation of each sample from its neighbours \
                     changes {differ} standard errors; inspect the recording"
                ),
            ),
            Self::SlowComponents(period_s) => Finding::warning(
                "slow",
                format!(
                    "the fit depends on a drift or a step that the person does not follow: removing components slower \
                     than {period_s:.0} s changes {differ} standard errors; inspect the recording, or choose a span \
                     without this drift or step"
                ),
            ),
        })
    }
}

/// Returns the names of the quantities that differ significantly, with the differences in standard errors; `None` if
/// there is no such quantity.
fn significant_differences(pairs: impl IntoIterator<Item = ComparedEstimate>) -> Option<String> {
    let differ: Vec<String> = pairs
        .into_iter()
        .filter_map(|(name, first, other)| {
            let error = first.standard_error.unwrap_or(0.0);
            let lost = (other.standard_error.unwrap_or(0.0).powi(2) - error * error)
                .max(0.0)
                .sqrt();
            let off = (first.value - other.value).abs() / error.max(lost);
            (off > SIGNIFICANT_DIFFERENCE && off.is_finite()).then(|| format!("{name} by {off:.1}"))
        })
        .collect();
    (!differ.is_empty()).then(|| differ.join(", "))
}

/// Removes each component in `all`, one at a time, and returns the findings. `refit` fits the changed records and
/// returns the quantities of both fits.
fn component_findings(
    all: &[RemovedComponent],
    records: &[Record],
    refit: impl Fn(&[Record]) -> Option<Vec<ComparedEstimate>>,
) -> Vec<Finding> {
    let asked = |without: &RemovedComponent| without.finding(refit(&without.records(records)?)?);
    all.iter().filter_map(asked).collect()
}

/// Returns the findings of second fits of polynomials, made with the same estimator; crossover and phase margin are
/// also compared if the controlled element is known.
pub fn polynomial_findings(
    estimator: &Estimator,
    fit: &Fit,
    records: &[Record],
    element: Option<&ContinuousTransferFunction>,
) -> Vec<Finding> {
    let all = [
        RemovedComponent::Outliers,
        RemovedComponent::SlowComponents(slow_period_s(fit)),
    ];
    component_findings(&all, records, |others| {
        let other = refit(estimator, fit, others)?;
        let mut pairs = compared_parameters(fit, &other);
        pairs.extend(compared_loops(fit, &other, element));
        Some(pairs)
    })
}

/// Returns a warning if the operator that a polynomial fit represents differs from the operator estimated directly from
/// the same records. Polynomials with a noise model that is too simple, poles that the system and the noise share, or
/// instruments that the remnant contains have a bias that their standard errors do not contain.
///
/// There is no finding if the polynomials do not represent an operator, or if the records are not those of a person: the
/// direct estimate is compared only if nothing speaks against it.
pub fn operator_finding(fit: &Fit, records: &[Record]) -> Option<Finding> {
    let converted = fit.operator().ok()?;
    // The progress of the requested fit must not start again with the forms of this one.
    let fit_directly = || FamilyEstimator::default().fit_with_response(records, None).ok();
    let direct = progress::with_watcher(|_| {}, fit_directly)?;
    if direct.verdict.level != VerdictLevel::Trustworthy {
        return None;
    }
    let all = &direct.operator(0).parameters;
    let pairs = converted.rows().map(|(name, _, estimate)| {
        let known = all.iter().find(|p| p.name == name && p.determined)?;
        Some((name.to_owned(), estimate, known.estimate()))
    });
    let differ = significant_differences(pairs.into_iter().flatten())?;
    Some(Finding::warning(
        "operator",
        format!(
            "the operator of this model differs from the operator estimated directly (form {}): {differ} standard \
             errors; a noise model that is too simple or shares its poles with the operator, and instruments that \
             contain the remnant, bias the model: use the default estimator, or another structure",
            direct.form
        ),
    ))
}

/// Returns the period above which a component is slow: [`SLOW_PERIOD_S`], or ten periods of the slowest pole of the
/// system if that is longer.
fn slow_period_s(fit: &Fit) -> f64 {
    let poles = fit.roots();
    let poles = poles.iter().filter(|root| matches!(root.polynomial, 'a' | 'f'));
    // s Ts = ln z.
    let slowest = poles.map(|root| root.value.ln().norm()).filter(|rate| *rate > 0.0);
    let periods = slowest.map(|rate| SLOW_PERIOD_FACTOR * TAU * fit.model().sample_time().s() / rate);
    periods.fold(SLOW_PERIOD_S, f64::max)
}

/// Returns the findings of second fits of a grey box; the order of its remnant model stays the same.
pub fn grey_box_findings(
    estimator: &GreyBox,
    fit: &GreyBoxFit,
    records: &[Record],
    element: Option<&ContinuousTransferFunction>,
) -> Vec<Finding> {
    let estimator = GreyBox {
        order: fit.order()..=fit.order(),
        ..estimator.clone()
    };
    component_findings(&RemovedComponent::ALL, records, |others| {
        let other = estimator.fit(others).ok()?;
        let mut pairs = pair_estimates(fit.parameters(), other.parameters());
        pairs.extend(compared_loops(fit.polynomial_fit(0), other.polynomial_fit(0), element));
        Some(pairs)
    })
}

/// Returns the findings of second fits of an operator of the family; its form and the orders of its noise model stay
/// the same. Only single samples are examined for a fit at the lines of a recorded excitation, which carries no
/// information about slow components, and for a fit with several inputs.
pub fn family_findings(
    estimator: &FamilyEstimator,
    fit: &FamilyFit,
    records: &[Record],
    element: Option<&ContinuousTransferFunction>,
) -> Vec<Finding> {
    // Without noise the standard errors reflect only rounding, and the end effects of removing a component exceed them.
    if fit.noise_free.is_some() {
        return Vec::new();
    }
    let (nc, nd) = fit.noise_orders;
    let again = FamilyEstimator {
        forms: vec![fit.form],
        nc: nc..=nc,
        nd: Some(nd..=nd),
        excitation: None,
        intersample: fit.intersample,
        channels: fit.channels_in_use(),
        ..estimator.clone()
    };
    // Slow components would be removed only from e and u, not from the other inputs.
    let asked = match &fit.lines {
        None if again.channels.is_empty() => &RemovedComponent::ALL[..],
        _ => &RemovedComponent::ALL[..1],
    };
    let measures = |of: &FamilyFit| of.loop_measures_of_best_form(0, element?);
    component_findings(asked, records, |others| {
        let other = again.fit_with_response(others, None).ok()?;
        // Only the best form is compared, because the second fit has no other forms.
        let (one, two) = (fit.weighed.first()?, other.weighed.first()?);
        let parameters = one.operators.iter().zip(&two.operators).flat_map(|(one, two)| {
            let both = one.parameters.iter().zip(&two.parameters);
            both.filter(|(a, _)| a.determined)
                .map(|(a, b)| (a.name.clone(), a.estimate(), b.estimate()))
        });
        let mut pairs: Vec<ComparedEstimate> = parameters.collect();
        if let Some((a, b)) = measures(fit).zip(measures(&other)) {
            pairs.push(("the crossover".to_owned(), a.crossover_rad_s, b.crossover_rad_s));
            pairs.push(("the phase margin".to_owned(), a.phase_margin_deg, b.phase_margin_deg));
        }
        Some(pairs)
    })
}

/// Returns the finding of a second fit without outlying samples, for an operator whose gains change once. If only one
/// of the two fits finds a change, this counts as a difference regardless of the size of the change.
pub fn sigmoid_finding(estimator: &SigmoidChange, fit: &SigmoidFit, records: &[Record]) -> Option<Finding> {
    let without = RemovedComponent::Outliers;
    let other = SigmoidChange {
        likelihood_intervals: false,
        nd: Some(fit.d().len()),
        start: Some(fit.parameters().iter().map(|p| p.estimate.value).collect()),
        ..estimator.clone()
    };
    let other = other.fit(&without.records(records)?).ok()?;
    if fit.has_change() != other.has_change() {
        return Some(Finding::warning(
            "leverage",
            "the fit depends on a few samples: whether a change is found depends on whether outliers are limited; \
             inspect the recording",
        ));
    }
    if fit.has_change() {
        // The noise model is not compared, because it also describes the pulses of a stick.
        let named = |of: &SigmoidFit| {
            let operator = of.parameters().len() - of.d().len();
            let parameters = of.parameters().into_iter().take(operator);
            parameters.map(|p| (p.name, p.estimate)).collect()
        };
        return without.finding(pair_estimates(named(fit), named(&other)));
    }
    let constant = |of: &SigmoidFit| {
        let found = &of.constant_operator().parameters;
        found.iter().map(|p| (p.name.to_owned(), p.estimate)).collect()
    };
    without.finding(pair_estimates(constant(fit), constant(&other)))
}

/// Returns a warning if a level of e and u affects a polynomial fit: a parameter differs by more than
/// `MAX_LEVEL_EFFECT` standard errors if the means are removed.
pub fn level_finding(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Finding> {
    let without: Vec<Record> = records.iter().map(|r| r.clone().detrended(Detrend::Mean)).collect();
    let other = refit(estimator, fit, &without)?;
    let moved: Vec<String> = compared_parameters(fit, &other)
        .into_iter()
        .filter_map(|(name, first, other)| {
            let off = (first.value - other.value).abs() / first.standard_error.filter(|e| *e > 0.0)?;
            (off > MAX_LEVEL_EFFECT).then(|| format!("{name} by {off:.1}"))
        })
        .collect();
    (!moved.is_empty()).then(|| {
        Finding::warning(
            "level",
            format!(
                "an offset of e or u changes {} standard errors: remove the means with --detrend mean",
                moved.join(", ")
            ),
        )
    })
}

/// Fits the same model to other records, starting from the parameters of the fit.
fn refit(estimator: &Estimator, fit: &Fit, records: &[Record]) -> Option<Fit> {
    let other = Estimator {
        start: Some(fit.model().theta().to_vec()),
        ..estimator.with_orders(fit.orders())
    };
    other.fit(records).ok()
}

/// Pairs the parameters of two fits: the parameters of the operators if both fits correspond to an operator, otherwise
/// the coefficients.
fn compared_parameters(fit: &Fit, other: &Fit) -> Vec<ComparedEstimate> {
    match (fit.operator(), other.operator()) {
        (Ok(one), Ok(two)) => {
            let named = |of: OperatorEstimate| of.rows().map(|(name, _, estimate)| (name.to_owned(), estimate)).into();
            pair_estimates(named(one), named(two))
        }
        _ => pair_estimates(fit.parameters(), other.parameters()),
    }
}

fn pair_estimates(one: Vec<(String, Estimate)>, two: Vec<(String, Estimate)>) -> Vec<ComparedEstimate> {
    let pairs = one.into_iter().zip(two);
    pairs.map(|((name, first), (_, other))| (name, first, other)).collect()
}

/// Pairs the crossover and the phase margin of two fits with the same controlled element; empty if the element is
/// unknown.
fn compared_loops(fit: &Fit, other: &Fit, element: Option<&ContinuousTransferFunction>) -> Vec<ComparedEstimate> {
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
    pairs.map(|(name, a, b)| (name.to_owned(), a, b)).collect()
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel, Structure,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn simulated_record(condition: Condition) -> Record {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        simulator.run(RunSeed::default(), false).unwrap()
    }

    /// Returns the record with one faulty sample of e.
    fn with_outlier(record: &Record) -> [Record; 1] {
        let mut e = record.input().to_vec();
        e[4000] = 30.0;
        let u = Channel::new("u", "", record.output().to_vec());
        [Record::new(record.sample_time(), Channel::new("e", "", e), u).unwrap()]
    }

    #[test]
    fn biased_operator_of_polynomials_is_reported() {
        let record = [simulated_record(Condition::C1)];
        let of = |structure: Structure| {
            let estimator = Estimator::new(structure, structure.operator_orders(29));
            operator_finding(&estimator.fit(&record).unwrap(), &record)
        };
        let found = of(Structure::Armax).unwrap();
        assert!(
            found.kind == "operator" && found.message.contains("(form lead): T_L by "),
            "{found:?}"
        );
        assert_eq!(of(Structure::BoxJenkins), None);
    }

    #[test]
    fn influential_sample_is_reported_for_all_kinds_of_fits() {
        let record = simulated_record(Condition::C1);
        let (clean, bad) = ([record.clone()], with_outlier(&record));
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let element = Some(&element);
        let bj = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29));
        let of_bj = |records: &[Record]| polynomial_findings(&bj, &bj.fit(records).unwrap(), records, element);
        assert_eq!(of_bj(&clean), []);
        let words = &of_bj(&bad)[0].message;
        assert!(words.contains("T_L by"), "{words}");
        let grey = GreyBox::new(1..=1);
        let of_grey = |records: &[Record]| grey_box_findings(&grey, &grey.fit(records).unwrap(), records, element);
        assert_eq!(of_grey(&clean), []);
        assert_eq!(of_grey(&bad)[0].kind, "leverage");
    }

    #[test]
    fn change_caused_by_one_sample_is_reported() {
        let record = simulated_record(Condition::C4);
        let estimator = SigmoidChange {
            likelihood_intervals: false,
            ..SigmoidChange::default()
        };
        let of = |records: &[Record]| sigmoid_finding(&estimator, &estimator.fit(records).unwrap(), records);
        assert_eq!(of(std::slice::from_ref(&record)), None);
        assert!(of(&with_outlier(&record)).is_some());
    }
}
