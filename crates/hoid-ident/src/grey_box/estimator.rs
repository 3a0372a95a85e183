//! The grey-box estimator: a fit for each order of the remnant.

use hoid_model::{PolynomialModel, Record, SampleTime, Structure, remnant::HIGHEST_ORDER};

use super::{
    layout::{self, Layout, TIME_CONSTANT_SLOT},
    objective::PhysicalCriterion,
    options::GreyBox,
    parametrisation::Parametrisation,
    result::{GreyBoxFit, OrderCandidate, OrderFigures},
    starts::{self, Start},
};
use crate::{
    Fit, IdentError, Reason, SearchOptions,
    criterion::{Data, Workspace, first_residual, output_variance},
    fit::Physical,
    informative_data,
    linalg::information::inverse_information_of_free,
    optimize::{Minimum, Objective, lies_in_basin},
    progress,
};

/// Limits of a search while orders are compared: relative decrease in the loss, and number of steps.
const QUICK_TOLERANCE: f64 = 1e-7;
const QUICK_ITERATIONS: usize = 30;

impl GreyBox {
    /// Fits one model to all records; each record has its own initial states.
    ///
    /// # Errors
    /// [`IdentError`] if no model can be fitted; with several orders, if none of the orders could be fitted. The fit
    /// itself reports how its search ended.
    pub fn fit(&self, records: &[Record]) -> Result<GreyBoxFit, IdentError> {
        let sample_time = informative_data::common_sample_time(records)?;
        self.check_orders()?;
        let layouts = self.layouts(records.len(), sample_time)?;
        let mut first = 0;
        for layout in &layouts {
            let orders = layout::orders(layout.order, layout.longest_nk()?);
            first = first.max(first_residual(&orders, self.initial_state));
        }
        for layout in &layouts {
            let orders = layout::orders(layout.order, layout.longest_nk()?);
            for record in records {
                informative_data::check_record(Structure::BoxJenkins, &orders, record, first)?;
            }
        }
        let data: Vec<Data<'_>> = Data::of(records);
        let criteria: Vec<PhysicalCriterion<'_, Layout>> = layouts
            .into_iter()
            .map(|layout| PhysicalCriterion::new(layout, data.clone(), self.initial_state, first))
            .collect();
        for criterion in &criteria {
            self.check_records(criterion, records)?;
        }
        let mut workspace = Workspace::borrow_from_thread();
        let Some(highest) = criteria.last() else {
            return Err(IdentError::NoFiniteLoss);
        };
        let mut starts = starts::grid(highest, self.starts.max(1), &mut workspace);
        let nearest = starts.first().cloned();
        starts.extend(nearest.and_then(|nearest| starts::box_jenkins_start(records, &nearest, highest)));

        if let [criterion] = criteria.as_slice() {
            let fit = self.fit_order(criterion, &starts, None, &self.search, &mut workspace)?;
            let candidates = vec![candidate(criterion, Ok(&fit))];
            return Ok(GreyBoxFit { candidates, ..fit });
        }
        // The comparison of orders does not need an exact loss, and a search for a wrong order converges slowly.
        let quick = SearchOptions {
            tolerance: self.search.tolerance.max(QUICK_TOLERANCE),
            max_iterations: self.search.max_iterations.min(QUICK_ITERATIONS),
            ..self.search
        };
        let (mut candidates, mut before) = (Vec::new(), None::<GreyBoxFit>);
        let mut error = None;
        let mut best: Option<(usize, GreyBoxFit)> = None;
        for (i, criterion) in criteria.iter().enumerate() {
            progress::report_step("remnant orders", i, criteria.len());
            let eta = before.as_ref().map(|fit| fit.eta.as_slice());
            let found = self.fit_order(criterion, &starts, eta, &quick, &mut workspace);
            candidates.push(candidate(criterion, found.as_ref()));
            before = match found {
                Ok(fit) => Some(fit),
                Err(reason) => {
                    error.get_or_insert(reason);
                    None
                }
            };
            if let Some(fit) = &before
                && best.as_ref().is_none_or(|(_, known)| fit.bic() < known.bic())
            {
                best = Some((i, fit.clone()));
            }
        }
        let Some((i, rough)) = best else {
            return Err(error.unwrap_or(IdentError::NoFiniteLoss));
        };
        let polished = criteria[i].search(rough.eta.clone(), &self.search, None, &mut workspace);
        let fit = match polished {
            Some(minimum) => self.result(&criteria[i], minimum, rough.start().to_owned())?,
            None => rough,
        };
        candidates[i] = candidate(&criteria[i], Ok(&fit));
        Ok(GreyBoxFit { candidates, ..fit })
    }

    fn check_orders(&self) -> Result<(), IdentError> {
        if self.order.is_empty() || *self.order.end() > HIGHEST_ORDER {
            return Err(IdentError::BadOption {
                option: "the orders m of the remnant".to_owned(),
                found: format!("{}..{}", self.order.start(), self.order.end()),
                expected: format!("LO..HI within 0..{HIGHEST_ORDER}, LO <= HI"),
            });
        }
        Ok(())
    }

    fn layouts(&self, records: usize, sample_time: SampleTime) -> Result<Vec<Layout>, IdentError> {
        self.order
            .clone()
            .map(|order| {
                Layout::new(
                    order,
                    records,
                    self.delay_range_s,
                    &self.constraints,
                    &self.individual,
                    sample_time,
                )
            })
            .collect()
    }

    fn check_records(&self, criterion: &PhysicalCriterion<'_, Layout>, records: &[Record]) -> Result<(), IdentError> {
        let unknowns = criterion.layout.names.len() + criterion.state_count();
        if criterion.residual_count() > unknowns {
            return Ok(());
        }
        Err(IdentError::TooFewSamples {
            label: records[0].label().to_owned(),
            samples: records[0].len(),
            orders: layout::orders(criterion.layout.order, criterion.layout.longest_nk()?).to_string(),
            needed: criterion.first + unknowns.div_ceil(records.len()),
        })
    }

    fn fit_order(
        &self,
        criterion: &PhysicalCriterion<'_, Layout>,
        starts: &[Start],
        before: Option<&[f64]>,
        search: &SearchOptions,
        workspace: &mut Workspace,
    ) -> Result<GreyBoxFit, IdentError> {
        let mut etas: Vec<(String, Vec<f64>)> = Vec::new();
        // The minimum of the previous order is a good start, except for the order 0, which has no T_n.
        if let Some(before) = before.filter(|b| b.len() == criterion.layout.names.len()) {
            etas.push((format!("order {}", criterion.layout.order - 1), before.to_vec()));
        }
        // All starts of an order use the same T_n, because it hardly depends on the operator.
        let mut time_constants = starts::GRID_TIME_CONSTANT_S.to_vec();
        for start in starts {
            let eta = starts::complete(criterion, start, &time_constants, workspace);
            if criterion.layout.order > 0 {
                time_constants = vec![eta[criterion.layout.positions[0][TIME_CONSTANT_SLOT]]];
            }
            etas.push((start.label.clone(), eta));
        }
        let mut best: Option<(String, Minimum)> = None;
        for (label, eta) in etas {
            if let Some((_, known)) = &best
                && criterion.is_feasible(&eta)
                && lies_in_basin(known, &eta, criterion.linearise(&eta, workspace).sum_of_squares)
            {
                continue;
            }
            let known = best
                .as_ref()
                .map(|(_, b): &(String, Minimum)| b.linearisation.sum_of_squares);
            let Some(minimum) = criterion.search(eta, search, known, workspace) else {
                continue;
            };
            if known.is_none_or(|known| minimum.linearisation.sum_of_squares < known) {
                best = Some((label, minimum));
            }
        }
        let (label, minimum) = best.ok_or(IdentError::NoFiniteLoss)?;
        self.result(criterion, minimum, label)
    }

    fn result(
        &self,
        criterion: &PhysicalCriterion<'_, Layout>,
        minimum: Minimum,
        start: String,
    ) -> Result<GreyBoxFit, IdentError> {
        let layout = &criterion.layout;
        let eta = minimum.theta;
        let p = eta.len();
        let not_fixed = layout.limits.iter().filter(|(low, high)| low < high).count();
        let (n, states) = (criterion.residual_count(), criterion.state_count());
        let sum_of_squares = minimum.linearisation.sum_of_squares;
        let innovation_variance = sum_of_squares / (n - not_fixed - states) as f64;
        let free = criterion.free_elements(&eta, &minimum.linearisation.descent);
        let covariance = if minimum.termination.reason == Reason::ExactFit {
            None
        } else {
            let inverse = inverse_information_of_free(&minimum.linearisation.gram, &free, &layout.names)?;
            Some(inverse.iter().map(|g| innovation_variance * g).collect::<Vec<f64>>())
        };
        let mut fits = Vec::with_capacity(criterion.data.len());
        for record in 0..criterion.data.len() {
            let polynomials = criterion.model_of(&eta, record)?;
            let of_theta = covariance
                .as_ref()
                .map(|c| polynomials.covariance_of_theta(c, p, layout.positions(record)));
            let held = vec![false; polynomials.theta.len()];
            fits.push(Fit {
                model: PolynomialModel::new(
                    Structure::BoxJenkins,
                    polynomials.orders,
                    layout.sample_time,
                    polynomials.theta,
                )?,
                covariance: of_theta,
                loss: sum_of_squares / n as f64,
                innovation_variance,
                residuals: n,
                states,
                initial_state: self.initial_state,
                termination: minimum.termination,
                start: start.clone(),
                is_fixed_or_bounded: held,
                output_variance: output_variance(&criterion.data, criterion.first),
                robust: false,
                instrumented: false,
                physical: None,
                searched_delay: None,
            });
        }
        let mut fit = GreyBoxFit {
            layout: layout.clone(),
            eta,
            covariance,
            free,
            parameters: not_fixed,
            fits,
            candidates: Vec::new(),
        };
        for record in 0..fit.fits.len() {
            let physical = Physical {
                title: format!("Grey box with a remnant of order m = {}", layout.order),
                parameters: fit.parameters(),
                free: fit.parameters,
                operator: fit.operator(record),
                remnant: fit.remnant(record),
            };
            fit.fits[record].physical = Some(Box::new(physical));
        }
        Ok(fit)
    }
}

fn candidate(criterion: &PhysicalCriterion<'_, Layout>, found: Result<&GreyBoxFit, &IdentError>) -> OrderCandidate {
    OrderCandidate {
        order: criterion.layout.order,
        outcome: found.map_err(IdentError::to_string).map(|fit| OrderFigures {
            loss: fit.loss(),
            aic: fit.aic(),
            bic: fit.bic(),
            converged: fit.termination().converged(),
        }),
    }
}
