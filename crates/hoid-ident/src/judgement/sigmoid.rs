//! The verdict of a fit whose gains change once.

use hoid_model::{Finding, Record, Verdict};

use super::{
    operator::{gain_findings, pole_findings, search_finding},
    residuals::ResidualMeasures,
};
use crate::{IdentError, SigmoidFit, sigmoid::Remark};

impl SigmoidFit {
    /// What the fit is worth, on the records that it was fitted to. Where the records show no
    /// change, the operator without one is judged.
    ///
    /// # Errors
    /// As [`SigmoidFit::residuals`].
    pub fn verdict(&self, records: &[Record]) -> Result<Verdict, IdentError> {
        let mut all: Vec<Finding> = search_finding(self.termination()).into_iter().collect();
        all.extend(self.parameter_findings());
        let operators = if self.change_found() {
            vec![
                (" before the change", self.initial_operator()),
                (" after the change", self.last_operator()),
            ]
        } else {
            vec![("", self.constant_operator())]
        };
        all.extend(gain_findings(&operators));
        // The poles are the same before and after.
        if let Some(((_, operator), record)) = operators.first().zip(records.first()) {
            all.extend(pole_findings(operator, record.sample_time()));
        }
        if self.covariance().is_some() {
            all.extend(self.residual_measures(records)?.findings());
        }
        Ok(Verdict::of(all))
    }

    fn parameter_findings(&self) -> Vec<Finding> {
        let mut all = Vec::new();
        if !self.change_found() {
            all.push(Finding::note(
                "no-change",
                "the records show no change (BIC): take the operator without one",
            ));
        } else if self.is_change_point() {
            all.push(Finding::note(
                "change-point",
                "the change is too fast for normal errors of t_M and G: take the likelihood intervals",
            ));
        }
        for parameter in self.parameters() {
            let (name, value) = (parameter.name.as_str(), parameter.estimate.value);
            match parameter.remark {
                Some(Remark::AtBound) if name == "tau_e" => all.push(Finding::doubt(
                    "delay-at-bound",
                    format!("the delay {value:.3} s lies at the end of the range in which it was sought; widen it"),
                )),
                Some(Remark::AtBound) => all.push(Finding::doubt(
                    "parameter-at-bound",
                    format!("{name} = {} rests at a bound", hoid_model::numbers::plain(value)),
                )),
                Some(Remark::Undetermined) => all.push(Finding::doubt(
                    "undetermined-parameter",
                    format!("{name} is not determined by the data"),
                )),
                _ => {}
            }
        }
        all
    }

    fn residual_measures(&self, records: &[Record]) -> Result<ResidualMeasures, IdentError> {
        let found = records
            .iter()
            .map(|record| self.residuals(record))
            .collect::<Result<Vec<_>, _>>()?;
        let ts = records.first().map_or(1.0, |record| record.sample_time().s());
        Ok(ResidualMeasures::of_series(&found, records, ts))
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Record, VerdictLevel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use crate::SigmoidChange;

    fn simulated(condition: Condition) -> Record {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        simulator.run(RunSeed::default(), false).unwrap()
    }

    #[test]
    fn a_run_with_a_change_is_trustworthy_and_a_delay_at_its_bound_is_not() {
        let record = simulated(Condition::C4);
        let records = std::slice::from_ref(&record);
        let estimator = SigmoidChange {
            likelihood_intervals: false,
            ..SigmoidChange::default()
        };
        let verdict = estimator.fit(records).unwrap().verdict(records).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
        let estimator = SigmoidChange {
            delay_range_s: (0.05, 0.24),
            ..estimator
        };
        let verdict = estimator.fit(records).unwrap().verdict(records).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Doubtful, "{verdict}");
        assert!(
            verdict.findings().iter().any(|f| f.kind == "delay-at-bound"),
            "{verdict}"
        );
    }

    #[test]
    fn a_run_without_a_change_says_so() {
        let record = simulated(Condition::C1);
        let records = std::slice::from_ref(&record);
        let estimator = SigmoidChange {
            likelihood_intervals: false,
            ..SigmoidChange::default()
        };
        let verdict = estimator.fit(records).unwrap().verdict(records).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
        assert!(verdict.findings().iter().any(|f| f.kind == "no-change"), "{verdict}");
    }
}
