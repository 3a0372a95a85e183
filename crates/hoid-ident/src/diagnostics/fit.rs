//! The verdict on a polynomial fit.
//!
//! If the coefficients do not correspond to any operator, a response to e counts as established if b as a whole differs
//! from zero: `b' P_b^-1 b`, where P_b is the covariance of b, exceeds the 95 % point of chi-square with nb degrees of
//! freedom (A. Wald, *Trans. AMS* 54 (1943) 426-482).

use hoid_model::{Finding, NotConvertible, Orders, Record, Verdict};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{
    operator::{delay_finding, gain_findings, pole_findings, search_finding},
    residuals::ResidualMeasures,
};
use crate::{Choice, Fit, IdentError};

/// Residuals are only rounding errors of the data if their power is below this share of the power of u.
const ROUNDING_POWER_SHARE: f64 = 1e-22;
/// Minimum number of residuals per unknown; with fewer residuals a fit carries no information.
const MIN_RESIDUALS: usize = 5;
/// Significance level of the test of b against zero.
const SIGNIFICANCE_LEVEL: f64 = 0.05;

impl Fit {
    /// Returns the verdict on the fit. `records` are the records of the fit; `choice` is the search that chose its
    /// orders, if any. The kinds of findings are listed in the [module](super).
    ///
    /// # Errors
    /// The errors of [`Fit::residuals`].
    pub fn verdict(&self, records: &[Record], choice: Option<&Choice>) -> Result<Verdict, IdentError> {
        let mut all: Vec<Finding> = search_finding(self.termination).into_iter().collect();
        all.extend(choice.and_then(delay_limit_finding));
        all.extend(self.residual_count_finding());
        all.extend(self.system_findings());
        // Residuals that are only rounding errors carry no information.
        if let Some(share) = self.rounding_error_share() {
            all.push(Finding::note(
                "no-noise",
                format!(
                    "the data contain no noise: the model fits u to within {:.0e} of its size; the error bars reflect \
                     only the rounding of the data",
                    share.sqrt()
                ),
            ));
        } else if self.covariance.is_some() {
            all.extend(self.residual_findings(&self.residual_measures(records)?));
            all.extend(self.constancy_findings(records));
        }
        Ok(Verdict::of(all))
    }

    /// Returns the power of the residuals as a share of the power of u if the residuals are only rounding errors of the
    /// data, otherwise `None`.
    pub fn rounding_error_share(&self) -> Option<f64> {
        let share = self.loss / self.output_variance;
        (share < ROUNDING_POWER_SHARE).then_some(share)
    }

    /// Returns a finding if there are too few residuals for the number of unknowns.
    fn residual_count_finding(&self) -> Option<Finding> {
        let unknowns = self.model.theta().len() + self.states;
        (self.covariance.is_some() && self.residuals < MIN_RESIDUALS * unknowns).then(|| {
            Finding::undetermined(
                "too-few",
                format!(
                    "{} residuals for {unknowns} unknowns with nk = {}, fewer than {MIN_RESIDUALS} for each; use a \
                     longer record or lower orders",
                    self.residuals,
                    self.orders().nk
                ),
            )
        })
    }

    /// Returns the findings about the system from e to u that can be made without the records.
    fn system_findings(&self) -> Vec<Finding> {
        let mut all = Vec::new();
        if !self.model.is_stable() {
            all.push(Finding::warning(
                "unstable",
                "the model is unstable, but a person's response to a brief error dies out; lower the orders, or \
                 require a stable model",
            ));
        }
        if !self.model.structure().has_input() {
            return all;
        }
        match self.operator() {
            Ok(operator) => {
                all.extend(gain_findings(&[("", operator)]));
                all.extend(pole_findings(&operator, self.model.sample_time()));
                return all;
            }
            // Models of these orders or forms are not intended to be operators.
            Err(
                NotConvertible::OtherOrders { .. }
                | NotConvertible::PolesInBoth { .. }
                | NotConvertible::OtherForm { .. },
            ) => {}
            Err(reason) => all.push(Finding::warning(
                "not-convertible",
                format!("the coefficients do not correspond to any operator: {reason}"),
            )),
        }
        if self.responds_to_input() == Some(false) {
            all.push(Finding::undetermined(
                "gain",
                "B does not differ significantly from zero (5 % level): u responds too little to e",
            ));
        }
        all
    }

    /// True if b differs significantly from zero; `None` if the covariance of b is unknown or singular.
    fn responds_to_input(&self) -> Option<bool> {
        let covariance = self.covariance.as_ref()?;
        let names = self.orders().parameter_names();
        let p = names.len();
        let of_b: Vec<usize> = (0..p)
            .filter(|i| names[*i].starts_with('b') && !self.is_fixed_or_bounded[*i])
            .collect();
        if of_b.is_empty() || covariance.len() != p * p || self.physical.is_some() {
            return None;
        }
        let block = DMatrix::from_fn(of_b.len(), of_b.len(), |i, j| covariance[of_b[i] * p + of_b[j]]);
        let b = DVector::from_fn(of_b.len(), |i, _| self.model.theta()[of_b[i]]);
        let statistic = b.dot(&block.cholesky()?.solve(&b));
        let distribution = ChiSquared::new(of_b.len() as f64).ok()?;
        statistic
            .is_finite()
            .then(|| distribution.sf(statistic) < SIGNIFICANCE_LEVEL)
    }

    fn residual_measures(&self, records: &[Record]) -> Result<ResidualMeasures, IdentError> {
        let found = records
            .iter()
            .map(|record| self.residuals(record))
            .collect::<Result<Vec<_>, _>>()?;
        let with_input = self.model.structure().has_input();
        let pairs: Vec<(&[f64], &[f64])> = found
            .iter()
            .zip(records)
            .map(|(eps, record)| {
                let e = if with_input { &record.input()[eps.first..] } else { &[] };
                (eps.values.as_slice(), e)
            })
            .collect();
        Ok(ResidualMeasures::of(&pairs, self.model.sample_time().s()))
    }

    fn residual_findings(&self, measures: &ResidualMeasures) -> Vec<Finding> {
        if self.instrumented {
            // Instrumental variables do not require white residuals, and in a closed loop the residuals are correlated
            // with e.
            let note = |finding: Finding| {
                let message = format!(
                    "{}; instrumental variables do not require white residuals",
                    finding.message
                );
                Finding::note(finding.kind, message)
            };
            return measures
                .noise_model_finding()
                .map(note)
                .into_iter()
                .chain(measures.leverage_finding())
                .collect();
        }
        // A robust loss has already reduced the weight of single samples.
        let leverage = measures.leverage_finding().filter(|_| !self.robust);
        let others = [measures.noise_model_finding(), measures.structure_finding()];
        others.into_iter().flatten().chain(leverage).collect()
    }
}

/// Returns a finding if the delay is at an end of the range of delays that was searched with the other orders of the
/// chosen model.
fn delay_limit_finding(choice: &Choice) -> Option<Finding> {
    let chosen = choice.fit.orders();
    let same = |o: &Orders| Orders { nk: chosen.nk, ..*o } == chosen;
    let searched = || choice.candidates.iter().map(|c| c.orders).filter(same).map(|o| o.nk);
    let (low, high) = (searched().min()?, searched().max()?);
    let ts = choice.fit.model().sample_time().s();
    // tau_e = (nk - 1) Ts.
    let delay = |nk: usize| (nk as f64 - 1.0) * ts;
    delay_finding(delay(chosen.nk), (delay(low), delay(high)), "")
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel, SampleTime, Structure, VerdictLevel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{Estimator, InstrumentalVariable, IvMethod, order_selection, order_selection::OrderRanges};

    fn simulated_record(condition: Condition) -> Record {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        simulator.run(RunSeed::default(), false).unwrap()
    }

    fn finding_kinds(verdict: &Verdict) -> Vec<&'static str> {
        verdict.findings().iter().map(|f| f.kind).collect()
    }

    fn box_jenkins(nk: usize) -> Estimator {
        Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(nk))
    }

    fn fit_verdict(estimator: &Estimator, record: &Record) -> Verdict {
        let records = std::slice::from_ref(record);
        estimator.fit(records).unwrap().verdict(records, None).unwrap()
    }

    /// Returns the record with another output.
    fn with_output(record: &Record, output: Vec<f64>) -> Record {
        let input = Channel::new("e", "", record.input().to_vec());
        Record::new(record.sample_time(), input, Channel::new("u", "", output)).unwrap()
    }

    /// Returns white noise that is nearly normal.
    fn noise(n: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..n).map(|_| (0..12).map(|_| draw()).sum()).collect()
    }

    #[test]
    fn clean_runs_of_the_thesis_are_trustworthy() {
        for condition in [Condition::C1, Condition::C2] {
            let record = simulated_record(condition);
            let verdict = fit_verdict(&box_jenkins(29), &record);
            assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{condition:?}: {verdict}");
            assert!(finding_kinds(&verdict).is_empty(), "{verdict}");
        }
    }

    #[test]
    fn delay_at_the_end_of_its_range_is_reported() {
        let record = simulated_record(Condition::C1);
        let records = std::slice::from_ref(&record);
        let mut ranges = OrderRanges::from(Structure::BoxJenkins.operator_orders(29));
        ranges.nk = 20..=24;
        let criterion = order_selection::Criterion::Loss;
        let choice = order_selection::choose_orders(&box_jenkins(20), &ranges, criterion, records).unwrap();
        let verdict = choice.fit.verdict(records, Some(&choice)).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Doubtful);
        assert!(finding_kinds(&verdict).contains(&"delay-at-bound"), "{verdict}");
        ranges.nk = 27..=31;
        let choice = order_selection::choose_orders(&box_jenkins(29), &ranges, criterion, records).unwrap();
        assert!(finding_kinds(&choice.fit.verdict(records, Some(&choice)).unwrap()).is_empty());
    }

    #[test]
    fn unrelated_output_is_not_determined() {
        let record = simulated_record(Condition::C1);
        let other = with_output(&record, noise(record.len()));
        let records = std::slice::from_ref(&other);
        let of = |structure: Structure, orders: Orders| {
            let fit = Estimator::new(structure, orders).fit(records).unwrap();
            fit.verdict(records, None).unwrap()
        };
        // The gains are determined neither in a model with the orders of an operator nor in a model of other orders.
        let arx = of(Structure::Arx, Structure::Arx.operator_orders(29));
        assert_eq!(arx.level, VerdictLevel::NotDetermined, "{arx}");
        let fir = of(
            Structure::Fir,
            Orders {
                nb: 3,
                nk: 29,
                ..Orders::default()
            },
        );
        assert_eq!(fir.level, VerdictLevel::NotDetermined, "{fir}");
        assert_eq!(finding_kinds(&fir), ["gain"], "{fir}");
    }

    #[test]
    fn poor_noise_model_and_outlier_are_reported() {
        let record = simulated_record(Condition::C1);
        let oe = Estimator::new(Structure::OutputError, Structure::OutputError.operator_orders(29));
        assert!(finding_kinds(&fit_verdict(&oe, &record)).contains(&"residuals-not-white"));
        let mut output = record.output().to_vec();
        output[4000] += 50.0 * output.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        let verdict = fit_verdict(&box_jenkins(29), &with_output(&record, output.clone()));
        assert!(finding_kinds(&verdict).contains(&"leverage"), "{verdict}");
        let robust = Estimator {
            loss: crate::Loss::Huber { threshold: 1.345 },
            ..box_jenkins(29)
        };
        let verdict = fit_verdict(&robust, &with_output(&record, output));
        assert!(!finding_kinds(&verdict).contains(&"leverage"), "{verdict}");
    }

    #[test]
    fn coloured_residuals_of_instruments_are_only_a_note() {
        let record = simulated_record(Condition::C1);
        let records = std::slice::from_ref(&record);
        let orders = Structure::OutputError.operator_orders(29);
        let estimator = InstrumentalVariable {
            instruments: crate::Instruments::default_for(records),
            ..InstrumentalVariable::new(IvMethod::Sriv, orders)
        };
        let verdict = estimator.fit(records).unwrap().verdict(records, None).unwrap();
        assert_eq!(finding_kinds(&verdict), ["residuals-not-white"], "{verdict}");
        assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
    }

    #[test]
    fn unconvertible_and_unstable_coefficients_are_reported() {
        let of = |f1: f64, f2: f64| {
            let mut fit = box_jenkins(29).fit(&[simulated_record(Condition::C1)]).unwrap();
            let mut theta = fit.model.theta().to_vec();
            let places = fit.model.operator_positions();
            (theta[places[2]], theta[places[3]]) = (f1, f2);
            fit.model =
                hoid_model::PolynomialModel::new(Structure::BoxJenkins, fit.orders(), SampleTime::AT_100_HZ, theta)
                    .unwrap();
            fit.system_findings()
        };
        let found = of(-0.5, -0.2);
        assert!(
            found
                .iter()
                .any(|f| f.kind == "not-convertible" && f.message.contains("pole")),
            "{found:?}"
        );
        let found = of(-1.95, 1.01);
        assert!(found.iter().any(|f| f.kind == "unstable"), "{found:?}");
        // Poles at 0.99 and 0.01, i.e. 1 and 460 rad/s, have a damping ratio of 10.
        let found = of(-1.0, 0.0099);
        assert!(found.iter().any(|f| f.kind == "neuromuscular-lag"), "{found:?}");
    }

    #[test]
    fn model_without_input_is_judged_by_its_residuals() {
        let record = simulated_record(Condition::C1);
        let output = Channel::new("u", "", noise(3000));
        let white = Record::from_output(record.sample_time(), output).unwrap();
        let orders = Orders {
            na: 1,
            ..Orders::default()
        };
        let verdict = fit_verdict(&Estimator::new(Structure::Ar, orders), &white);
        assert!(finding_kinds(&verdict).is_empty(), "{verdict}");
        let shocks = noise(3001);
        let moving_average = shocks.windows(2).map(|w| w[1] + 0.9 * w[0]).collect();
        let output = Channel::new("u", "", moving_average);
        let coloured = Record::from_output(record.sample_time(), output).unwrap();
        let verdict = fit_verdict(&Estimator::new(Structure::Ar, orders), &coloured);
        assert_eq!(finding_kinds(&verdict), ["residuals-not-white"], "{verdict}");
    }
}
