//! The prediction error criterion for an operator that changes.
//!
//! Let y_i be the response to the held error of an operator with the numerator `s^i`, the poles and the delay, and n_i
//! the coefficients of the actual numerator. Then
//!
//! `w(t) = sum_i n_i(t - tau) y_i(t)`,  `v = u - w`,  `eps = D v`,
//!
//! because the delay follows the gains. For a gain and a lead, w is `K_e(t - tau) y_0(t) + K_e_dot(t - tau) y_1(t)`,
//! with y_0 the response of `omega^2/(s^2 + 2 zeta omega s + omega^2) e^{-tau s}`. All y_i have the same F and the same
//! state, which the numerator does not affect, so y_i = (B_i/F) q^-nk e is always valid ([`super::unit_operator`]).
//! With the gain k and the shape m of the numerator, `n = k m(x)` ([`hoid_model::Form::shape`]),
//!
//! `dw/dk = sum_i m_i y_i`,  `dw/dx_j = k sum_i (dm_i/dx_j) y_i`.
//!
//! **Initial states.** The state of the operator at the start of a record is unknown and has as many elements as there
//! are poles. Any state can be reached from rest by the same number of held errors before it. These errors are the
//! unknowns, so the same filters give the responses to them and all derivatives. For a gain and a lead the errors
//! precede the record. For other forms they immediately precede the first residual, where the response of a fast pole
//! has not yet decayed and remains distinguishable from the other responses. They enter eps linearly and are eliminated
//! exactly for each theta, as in [`crate::criterion::initial_state_responses`]: `eps = (I - Q Q') eps_0`, psi is
//! computed with the optimal states, and its products are `psi' (I - Q Q') psi` (G. H. Golub and V. Pereyra, *SIAM J.
//! Numer. Anal.* 10 (1973) 413-432; L. Kaufman, *BIT* 15 (1975) 49-57).
//!
//! **Level.** In recorded data u may have a level c that is not a response to e ([`crate::Fit::level`]). It is an
//! additional linear unknown of each record, with a response of ones, and is eliminated in the same way. The means
//! cannot be removed before the fit, since the response to the mean of e changes with the gains.
//!
//! **Prior.** Prior knowledge is added as additional squared residuals ([`super::prior`]).

use hoid_model::{Form, SampleTime, uncertainty::variance_along};

use super::{layout::Layout, sigmoid_point::SigmoidPoint, unit_operator::UnitOperator};
use crate::{
    criterion::Workspace,
    grey_box::objective::Penalty,
    linalg::vectors::{add_scaled, dot},
    optimize::Linearisation,
    optimize::Objective,
};

/// Input, output and start time of one record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Data<'a> {
    pub e: &'a [f64],
    pub u: &'a [f64],
    pub start_s: f64,
}

/// Criterion for one or several records.
#[derive(Debug, Clone)]
pub(crate) struct ChangeCriterion<'a> {
    pub layout: Layout,
    pub data: Vec<Data<'a>>,
    pub sample_time: SampleTime,
    /// First sample with a residual; at least the largest nk plus nd.
    pub first: usize,
    pub limits: Vec<(f64, f64)>,
    /// Piece of a sampling interval to which the delay is restricted ([`Layout::piece_count`]); `None` if the delay
    /// itself determines the piece.
    pub piece: Option<usize>,
    /// False for a model without a change, whose initial parameters are valid throughout.
    pub changes: bool,
    /// Weights of the residuals of each record, starting at the first residual; `None` if all weights are equal.
    pub weights: Option<Vec<Vec<f64>>>,
    /// Prior knowledge about the parameters.
    pub penalty: Vec<Penalty>,
    /// True if a level of u is estimated for each record.
    pub level: bool,
}

/// Signals of one record for one theta.
#[derive(Debug)]
pub(crate) struct Pass {
    unit: UnitOperator,
    /// Error of the record, preceded by the errors that represent the initial state.
    input: Vec<f64>,
    /// Responses y_i to the input.
    y: Vec<Vec<f64>>,
    /// Numerators at each sample, starting at the first regressed sample.
    gains: Vec<SigmoidPoint>,
    /// `u - w`, starting at the first regressed sample.
    v: Vec<f64>,
    /// Weighted residuals.
    pub eps: Vec<f64>,
    basis: Vec<Vec<f64>>,
    /// Level of u, and the norm of the column of the level after the columns of the states have been projected out.
    pub level: Option<(f64, f64)>,
}

/// Returns `sum_i of(instant, i) y_i` with the length of the shortest y_i.
fn combine(gains: &[SigmoidPoint], y: &[&[f64]], of: impl Fn(&SigmoidPoint, usize) -> f64) -> Vec<f64> {
    let length = y.iter().map(|y| y.len()).fold(gains.len(), usize::min);
    (0..length)
        .map(|t| {
            let first = of(&gains[t], 0) * y[0][t];
            (1..y.len()).fold(first, |sum, i| sum + of(&gains[t], i) * y[i][t])
        })
        .collect()
}

impl ChangeCriterion<'_> {
    /// Returns the number of residuals in all records.
    pub fn residual_count(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Returns the number of initial states and levels in all records.
    pub fn state_count(&self) -> usize {
        (self.layout.order() + usize::from(self.level)) * self.data.len()
    }

    /// Returns the contribution of the prior to the sum of squares.
    pub fn penalty_at(&self, theta: &[f64]) -> f64 {
        self.penalties().map(|penalty| penalty.at(theta)).sum()
    }

    /// Returns the penalties of the prior. For a model without a change, the penalties of the parameters that only a
    /// change has are omitted.
    fn penalties(&self) -> impl Iterator<Item = &Penalty> {
        let last = self.layout.change_indices();
        (self.penalty.iter()).filter(move |penalty| self.changes || !last.contains(&penalty.index))
    }

    /// Returns the unweighted residuals of one record, starting at [`ChangeCriterion::first`].
    pub fn residuals_of(&self, theta: &[f64], record: usize) -> Option<Vec<f64>> {
        let mut eps = self.pass(theta, record)?.eps;
        if let Some(weights) = &self.weights {
            eps.iter_mut().zip(&weights[record]).for_each(|(x, w)| *x /= w);
        }
        Some(eps)
    }

    /// Returns `D x` with the weights of the record, for a signal that starts at the first regressed sample.
    fn whiten(&self, theta: &[f64], record: usize, x: &[f64]) -> Vec<f64> {
        let nd = self.layout.nd;
        let mut y = x[nd..].to_vec();
        for (i, &d) in theta[self.layout.noise..].iter().enumerate() {
            add_scaled(&mut y, d, &x[nd - 1 - i..x.len() - 1 - i]);
        }
        self.weigh(record, &mut y);
        y
    }

    fn weigh(&self, record: usize, x: &mut [f64]) {
        if let Some(weights) = &self.weights {
            x.iter_mut().zip(&weights[record]).for_each(|(x, w)| *x *= w);
        }
    }

    /// Returns the delayed numerators at each sample, starting at the first regressed sample.
    fn sigmoid_points(&self, theta: &[f64], record: usize) -> Vec<SigmoidPoint> {
        let (from, data) = (self.first - self.layout.nd, self.data[record]);
        let at = |t: usize| data.start_s + t as f64 * self.sample_time.s() - theta[self.layout.delay];
        (from..data.u.len())
            .map(|t| {
                if !self.changes {
                    return SigmoidPoint::constant(&self.layout, theta);
                }
                SigmoidPoint::at(&self.layout, theta, at(t))
            })
            .collect()
    }

    pub fn pass(&self, theta: &[f64], record: usize) -> Option<Pass> {
        let unit = UnitOperator::of(&self.layout, theta, self.piece, self.sample_time)?;
        let data = self.data[record];
        let layout = &self.layout;
        let (nd, past_errors) = (layout.nd, layout.order());
        let (n, from) = (data.u.len(), self.first - nd);
        if unit.nk + layout.direct_sample_count() > from || self.first >= n {
            return None;
        }
        // Index of the oldest unknown error. With a direct part the errors act for two more samples.
        let oldest = match layout.form {
            Form::Lead => 0,
            _ => from - unit.nk - layout.direct_sample_count(),
        };
        let mut input = vec![0.0; past_errors];
        input.extend_from_slice(&data.e[..n - unit.nk]);
        let powers = unit.b.len();
        let mut y: Vec<Vec<f64>> = (0..powers).map(|i| unit.response(i, &input)).collect();
        // Sample t has the index t - nk + past_errors.
        let input_start = from + past_errors - unit.nk;
        let gains = self.sigmoid_points(theta, record);
        let respond = |y: &[&[f64]]| combine(&gains, y, SigmoidPoint::numerator);
        let w = respond(&y.iter().map(|y| &y[input_start..]).collect::<Vec<_>>());
        let mut v: Vec<f64> = data.u[from..].iter().zip(&w).map(|(u, w)| u - w).collect();
        let mut eps = self.whiten(theta, record, &v);

        // Responses to the unknown errors, starting with the oldest error.
        let h: Vec<Vec<f64>> = (0..powers).map(|i| unit.impulse_response(i, input.len())).collect();
        let mut free: Vec<Vec<f64>> = (0..past_errors)
            .map(|age| {
                let tails: Vec<&[f64]> = h
                    .iter()
                    .map(|h| h.get(input_start - oldest - age..).unwrap_or(&[]))
                    .collect();
                let mut column = respond(&tails);
                // The filter D makes the response longer.
                column.resize((column.len().max(past_errors) + nd).min(n - from), 0.0);
                column
            })
            .collect();
        if self.level {
            free.push(vec![1.0; n - from]);
        }
        let columns = free.iter().map(|x| self.whiten(theta, record, x)).collect();
        let (basis, taken) = eliminate(columns, &mut eps);
        for (&(x, _), column) in taken.iter().zip(&free) {
            add_scaled(&mut v, -x, column);
        }
        for (age, &(x, _)) in taken[..past_errors].iter().enumerate() {
            let position = oldest + age;
            input[position] += x;
            for (y, h) in y.iter_mut().zip(&h) {
                let common = h.len().min(y.len() - position);
                add_scaled(&mut y[position..], x, &h[..common]);
            }
        }
        Some(Pass {
            unit,
            input,
            y,
            gains,
            v,
            eps,
            basis,
            level: taken.get(past_errors).copied(),
        })
    }

    /// Returns the level of u in one record at a minimum, and its variance for this innovation variance and this
    /// covariance of theta. Given theta, the variance is `sigma^2/r^2`, where q r is the component of the level's
    /// column orthogonal to the columns of the states and r its length. The uncertainty of theta is added along
    /// `dc/dtheta = -q' psi/r`.
    pub fn level_of(&self, theta: &[f64], record: usize, variance: f64, covariance: &[f64]) -> Option<(f64, f64)> {
        let pass = self.pass(theta, record)?;
        let (value, length) = pass.level.filter(|(_, length)| *length > 0.0)?;
        let q = pass.basis.last()?;
        let columns = self.columns(theta, record, &pass);
        let slope: Vec<f64> = columns.iter().map(|x| -dot(q, &x[..q.len()]) / length).collect();
        Some((value, variance / (length * length) + variance_along(&slope, covariance)))
    }

    /// Returns the weighted columns of psi in one record, before projection.
    fn columns(&self, theta: &[f64], record: usize, pass: &Pass) -> Vec<Vec<f64>> {
        let (layout, gains) = (&self.layout, &pass.gains);
        let input_start = self.first - layout.nd + layout.order() - pass.unit.nk;
        let y: Vec<&[f64]> = pass.y.iter().map(|y| &y[input_start..]).collect();
        // Derivatives with respect to the gain; derivatives with respect to each other parameter, divided by the gain.
        let along: Vec<Vec<f64>> = (0..layout.varying)
            .map(|j| match j.checked_sub(1) {
                None => combine(gains, &y, |g, i| g.shape[i]),
                Some(j) => combine(gains, &y, |g, i| g.slopes[j][i]),
            })
            .collect();
        let steps: Vec<f64> = (0..layout.varying)
            .map(Layout::end_indices)
            .map(|[first, last]| theta[last] - theta[first])
            .collect();
        let mapped = |of: &dyn Fn(usize, &SigmoidPoint) -> f64| {
            let values: Vec<f64> = gains.iter().enumerate().map(|(t, g)| of(t, g)).collect();
            self.whiten(theta, record, &values)
        };
        let by_share = |t: usize, g: &SigmoidPoint| {
            (1..layout.varying).fold(steps[0] * along[0][t], |sum, j| sum + steps[j] * g.gain() * along[j][t])
        };
        let mut columns = vec![Vec::new(); theta.len()];
        for (j, along) in along.iter().enumerate() {
            let [first, last] = Layout::end_indices(j);
            if j == 0 {
                columns[first] = mapped(&|t, g| (1.0 - g.share) * along[t]);
                columns[last] = mapped(&|t, g| g.share * along[t]);
            } else {
                columns[first] = mapped(&|t, g| (1.0 - g.share) * g.gain() * along[t]);
                columns[last] = mapped(&|t, g| g.share * g.gain() * along[t]);
            }
        }
        columns[layout.midpoint] = mapped(&|t, g| g.derivative_midpoint * by_share(t, g));
        columns[layout.log_rate] = mapped(&|t, g| g.derivative_log_rate * by_share(t, g));
        for (p, position) in layout.pole_indices().into_iter().enumerate() {
            let slopes: Vec<Vec<f64>> = (0..y.len())
                .map(|i| pass.unit.slope(i, p, &pass.input, &pass.y[i]))
                .collect();
            let slopes: Vec<&[f64]> = slopes.iter().map(|slope| &slope[input_start..]).collect();
            columns[position] = self.whiten(theta, record, &combine(gains, &slopes, SigmoidPoint::numerator));
        }
        // A longer delay also delays the change.
        let (head, tail) = columns.split_at_mut(layout.delay);
        add_scaled(&mut tail[0], 1.0, &head[layout.midpoint]);
        for i in 0..layout.nd {
            let mut column: Vec<f64> = pass.v[layout.nd - 1 - i..pass.v.len() - 1 - i]
                .iter()
                .map(|v| -v)
                .collect();
            self.weigh(record, &mut column);
            columns[layout.noise + i] = column;
        }
        columns
    }
}

/// Projects the columns out of eps. Returns their orthonormal basis and, for each column, its coefficient and the norm
/// of its part orthogonal to the previous columns.
fn eliminate(columns: Vec<Vec<f64>>, eps: &mut [f64]) -> (Vec<Vec<f64>>, Vec<(f64, f64)>) {
    let count = columns.len();
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(count);
    // columns[j] = sum over l of basis[l] r[j][l].
    let mut r: Vec<Vec<f64>> = Vec::with_capacity(count);
    let mut kept = Vec::with_capacity(count);
    for (j, mut column) in columns.into_iter().enumerate() {
        let size = dot(&column, &column).sqrt();
        let mut row = vec![0.0; basis.len()];
        // Two passes give orthogonality to rounding accuracy.
        for _ in 0..2 {
            for (q, component) in basis.iter().zip(&mut row) {
                let common = q.len().min(column.len());
                let part = dot(&q[..common], &column[..common]);
                *component += part;
                if column.len() < q.len() {
                    column.resize(q.len(), 0.0);
                }
                add_scaled(&mut column, -part, q);
            }
        }
        let rest = dot(&column, &column).sqrt();
        if rest.is_nan() || rest <= 1e-10 * size {
            continue;
        }
        column.iter_mut().for_each(|x| *x /= rest);
        row.push(rest);
        basis.push(column);
        r.push(row);
        kept.push(j);
    }
    let mut taken: Vec<f64> = basis.iter().map(|q| dot(q, &eps[..q.len()])).collect();
    for (q, &part) in basis.iter().zip(&taken) {
        add_scaled(eps, -part, q);
    }
    for k in (0..taken.len()).rev() {
        taken[k] /= r[k][k];
        for l in 0..k {
            taken[l] -= r[k][l] * taken[k];
        }
    }
    let mut all = vec![(0.0, 0.0); count];
    for (k, (&j, &x)) in kept.iter().zip(&taken).enumerate() {
        all[j] = (x, r[k][k]);
    }
    (basis, all)
}

impl Objective for ChangeCriterion<'_> {
    fn is_feasible(&self, theta: &[f64]) -> bool {
        theta.iter().all(|v| v.is_finite())
            && self
                .layout
                .neuromuscular_indices
                .is_none_or(|[_, zeta]| theta[zeta] > 0.0)
            && UnitOperator::of(&self.layout, theta, self.piece, self.sample_time)
                .is_some_and(|unit| unit.nk + self.layout.direct_sample_count() + self.layout.nd <= self.first)
    }

    fn linearise(&self, theta: &[f64], _: &mut Workspace) -> Linearisation {
        let p = theta.len();
        let mut total = Linearisation {
            sum_of_squares: 0.0,
            descent: vec![0.0; p],
            gram: vec![0.0; p * p],
        };
        for record in 0..self.data.len() {
            let Some(pass) = self.pass(theta, record) else {
                // The signals are missing only if theta is not feasible.
                total.sum_of_squares = f64::NAN;
                return total;
            };
            total.sum_of_squares += dot(&pass.eps, &pass.eps);
            let columns = self.columns(theta, record, &pass);
            let components: Vec<Vec<f64>> = columns
                .iter()
                .map(|x| pass.basis.iter().map(|q| dot(q, &x[..q.len()])).collect())
                .collect();
            for i in 0..p {
                total.descent[i] += dot(&columns[i], &pass.eps);
                for j in 0..=i {
                    let product = dot(&columns[i], &columns[j]) - dot(&components[i], &components[j]);
                    total.gram[i * p + j] += product;
                    if i != j {
                        total.gram[j * p + i] += product;
                    }
                }
            }
        }
        self.penalties().for_each(|penalty| penalty.add_to(theta, &mut total));
        for i in 0..p {
            // A parameter without any effect at this theta would make the matrix singular; a diagonal element of one
            // keeps the parameter constant.
            if total.gram[i * p + i] <= 0.0 {
                total.descent[i] = 0.0;
                for j in 0..p {
                    (total.gram[i * p + j], total.gram[j * p + i]) = (0.0, 0.0);
                }
                total.gram[i * p + i] = 1.0;
            }
        }
        total
    }

    fn output_power(&self) -> f64 {
        self.data.iter().map(|d| dot(d.u, d.u)).sum()
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        Some(&self.limits)
    }
}

#[cfg(test)]
mod family_tests;
#[cfg(test)]
mod tests;
