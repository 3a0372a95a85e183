//! The verdict on a fit in physical parameters.

use hoid_model::{Finding, Record, Verdict, uncertainty::OperatorEstimate};

use super::{
    constancy::{Constancy, Direction, RUN_TO_RUN_DEVIATION, physical_score_blocks},
    operator::{delay_finding, gain_findings, pole_findings, search_finding},
    residuals::ResidualMeasures,
};
use crate::{
    GreyBoxFit, IdentError,
    criterion::{Data, Workspace, first_residual},
    grey_box::{
        layout::{self, DELAY_SLOT, LEAD_SLOT, TIME_CONSTANT_SLOT},
        objective::PhysicalCriterion,
    },
};

impl GreyBoxFit {
    /// Returns the verdict on the fit. `records` are the records of the fit, in their order. The kinds of findings are
    /// listed in the [module](super).
    ///
    /// # Errors
    /// The errors of [`crate::Fit::residuals`].
    pub fn verdict(&self, records: &[Record]) -> Result<Verdict, IdentError> {
        let mut all: Vec<Finding> = search_finding(self.termination()).into_iter().collect();
        let layout = &self.layout;
        for (i, name) in layout
            .names
            .iter()
            .enumerate()
            .filter(|(i, _)| layout.slots[*i] == DELAY_SLOT)
        {
            let of = match name.strip_prefix("tau_e") {
                Some("") | None => String::new(),
                Some(record) => format!(" of record {}", record.trim_matches(['[', ']'])),
            };
            all.extend(delay_finding(self.eta[i], layout.limits[i], &of));
        }
        all.extend(self.operator_findings());
        if self.covariance().is_some() {
            all.extend(self.residual_measures(records)?.findings());
            all.extend(self.constancy_findings(records).unwrap_or_default());
        }
        Ok(Verdict::of(all))
    }

    fn operator_findings(&self) -> Vec<Finding> {
        // There is one operator for all records, or one for each record.
        let places = &self.layout.positions;
        let several = places.iter().any(|of_record| *of_record != places[0]);
        let records = if several { places.len() } else { 1 };
        let mut all = Vec::new();
        let mut operators: Vec<(String, OperatorEstimate)> = Vec::new();
        for record in 0..records {
            let label = if several {
                format!(" of record {}", record + 1)
            } else {
                String::new()
            };
            match self.operator(record) {
                Ok(operator) => operators.push((label, operator)),
                Err(reason) => all.push(Finding::warning(
                    "not-convertible",
                    format!("the coefficients{label} do not correspond to any operator: {reason}"),
                )),
            }
        }
        let labelled: Vec<(&str, OperatorEstimate)> = operators.iter().map(|(l, o)| (l.as_str(), *o)).collect();
        all.extend(gain_findings(&labelled));
        for (label, operator) in &operators {
            for finding in pole_findings(operator, self.layout.sample_time) {
                let words = if several {
                    format!("{label}: {}", finding.message)
                } else {
                    finding.message
                };
                let finding = Finding {
                    message: words.trim_start().to_owned(),
                    ..finding
                };
                if !all.contains(&finding) {
                    all.push(finding);
                }
            }
        }
        all
    }

    /// Returns warnings if the operator changes over the records or a stretch dominates the fit.
    fn constancy_findings(&self, records: &[Record]) -> Option<Vec<Finding>> {
        let layout = &self.layout;
        let initial = self.polynomial_fit(0).initial_state();
        let first = first_residual(&layout::orders(layout.order, layout.longest_nk().ok()?), initial);
        let criterion = PhysicalCriterion::new(layout.clone(), Data::of(records), initial, first);
        let blocks = physical_score_blocks(&criterion, &self.eta, &self.free, &mut Workspace::borrow_from_thread())?;
        let direction = |index: &usize| {
            let (slot, p) = (layout.slots[*index], self.eta.len());
            let individual = layout.names[*index].contains('[');
            let mut vector = vec![0.0; p];
            vector[*index] = 1.0;
            Direction {
                name: layout.names[*index].clone(),
                unit: match slot {
                    LEAD_SLOT | DELAY_SLOT => " s",
                    2 => " rad/s",
                    _ => "",
                },
                vector,
                delay: slot == DELAY_SLOT,
                size: if individual { 0.0 } else { self.eta[*index].abs() },
            }
        };
        let of_operator = self
            .free
            .iter()
            .filter(|index| layout.slots[**index] != TIME_CONSTANT_SLOT);
        let constancy = Constancy {
            blocks: &blocks,
            directions: &of_operator.map(direction).collect::<Vec<_>>(),
            variance: self.innovation_variance(),
            run_to_run: RUN_TO_RUN_DEVIATION,
            sample_time_s: layout.sample_time.s(),
        };
        Some(constancy.findings())
    }

    fn residual_measures(&self, records: &[Record]) -> Result<ResidualMeasures, IdentError> {
        let found = records
            .iter()
            .enumerate()
            .map(|(k, record)| self.polynomial_fit(k).residuals(record))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(ResidualMeasures::from_series(
            &found,
            records,
            self.layout.sample_time.s(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        VerdictLevel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use crate::GreyBox;

    #[test]
    fn clean_run_is_trustworthy_and_delay_at_its_bound_is_doubtful() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let records = std::slice::from_ref(&record);
        let verdict = GreyBox::new(1..=1).fit(records).unwrap().verdict(records).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
        assert!(verdict.findings().is_empty(), "{verdict}");
        let estimator = GreyBox {
            delay_range_s: (0.05, 0.24),
            ..GreyBox::new(1..=1)
        };
        let verdict = estimator.fit(records).unwrap().verdict(records).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Doubtful, "{verdict}");
        assert!(
            verdict.findings().iter().any(|f| f.kind == "delay-at-bound"),
            "{verdict}"
        );
    }

    #[test]
    fn findings_name_the_record_of_an_individual_parameter() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let run = |k| {
            simulator
                .run(
                    RunSeed {
                        replication: k,
                        ..RunSeed::default()
                    },
                    false,
                )
                .unwrap()
        };
        let records = [run(0), run(1)];
        let estimator = GreyBox {
            individual: vec!["tau_e".to_owned()],
            delay_range_s: (0.05, 0.24),
            ..GreyBox::new(1..=1)
        };
        let verdict = estimator.fit(&records).unwrap().verdict(&records).unwrap();
        for record in ["of record 1", "of record 2"] {
            assert!(verdict.reasons().any(|r| r.contains(record)), "{verdict}");
        }
    }
}
