//! The verdict on a fit with gains that change once.

use hoid_model::{Finding, Record, SampleTime, Verdict};

use super::{
    operator::{gain_findings, is_undetermined, neuromuscular_finding, pole_findings, search_finding},
    residuals::ResidualMeasures,
};
use crate::{
    IdentError, SigmoidFit,
    sigmoid::{ChangedOperator, Remark},
};

impl SigmoidFit {
    /// Returns the verdict on the fit. `records` are the records of the fit. If they show no change, the operator
    /// without a change is assessed.
    ///
    /// # Errors
    /// The errors of [`SigmoidFit::residuals`].
    pub fn verdict(&self, records: &[Record]) -> Result<Verdict, IdentError> {
        let mut all: Vec<Finding> = search_finding(self.termination()).into_iter().collect();
        all.extend(self.parameter_findings());
        let operators: Vec<(&str, &ChangedOperator)> = if self.has_change() {
            vec![
                (" before the change", self.initial_operator()),
                (" after the change", self.last_operator()),
            ]
        } else {
            vec![("", self.constant_operator())]
        };
        let leads: Option<Vec<_>> = operators
            .iter()
            .map(|(label, o)| Some((*label, o.operator_estimate()?)))
            .collect();
        // The poles are the same before and after the change.
        match (leads, records.first()) {
            (Some(leads), Some(record)) => {
                all.extend(gain_findings(&leads));
                all.extend(
                    leads
                        .first()
                        .into_iter()
                        .flat_map(|(_, operator)| pole_findings(operator, record.sample_time())),
                );
            }
            (_, Some(record)) => all.extend(family_findings(&operators, record.sample_time())),
            (_, None) => {}
        }
        if self.covariance().is_some() {
            all.extend(self.residual_measures(records)?.findings());
        }
        Ok(Verdict::of(all))
    }

    fn parameter_findings(&self) -> Vec<Finding> {
        let mut all = Vec::new();
        if !self.has_change() {
            all.push(Finding::note(
                "no-change",
                "the records show no change (BIC): use the operator without a change",
            ));
        } else if self.is_change_point() {
            all.push(Finding::note(
                "change-point",
                "the change is too fast for t_M and G to have normally distributed errors: use the likelihood \
                 intervals",
            ));
        }
        for parameter in self.parameters() {
            let (name, value) = (parameter.name.as_str(), parameter.estimate.value);
            match parameter.remark {
                Some(Remark::AtBound) if name == "tau_e" => all.push(Finding::warning(
                    "delay-at-bound",
                    format!("the delay, {value:.3} s, is at an end of its search range; widen this range"),
                )),
                // At a bound of T_I the operator is equivalent to a pure integration, or has no lag.
                Some(Remark::AtBound) if name == "T_I" => all.push(Finding::note(
                    "lag",
                    format!("only K/T_I is determined, not T_I or K: T_I is at a bound, {value:.3} s"),
                )),
                Some(Remark::PriorAlone) => all.push(Finding::note(
                    "prior",
                    format!("{name} is determined by the prior alone"),
                )),
                Some(Remark::AtBound) => all.push(Finding::warning(
                    "parameter-at-bound",
                    format!(
                        "{name} = {} is at a bound; widen this bound",
                        hoid_model::numbers::format_plain(value)
                    ),
                )),
                Some(Remark::Undetermined) => all.push(Finding::warning(
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
        Ok(ResidualMeasures::from_series(&found, records, ts))
    }
}

/// Returns findings about parameters of family operators that do not differ from zero, and about implausible poles.
/// Undetermined gains and leads are named; if no operator has a significant gain, the finding is that the response to e
/// is too small.
fn family_findings(operators: &[(&str, &ChangedOperator)], sample_time: SampleTime) -> Vec<Finding> {
    let mut all = Vec::new();
    let mut open = Vec::new();
    let mut known = false;
    for (label, of) in operators {
        for p in &of.parameters {
            let varies = !matches!(p.name, "T_I" | "K" | "omega_nm" | "zeta_nm" | "tau_e");
            // Without a lag, K is the gain itself.
            if varies || (p.name == "K" && of.get("T_I").is_none()) {
                known |= !is_undetermined(&p.estimate);
                if is_undetermined(&p.estimate) {
                    open.push(format!("{}{label} ({})", p.name, p.estimate));
                }
            }
        }
    }
    let Some((_, first)) = operators.first() else {
        return all;
    };
    let still = ["omega_nm", "zeta_nm", "tau_e"].into_iter().filter_map(|name| {
        let estimate = first.get(name).filter(is_undetermined)?;
        Some(format!("{name} ({estimate})"))
    });
    open.extend(still);
    if !known {
        all.push(Finding::undetermined(
            "gain",
            "no gain differs from zero by at least two standard errors: u responds too little to e",
        ));
    } else if !open.is_empty() {
        let verb = if open.len() == 1 { "is" } else { "are" };
        all.push(Finding::note(
            "undetermined-parameter",
            format!(
                "{} {verb} not determined: less than two standard errors from zero",
                open.join(", ")
            ),
        ));
    }
    // The standard error of T_I is more than half of T_I, so 1/T_I does not differ significantly from zero.
    if first.get("T_I").as_ref().is_some_and(is_undetermined) {
        all.push(Finding::note(
            "lag",
            "only K/T_I is determined, not T_I or K: 1/T_I is less than two standard errors from zero",
        ));
    }
    if let (Some(omega), Some(zeta)) = (first.get("omega_nm"), first.get("zeta_nm")) {
        all.extend(neuromuscular_finding(omega.value, zeta.value, sample_time));
    }
    all
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Record, VerdictLevel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use crate::SigmoidChange;

    fn simulated_record(condition: Condition) -> Record {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        simulator.run(RunSeed::default(), false).unwrap()
    }

    #[test]
    fn changing_run_is_trustworthy_and_delay_at_bound_is_doubtful() {
        let record = simulated_record(Condition::C4);
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
    fn missing_change_is_reported() {
        let record = simulated_record(Condition::C1);
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
