//! Scores of a polynomial fit, including the score of the delay.
//!
//! nk is an integer, but the residual also has a derivative with respect to the delay
//! ([`searched_delay`](crate::searched_delay)). The scores of the delay need not sum to zero, because nk is not
//! optimised between samples. One step to the minimum removes this sum together with the sums of the scores of the
//! other parameters.

use hoid_model::{
    Finding, Record,
    delayed_operator::{delayed_operator_jacobian_with_delay_samples, delayed_operator_parameters},
};

use super::{
    Constancy, Direction, RUN_TO_RUN_DEVIATION,
    blocks::{ScoreBlock, Scores, score_blocks},
};
use crate::{
    Fit,
    criterion::{Criterion, Data, Workspace, first_residual},
};

/// Residuals of a robust fit are limited to this multiple of their scale, as in the robust loss.
const CLIPPING_LIMIT: f64 = 1.345;
/// If the sum of the scores of a parameter exceeds this number of standard deviations, the fit is not a least-squares
/// minimum, for example because it was made for simulation or a prior has more weight than the data.
const MAX_SCORE_SUM: f64 = 3.0;

impl Fit {
    /// Returns warnings if the operator changes over the records or a stretch dominates the fit. There are no warnings
    /// for models without an input or without noise, and for fits that do not minimise a sum of squares.
    pub(in crate::diagnostics) fn constancy_findings(&self, records: &[Record]) -> Vec<Finding> {
        self.constancy(records).unwrap_or_default()
    }

    fn constancy(&self, records: &[Record]) -> Option<Vec<Finding>> {
        let apart = self.instrumented || self.physical.is_some();
        if apart || self.covariance.is_none() || !self.model.structure().has_input() {
            return None;
        }
        let (orders, theta, ts) = (self.orders(), self.model.theta(), self.model.sample_time());
        let p = theta.len();
        let first = first_residual(&orders, self.initial_state);
        let mut workspace = Workspace::borrow_from_thread();
        let bound = if self.robust {
            CLIPPING_LIMIT * self.innovation_variance.sqrt()
        } else {
            f64::INFINITY
        };
        let mut scores = |_: usize, data: Data<'_>| -> Option<Scores> {
            let criterion = Criterion::for_record(orders, data, self.initial_state, first);
            let mut eps = criterion.residuals_of(theta, 0, &mut workspace);
            eps.iter_mut().for_each(|x| *x = x.clamp(-bound, bound));
            let psi = self.jacobian_with_delay(&criterion, &mut workspace);
            let free = psi
                .into_iter()
                .enumerate()
                .filter(|(i, _)| *i == p || !self.is_fixed_or_bounded[*i]);
            Some((eps, free.collect()))
        };
        let data = Data::of(records);
        let blocks = score_blocks(&data, first, p + 1, ts.s(), &mut scores)?;
        let over_all = |of: &dyn Fn(&ScoreBlock) -> f64| blocks.iter().map(of).sum::<f64>();
        let off = |i: usize| {
            let information = over_all(&|block| block.information[i * (p + 1) + i]);
            over_all(&|block| block.score[i]).powi(2)
                > MAX_SCORE_SUM * MAX_SCORE_SUM * self.innovation_variance * information
        };
        if (0..p).any(|i| !self.is_fixed_or_bounded[i] && off(i)) {
            return None;
        }
        let constancy = Constancy {
            blocks: &blocks,
            directions: &self.directions(),
            variance: self.innovation_variance,
            run_to_run: RUN_TO_RUN_DEVIATION,
            sample_time_s: ts.s(),
        };
        Some(constancy.findings())
    }

    /// Returns the tested directions: the delay, and the parameters of the operator or, without an operator, the
    /// coefficients.
    fn directions(&self) -> Vec<Direction> {
        let (orders, p) = (self.orders(), self.model.theta().len());
        let unit_vector = |index: usize| {
            let mut v = vec![0.0; p + 1];
            v[index] = 1.0;
            v
        };
        let mut all = vec![Direction {
            name: "tau_e".to_owned(),
            unit: " s",
            vector: unit_vector(p),
            delay: true,
            size: orders.nk as f64 * self.model.sample_time().s(),
        }];
        match self.operator_directions() {
            Some(found) => all.extend(found),
            None => {
                let names = orders.parameter_names().into_iter().enumerate();
                let of_system =
                    names.filter(|(i, name)| name.starts_with(['a', 'b', 'f']) && !self.is_fixed_or_bounded[*i]);
                all.extend(of_system.map(|(i, name)| Direction {
                    name,
                    unit: "",
                    vector: unit_vector(i),
                    delay: false,
                    size: self.model.theta()[i].abs(),
                }));
            }
        }
        all
    }

    fn operator_directions(&self) -> Option<Vec<Direction>> {
        let ts = self.model.sample_time();
        let whole = self.orders().nk.checked_sub(1)?;
        if self.is_fixed_or_bounded.contains(&true) {
            return None;
        }
        let mut parameters = delayed_operator_parameters(&self.operator().ok()?.parameters());
        parameters[4] = whole as f64 * ts.s();
        // The rows of the Jacobian are b0, b1, b2, f1, f2.
        let slopes = delayed_operator_jacobian_with_delay_samples(whole, parameters, ts).ok()?;
        let places = self.model.operator_positions();
        let named = [("K_e", ""), ("K_e_dot", " s"), ("omega_nm", " rad/s"), ("zeta_nm", "")];
        let of = |(k, (name, unit)): (usize, (&str, &'static str))| {
            let mut vector = vec![0.0; self.model.theta().len() + 1];
            for (index, row) in places.into_iter().zip([0, 1, 3, 4]) {
                vector[index] += slopes[row][k];
            }
            Direction {
                name: name.to_owned(),
                unit,
                vector,
                delay: false,
                size: parameters[k].abs(),
            }
        };
        Some(named.into_iter().enumerate().map(of).collect())
    }
}
