//! Evaluation of the criterion for a search and a fit: feasibility of theta, residuals, sum of squares, descent
//! `psi' eps` and `psi' psi`, over all parameters or those of one polynomial.

use std::ops::Range;

use hoid_core::stability::roots_inside;

use super::{
    initial_state::InitialState,
    normal_equations::Column,
    polynomials::{Block, Polynomials},
    prediction_error::Criterion,
    workspace::Workspace,
};
use crate::{
    linalg::{
        least_squares::solve_symmetric,
        vectors::{add_scaled, dot},
    },
    optimize::{Linearisation, Objective},
};

impl Criterion<'_> {
    /// Returns the sum of squared residuals, without derivatives.
    #[cfg(test)]
    pub fn sum_of_squares(&self, theta: &[f64], workspace: &mut Workspace) -> f64 {
        self.linearise(theta, workspace).sum_of_squares
    }

    /// Returns the coefficients of A and B that minimise the sum of squares for the other coefficients of theta, and
    /// this minimum. One step suffices, because the residual is affine in A and B. `None` if the regressors are
    /// singular or the loss is not finite.
    pub fn best_linear_part(&self, theta: &[f64], workspace: &mut Workspace) -> Option<(Vec<f64>, f64)> {
        let linear = self.orders.na + self.orders.nb;
        let mut theta = theta.to_vec();
        theta[..linear].fill(0.0);
        let mut total = Linearisation {
            sum_of_squares: 0.0,
            descent: vec![0.0; linear],
            gram: vec![0.0; linear * linear],
        };
        for index in 0..self.data.len() {
            self.add_record(&theta, &[Block::A, Block::B], index, workspace, &mut total);
        }
        let best = solve_symmetric(&total.gram, &total.descent)?;
        let gained = dot(&best, &total.descent);
        let value = total.sum_of_squares - gained;
        value.is_finite().then_some((best, value))
    }

    /// Like [`Objective::linearise`], but computes only the derivatives with respect to the coefficients of one
    /// polynomial and sets the other elements to zero.
    pub fn linearise_block(&self, theta: &[f64], block: Block, workspace: &mut Workspace) -> Linearisation {
        let (p, place) = (theta.len(), block.range(&self.orders));
        let count = place.len();
        let mut part = Linearisation {
            sum_of_squares: 0.0,
            descent: vec![0.0; count],
            gram: vec![0.0; count * count],
        };
        for index in 0..self.data.len() {
            self.add_record(theta, &[block], index, workspace, &mut part);
        }
        let mut whole = Linearisation {
            sum_of_squares: part.sum_of_squares,
            descent: vec![0.0; p],
            gram: vec![0.0; p * p],
        };
        whole.descent[place.clone()].copy_from_slice(&part.descent);
        for (i, row) in place.clone().zip(part.gram.chunks_exact(count.max(1))) {
            whole.gram[i * p + place.start..i * p + place.end].copy_from_slice(row);
        }
        whole
    }

    /// Returns the residuals of one record, starting at [`Criterion::first`].
    pub fn residuals_of(&self, theta: &[f64], record: usize, workspace: &mut Workspace) -> Vec<f64> {
        let mut residuals = Vec::new();
        self.process_record(theta, &[], record, workspace, |_, counted, ws| {
            // A short record is copied in one call, a long record span by span; the first call reserves memory for all
            // residuals.
            residuals.reserve_exact(self.data[record].u.len() - self.first - residuals.len());
            residuals.extend_from_slice(&ws.eps[counted]);
        });
        residuals
    }

    /// Returns the columns of psi in one record, from the first residual on, with the initial states projected out.
    pub fn jacobian(&self, theta: &[f64], record: usize, workspace: &mut Workspace) -> Vec<Vec<f64>> {
        let data = self.data[record];
        let states = self.compute_residuals(theta, record, data, workspace);
        self.compute_filtered_signals(theta, &Block::ALL, data, workspace);
        let parts = Polynomials::split(&self.orders, theta);
        let project = |column: Column<'_>| {
            let mut column: Vec<f64> = column.values.iter().map(|x| column.sign * x).collect();
            let components: Vec<f64> = states.responses.basis().map(|q| dot(q, &column[..q.len()])).collect();
            for (q, component) in states.responses.basis().zip(components) {
                add_scaled(&mut column[..q.len()], -component, q);
            }
            column
        };
        let counted = workspace.pad + self.first..workspace.pad + data.u.len();
        self.columns(&parts, counted, workspace, &Block::ALL)
            .into_iter()
            .map(project)
            .collect()
    }
}

impl Objective for Criterion<'_> {
    /// True if theta is finite and all roots of C and of each F are inside the unit circle. With a stationary past, the
    /// poles of the noise model must be inside as well.
    fn is_feasible(&self, theta: &[f64]) -> bool {
        let parts = Polynomials::split(&self.orders, theta);
        theta.iter().all(|v| v.is_finite())
            && roots_inside(parts.f, 1.0)
            && roots_inside(parts.c, 1.0)
            && self.further_polynomials(theta).all(|(_, f)| roots_inside(f, 1.0))
            && (self.initial != InitialState::Backcast || roots_inside(self.noise_poles(&parts), 1.0))
    }

    fn linearise(&self, theta: &[f64], workspace: &mut Workspace) -> Linearisation {
        let p = theta.len();
        let mut total = Linearisation {
            sum_of_squares: 0.0,
            descent: vec![0.0; p],
            gram: vec![0.0; p * p],
        };
        for index in 0..self.data.len() {
            let states = self.add_record(theta, &Block::ALL, index, workspace, &mut total);
            self.add_penalty(&states, &mut total);
        }
        total
    }

    fn stable_blocks(&self) -> Vec<Range<usize>> {
        let o = &self.orders;
        let (c, d) = (o.na + o.nb, o.na + o.nb + o.nc);
        let noise_poles = match self.initial {
            InitialState::Backcast if o.nb == 0 && o.nd == 0 => 0..o.na,
            InitialState::Backcast => d..d + o.nd,
            _ => 0..0,
        };
        let blocks = [c..d, d + o.nd..o.parameter_count(), noise_poles];
        let all = blocks.into_iter().chain(self.further_poles());
        all.filter(|block| !block.is_empty()).collect()
    }

    fn output_power(&self) -> f64 {
        self.data.iter().map(|d| dot(d.u, d.u)).sum()
    }
}
