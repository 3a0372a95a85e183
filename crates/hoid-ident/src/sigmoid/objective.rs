//! The prediction-error criterion of an operator that changes.
//!
//! With y1 and y2 the responses of `omega^2/(s^2 + 2 zeta omega s + omega^2) e^{-tau s}` and of s
//! times that to the held error,
//!
//! `w(t) = K_e(t - tau) y1(t) + K_e_dot(t - tau) y2(t)`,  `v = u - w`,  `eps = D v`,
//!
//! because the delay stands behind the gains. y1 and y2 have one F and one state in common, which
//! the gains do not touch, so that y_i = (B_i/F) q^-nk e holds throughout
//! ([`hoid_model::delayed_operator`], linear in the gains), and
//! `F dy_i/dp = (dB_i/dp) q^-nk e - (dF/dp) y_i`.
//!
//! **Initial states.** The state of the operator where a record begins is unknown, two numbers. Any
//! state is reached from rest by two held errors before the record; those are the unknowns, so that
//! the same filters give the responses to them and all derivatives. They enter eps linearly and are
//! eliminated exactly for each theta, as in [`crate::criterion::initial_state_responses`]:
//! `eps = (I - Q Q') eps_0`, psi with the best states, `psi' (I - Q Q') psi` (G. H. Golub and V.
//! Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413-432; L. Kaufman, *BIT* 15 (1975) 49-57).

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{
    SampleTime,
    delayed_operator::{delayed_operator_and_jacobian_within, whole_samples},
};

use super::layout::{DELAY, Instant, K_E, LOG_RATE, MIDPOINT, NOISE, OMEGA, T_L, ZETA};
use crate::{
    criterion::Workspace,
    linalg::least_squares::{add_scaled, dot},
    optimize::Linearisation,
    optimize::Objective,
};

/// Held errors before the record that stand for its initial state.
const PAST: usize = 2;

/// Input, output and start of one record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Data<'a> {
    pub e: &'a [f64],
    pub u: &'a [f64],
    pub start_s: f64,
}

/// The criterion over one or several records.
#[derive(Debug, Clone)]
pub(crate) struct ChangeCriterion<'a> {
    pub data: Vec<Data<'a>>,
    pub sample_time: SampleTime,
    pub nd: usize,
    /// First sample whose residual counts; at least the longest nk plus nd.
    pub first: usize,
    pub limits: Vec<(f64, f64)>,
    /// Sample in which the delay is held; by the delay itself where there is none.
    pub sample: Option<usize>,
    /// False for the model whose first state holds throughout.
    pub changes: bool,
    /// Weights of the residuals of each record, from the first residual on; none where all count
    /// the same.
    pub weights: Option<Vec<Vec<f64>>>,
}

/// The operator with unit gains at one theta, and the derivatives for omega, zeta and tau.
#[derive(Debug, Clone)]
pub(crate) struct UnitOperator {
    pub nk: usize,
    pub b: [[f64; 3]; 2],
    pub f: [f64; 2],
    b_slopes: [[[f64; 3]; 3]; 2],
    f_slopes: [[f64; 2]; 3],
}

/// Signals of one record at one theta.
#[derive(Debug)]
pub(crate) struct Pass {
    unit: UnitOperator,
    /// The error with the past in front.
    input: Vec<f64>,
    /// Responses to it.
    y: [Vec<f64>; 2],
    /// Gains from the first regressed sample on.
    gains: Vec<Instant>,
    /// `u - w` from the first regressed sample on.
    v: Vec<f64>,
    /// Weighted residuals.
    pub eps: Vec<f64>,
    basis: Vec<Vec<f64>>,
}

impl UnitOperator {
    /// `None` where theta has no meaning.
    pub fn of(theta: &[f64], sample: Option<usize>, ts: SampleTime) -> Option<Self> {
        let at = |gains: [f64; 2]| [gains[0], gains[1], theta[OMEGA], theta[ZETA], theta[DELAY]];
        let sample = match sample {
            Some(sample) => sample,
            None => whole_samples(theta[DELAY], ts).ok()?,
        };
        let (held, by_gain) = delayed_operator_and_jacobian_within(sample, at([1.0, 0.0]), ts).ok()?;
        let (_, by_rate) = delayed_operator_and_jacobian_within(sample, at([0.0, 1.0]), ts).ok()?;
        let jacobians = [by_gain, by_rate];
        let column = |side: usize, j: usize| std::array::from_fn(|i| jacobians[side][i][j]);
        Some(Self {
            nk: held.nk,
            b: [column(0, 0), column(0, 1)],
            f: held.f,
            b_slopes: std::array::from_fn(|side| std::array::from_fn(|p| column(side, 2 + p))),
            f_slopes: std::array::from_fn(|p| [jacobians[0][3][2 + p], jacobians[0][4][2 + p]]),
        })
    }

    /// `y_i` for an input with the past in front.
    pub fn response(&self, i: usize, input: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; input.len()];
        fir(&self.b[i], 0, input, &mut y);
        divide_in_place(&self.f, &mut y);
        y
    }

    /// Derivative of `y_i` for the p-th of omega, zeta and tau.
    fn slope(&self, i: usize, p: usize, input: &[f64], y: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; input.len()];
        fir(&self.b_slopes[i][p], 0, input, &mut x);
        for (lag, &slope) in self.f_slopes[p].iter().enumerate().filter(|(_, s)| **s != 0.0) {
            add_scaled(&mut x[lag + 1..], -slope, &y[..y.len() - lag - 1]);
        }
        divide_in_place(&self.f, &mut x);
        x
    }

    /// Response of `B_i/F` to a unit input, until it has died away or `longest` is reached.
    fn impulse_response(&self, i: usize, longest: usize) -> Vec<f64> {
        let mut h: Vec<f64> = Vec::with_capacity(longest.min(4096));
        let (mut before, mut earlier, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for t in 0..longest {
            let drive = self.b[i].get(t).copied().unwrap_or(0.0);
            let y = (drive - self.f[1] * earlier) - self.f[0] * before;
            (earlier, before) = (before, y);
            largest = largest.max(y.abs());
            h.push(y);
            if t > 3 && y.abs().max(earlier.abs()) < 1e-20 * largest {
                break;
            }
        }
        h
    }
}

impl ChangeCriterion<'_> {
    /// Number of residuals over all records.
    pub fn residuals(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Number of initial states over all records.
    pub fn states(&self) -> usize {
        PAST * self.data.len()
    }

    /// Residuals of one record from [`ChangeCriterion::first`] on, not weighted.
    pub fn residuals_of(&self, theta: &[f64], record: usize) -> Option<Vec<f64>> {
        let mut eps = self.pass(theta, record)?.eps;
        if let Some(weights) = &self.weights {
            eps.iter_mut().zip(&weights[record]).for_each(|(x, w)| *x /= w);
        }
        Some(eps)
    }

    /// `D x` with the weights of the record, of a signal from the first regressed sample on.
    fn whitened(&self, theta: &[f64], record: usize, x: &[f64]) -> Vec<f64> {
        let mut y = x[self.nd..].to_vec();
        for (i, &d) in theta[NOISE..].iter().enumerate() {
            add_scaled(&mut y, d, &x[self.nd - 1 - i..x.len() - 1 - i]);
        }
        self.weigh(record, &mut y);
        y
    }

    fn weigh(&self, record: usize, x: &mut [f64]) {
        if let Some(weights) = &self.weights {
            x.iter_mut().zip(&weights[record]).for_each(|(x, w)| *x *= w);
        }
    }

    /// Parameters in force behind the delay at each sample from the first regressed one on.
    fn gains(&self, theta: &[f64], record: usize) -> Vec<Instant> {
        let (from, data) = (self.first - self.nd, self.data[record]);
        let at = |t: usize| data.start_s + t as f64 * self.sample_time.s() - theta[DELAY];
        (from..data.u.len())
            .map(|t| {
                if !self.changes {
                    return Instant::constant(theta);
                }
                Instant::at(theta, at(t))
            })
            .collect()
    }

    pub fn pass(&self, theta: &[f64], record: usize) -> Option<Pass> {
        let unit = UnitOperator::of(theta, self.sample, self.sample_time)?;
        let data = self.data[record];
        let (n, from) = (data.u.len(), self.first - self.nd);
        if unit.nk > from || self.first >= n {
            return None;
        }
        let mut input = vec![0.0; PAST];
        input.extend_from_slice(&data.e[..n - unit.nk]);
        let mut y = [unit.response(0, &input), unit.response(1, &input)];
        // Sample t stands at t - nk + PAST.
        let begin = from + PAST - unit.nk;
        let gains = self.gains(theta, record);
        let respond = |y1: &[f64], y2: &[f64]| -> Vec<f64> {
            let pairs = y1.iter().zip(y2).zip(&gains);
            pairs.map(|((a, b), g)| g.k_e * a + g.k_e_dot() * b).collect()
        };
        let w = respond(&y[0][begin..], &y[1][begin..]);
        let mut v: Vec<f64> = data.u[from..].iter().zip(&w).map(|(u, w)| u - w).collect();
        let mut eps = self.whitened(theta, record, &v);

        // Responses to the two errors before the record, the older one first.
        let h = [
            unit.impulse_response(0, input.len()),
            unit.impulse_response(1, input.len()),
        ];
        let free: Vec<Vec<f64>> = (0..PAST)
            .map(|age| {
                let tail = |h: &'_ Vec<f64>| h.get(begin - age..).unwrap_or(&[]).to_vec();
                let mut column = respond(&tail(&h[0]), &tail(&h[1]));
                // Room for D behind its end.
                column.resize((column.len().max(PAST) + self.nd).min(n - from), 0.0);
                column
            })
            .collect();
        let columns = free.iter().map(|x| self.whitened(theta, record, x)).collect();
        let (basis, past) = eliminate(columns, &mut eps);
        for (age, &x) in past.iter().enumerate() {
            input[age] = x;
            for (y, h) in y.iter_mut().zip(&h) {
                add_scaled(&mut y[age..], x, h);
            }
            add_scaled(&mut v, -x, &free[age]);
        }
        Some(Pass {
            unit,
            input,
            y,
            gains,
            v,
            eps,
            basis,
        })
    }

    /// Columns of psi in one record, weighted, not projected.
    fn columns(&self, theta: &[f64], record: usize, pass: &Pass) -> Vec<Vec<f64>> {
        let begin = self.first - self.nd + PAST - pass.unit.nk;
        let [y1, y2] = [&pass.y[0][begin..], &pass.y[1][begin..]];
        let map = |f: &dyn Fn(&Instant, f64, f64) -> f64| -> Vec<f64> {
            let rows = pass.gains.iter().zip(y1).zip(y2);
            self.whitened(
                theta,
                record,
                &rows.map(|((g, a), b)| f(g, *a, *b)).collect::<Vec<f64>>(),
            )
        };
        let (step_k, step_t) = (theta[K_E[1]] - theta[K_E[0]], theta[T_L[1]] - theta[T_L[0]]);
        let by_share = |g: &Instant, a: f64, b: f64| step_k * (a + g.t_l * b) + step_t * g.k_e * b;
        let mut columns = vec![Vec::new(); theta.len()];
        columns[K_E[0]] = map(&|g, a, b| (1.0 - g.share) * (a + g.t_l * b));
        columns[K_E[1]] = map(&|g, a, b| g.share * (a + g.t_l * b));
        columns[T_L[0]] = map(&|g, _, b| (1.0 - g.share) * g.k_e * b);
        columns[T_L[1]] = map(&|g, _, b| g.share * g.k_e * b);
        columns[MIDPOINT] = map(&|g, a, b| g.by_midpoint * by_share(g, a, b));
        columns[LOG_RATE] = map(&|g, a, b| g.by_log_rate * by_share(g, a, b));
        for (p, place) in [OMEGA, ZETA, DELAY].into_iter().enumerate() {
            let slopes: [Vec<f64>; 2] = std::array::from_fn(|i| pass.unit.slope(i, p, &pass.input, &pass.y[i]));
            let rows = pass.gains.iter().zip(&slopes[0][begin..]).zip(&slopes[1][begin..]);
            let column: Vec<f64> = rows.map(|((g, a), b)| g.k_e * a + g.k_e_dot() * b).collect();
            columns[place] = self.whitened(theta, record, &column);
        }
        // A longer delay takes the change along.
        let (head, tail) = columns.split_at_mut(DELAY);
        add_scaled(&mut tail[0], 1.0, &head[MIDPOINT]);
        for i in 0..self.nd {
            let mut column: Vec<f64> = pass.v[self.nd - 1 - i..pass.v.len() - 1 - i]
                .iter()
                .map(|v| -v)
                .collect();
            self.weigh(record, &mut column);
            columns[NOISE + i] = column;
        }
        columns
    }
}

/// Takes the best combination of the columns out of eps; returns their orthonormal basis and how
/// much of each was taken in.
fn eliminate(columns: Vec<Vec<f64>>, eps: &mut [f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let count = columns.len();
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(count);
    // columns[j] = sum over l of basis[l] r[j][l].
    let mut r: Vec<Vec<f64>> = Vec::with_capacity(count);
    let mut kept = Vec::with_capacity(count);
    for (j, mut column) in columns.into_iter().enumerate() {
        let size = dot(&column, &column).sqrt();
        let mut row = vec![0.0; basis.len()];
        // Twice, for orthogonality to rounding.
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
    let mut all = vec![0.0; count];
    for (&j, &x) in kept.iter().zip(&taken) {
        all[j] = x;
    }
    (basis, all)
}

impl Objective for ChangeCriterion<'_> {
    type Workspace = Workspace;

    fn is_feasible(&self, theta: &[f64]) -> bool {
        theta.iter().all(|v| v.is_finite())
            && theta[ZETA] > 0.0
            && UnitOperator::of(theta, self.sample, self.sample_time)
                .is_some_and(|unit| unit.nk + self.nd <= self.first)
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
                // Only for a theta that is not feasible.
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
        for i in 0..p {
            // A parameter without any effect here would make the matrix singular; with a diagonal
            // of one it rests.
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
mod tests;
