//! Settings of a fit by the prediction error method.

use std::collections::BTreeMap;

use hoid_model::{Orders, Record, SampleTime, Structure};

use crate::{
    Constraint, IdentError, InitialState, Loss, Prior, SearchOptions,
    criterion::{Criterion, Data, first_residual},
    informative_data::{check_degrees_of_freedom, check_record, common_sample_time},
    pem::constraints::ConstrainedCriterion,
};

/// Validated options of an estimator, in which automatic options are replaced by their values.
#[derive(Debug, Clone)]
pub(crate) struct FitSettings {
    pub structure: Structure,
    pub orders: Orders,
    pub initial_state: InitialState,
    pub search: SearchOptions,
    /// Number of automatic starts from which the search is completed.
    pub starts: usize,
    /// Start given by the user, which replaces the automatic starts.
    pub start: Option<Vec<f64>>,
    pub constraints: BTreeMap<String, Constraint>,
    pub priors: BTreeMap<String, Prior>,
    pub loss: Loss,
    /// True if a level of u is estimated for each record.
    pub level: bool,
    /// True if A must also be stable.
    pub stable: bool,
}

impl FitSettings {
    /// Returns the criterion for these records, and their sample time. Residuals start at sample `first` or later.
    ///
    /// # Errors
    /// [`IdentError`] if the records are not informative enough.
    pub fn criterion<'r>(
        &self,
        records: &'r [Record],
        first: usize,
    ) -> Result<(Criterion<'r>, SampleTime), IdentError> {
        let sample_time = common_sample_time(records)?;
        let first = first.max(first_residual(&self.orders, self.initial_state));
        for record in records {
            check_record(self.structure, &self.orders, record, first)?;
        }
        let criterion = Criterion {
            orders: self.orders,
            data: Data::of(records)
                .into_iter()
                .map(|data| Data {
                    level: self.level,
                    ..data
                })
                .collect(),
            initial: self.initial_state,
            first,
            weights: None,
            further: Vec::new(),
        };
        check_degrees_of_freedom(&criterion, records)?;
        Ok((criterion, sample_time))
    }

    /// Returns the criterion with the constraints and the priors.
    pub fn constrained_criterion<'c, 'a>(&self, criterion: &'c Criterion<'a>) -> ConstrainedCriterion<'c, 'a> {
        let names = self.orders.parameter_names();
        let unlimited = (f64::NEG_INFINITY, f64::INFINITY);
        let limit = |name: &String| self.constraints.get(name).map_or(unlimited, |c| c.limits());
        let n = criterion.residual_count() as f64;
        let guess = |(i, name): (usize, &String)| {
            let prior = self.priors.get(name)?;
            Some((
                i,
                Prior {
                    weight: n * prior.weight,
                    ..*prior
                },
            ))
        };
        ConstrainedCriterion {
            criterion,
            limits: (!self.constraints.is_empty()).then(|| names.iter().map(limit).collect()),
            prior: names.iter().enumerate().filter_map(guess).collect(),
            stable: self.stable,
        }
    }

    /// True if the criterion is a plain sum of squares, without constraints, priors, a stability requirement or another
    /// loss.
    pub fn is_unconstrained(&self) -> bool {
        self.constraints.is_empty() && self.priors.is_empty() && self.loss == Loss::Quadratic && !self.stable
    }

    /// True if the fit is a linear least-squares problem.
    pub fn is_linear(&self) -> bool {
        self.structure.is_linear() && self.initial_state != InitialState::Backcast && self.is_unconstrained()
    }
}
