//! The best numerators for given poles, delay, noise model and change, computed by linear least squares.
//!
//! The model is `u = sum_i (n_i1 (1 - s) + n_i2 s) y_i` with the share s of the change and the responses y_i, whitened
//! by D. The coefficients n before and after the change determine the parameters of the numerator. If the numerator has
//! fewer parameters than coefficients, the nearest parameters in the metric of the responses are used. A slow pole of
//! the operator has a state at the start of each record, which is an additional unknown.

use hoid_model::Form;

use super::{
    layout::{Layout, MAX_VARYING},
    objective::ChangeCriterion,
    sigmoid_point::SigmoidPoint,
    unit_operator::UnitOperator,
};
use crate::linalg::{
    least_squares::solve_symmetric,
    vectors::{add_scaled, dot},
};

/// Time before the first residual of the ranking, in time constants of the poles.
const SETTLING_TIME_CONSTANTS: f64 = 4.0;
/// Rate of decay that is assumed if there is no neuromuscular part, 1/s.
const DEFAULT_DECAY_RATE: f64 = 10.0;
/// Lead time constants tried for a squared lead, s: first value, factor, number.
const LEAD_SCAN_S: (f64, f64, usize) = (0.02, 1.12, 60);

/// Responses for given poles, delay and noise model.
pub(super) struct Ranking<'c, 'a> {
    pub criterion: &'c ChangeCriterion<'a>,
    theta: Vec<f64>,
    /// For each record: the first sample with a residual, and the responses and u, both starting nd samples earlier.
    signals: Vec<(usize, Vec<Vec<f64>>, Vec<f64>)>,
}

impl<'c, 'a> Ranking<'c, 'a> {
    pub fn new(criterion: &'c ChangeCriterion<'a>, theta: &[f64]) -> Option<Self> {
        let layout = &criterion.layout;
        let unit = UnitOperator::of(layout, theta, None, criterion.sample_time)?;
        let decay = layout
            .neuromuscular_indices
            .map_or(DEFAULT_DECAY_RATE, |[omega, zeta]| theta[omega] * theta[zeta]);
        let ts = criterion.sample_time.s();
        let mut signals = Vec::with_capacity(criterion.data.len());
        for data in &criterion.data {
            let n = data.u.len();
            let settled = ((SETTLING_TIME_CONSTANTS / (decay * ts)) as usize).min(n / 8);
            let first = criterion.first + settled;
            if first >= n || unit.nk > first - layout.nd {
                return None;
            }
            let from = first - layout.nd;
            let y = |i: usize| unit.response(i, &data.e[..n - unit.nk])[from - unit.nk..].to_vec();
            signals.push((first, (0..unit.b.len()).map(y).collect(), data.u[from..].to_vec()));
        }
        Some(Self {
            criterion,
            theta: theta.to_vec(),
            signals,
        })
    }

    /// Returns the sum of squares and the parameters of the numerator before and after the change, in the order of
    /// theta, by least squares. t_M and G come from the theta `change`. If `change` is `None`, the parameters before
    /// and after the change are equal.
    pub fn best_gains(&self, change: Option<&[f64]>) -> Option<(f64, Vec<f64>)> {
        let powers = self.power_count();
        let ends = if change.is_some() { 2 } else { 1 };
        let of_states = if self.has_slow_state() { self.signals.len() } else { 0 };
        let count = ends * powers + of_states;
        let mut gram = vec![0.0; count * count];
        let mut rhs = vec![0.0; count];
        let mut power = 0.0;
        for (record, (_, y, u)) in self.signals.iter().enumerate() {
            let mut columns: Vec<Vec<f64>> = match change {
                None => y.iter().map(|y| self.whiten(y)).collect(),
                Some(theta) => {
                    let share = self.change_shares(theta, record);
                    let split = |y: &Vec<f64>| -> [Vec<f64>; 2] {
                        let last: Vec<f64> = y.iter().zip(&share).map(|(y, s)| s * y).collect();
                        let initial: Vec<f64> = y.iter().zip(&last).map(|(y, l)| y - l).collect();
                        [self.whiten(&initial), self.whiten(&last)]
                    };
                    y.iter().flat_map(split).collect()
                }
            };
            if of_states > 0 {
                columns.push(self.whiten(&self.slow_state(u.len())));
            }
            // The initial states of other records have no effect on this record.
            let index = |i: usize| if i < ends * powers { i } else { i + record };
            let target = self.whiten(u);
            power += dot(&target, &target);
            for i in 0..columns.len() {
                rhs[index(i)] += dot(&columns[i], &target);
                for j in 0..=i {
                    let product = dot(&columns[i], &columns[j]);
                    gram[index(i) * count + index(j)] += product;
                    if i != j {
                        gram[index(j) * count + index(i)] += product;
                    }
                }
            }
        }
        let found = solve_symmetric(&gram, &rhs)?;
        let rank = power - dot(&found, &rhs);
        let mut values = vec![0.0; 2 * self.criterion.layout.varying];
        for end in 0..2 {
            let index = |i: usize| ends * i + end.min(ends - 1);
            let numerator: Vec<f64> = (0..powers).map(|i| found[index(i)]).collect();
            let metric = |i: usize, j: usize| gram[index(i) * count + index(j)];
            let of_end = parameters(self.criterion.layout.form, &numerator, metric);
            for (i, value) in of_end.into_iter().enumerate().take(self.criterion.layout.varying) {
                values[Layout::end_indices(i)[end]] = value;
            }
        }
        (rank.is_finite() && values.iter().all(|g| g.is_finite())).then_some((rank, values))
    }

    /// Returns the part of u in each record that neither the operator of theta nor its initial state explains.
    pub fn unexplained_output(&self, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        let (layout, mut all) = (&self.criterion.layout, Vec::new());
        for (record, (first, y, u)) in self.signals.iter().enumerate() {
            let times = self.times(theta, record, *first, u.len());
            let mut v: Vec<f64> = u
                .iter()
                .zip(times)
                .enumerate()
                .map(|(k, (u, t))| {
                    let here = SigmoidPoint::at(layout, theta, t);
                    (0..y.len()).fold(*u, |v, i| v - here.numerator(i) * y[i][k])
                })
                .collect();
            if self.has_slow_state() {
                let state = self.slow_state(v.len());
                let part = dot(&state, &v) / dot(&state, &state);
                add_scaled(&mut v, -part, &state);
            }
            all.push(v);
        }
        all.iter().flatten().all(|v| v.is_finite()).then_some(all)
    }

    fn power_count(&self) -> usize {
        self.criterion.layout.form.degree() + 1
    }

    fn has_slow_state(&self) -> bool {
        self.criterion.layout.form.has_pole()
    }

    /// Returns the free response of the pole of a lag or an integration: an exponential, or a constant.
    fn slow_state(&self, n: usize) -> Vec<f64> {
        let rate = self.criterion.layout.lag.map_or(0.0, |index| self.theta[index]);
        let per_sample = (-rate * self.criterion.sample_time.s()).exp();
        std::iter::successors(Some(1.0), |x| Some(x * per_sample))
            .take(n)
            .collect()
    }

    /// Returns the times of the samples of a record minus the delay, starting nd samples before `first`.
    fn times(&self, theta: &[f64], record: usize, first: usize, n: usize) -> impl Iterator<Item = f64> {
        let (data, ts) = (&self.criterion.data[record], self.criterion.sample_time.s());
        let from = first - self.criterion.layout.nd;
        let (start_s, delay) = (data.start_s, theta[self.criterion.layout.delay]);
        (0..n).map(move |k| start_s + (from + k) as f64 * ts - delay)
    }

    fn change_shares(&self, theta: &[f64], record: usize) -> Vec<f64> {
        let (first, _, u) = &self.signals[record];
        let times = self.times(theta, record, *first, u.len());
        times
            .map(|t| SigmoidPoint::at(&self.criterion.layout, theta, t).share)
            .collect()
    }

    fn whiten(&self, x: &[f64]) -> Vec<f64> {
        let nd = self.criterion.layout.nd;
        let mut y = x[nd..].to_vec();
        for (i, &d) in self.theta[self.criterion.layout.noise..].iter().enumerate() {
            add_scaled(&mut y, d, &x[nd - 1 - i..x.len() - 1 - i]);
        }
        y
    }
}

/// Returns the parameters of the numerator `n_0 + n_1 s + n_2 s^2`.
fn parameters(form: Form, n: &[f64], metric: impl Fn(usize, usize) -> f64) -> [f64; MAX_VARYING] {
    // If the gain is zero, the lead time constant is set to zero.
    let over = |x: f64, gain: f64| if gain == 0.0 { 0.0 } else { x / gain };
    match form {
        Form::Gain | Form::Lag => [n[0], 0.0, 0.0],
        Form::Lead | Form::LeadLag => [n[0], over(n[1], n[0]), 0.0],
        Form::QuadraticIntegral => [n[0], over(n[1], n[0]), over(n[2], n[0])],
        Form::Derivative => [n[1], 0.0, 0.0],
        // The first power of s with a coefficient gives the gain.
        Form::Canals | Form::CanalsRate => {
            let (shape, _) = form.shape(&[]);
            let first = shape.iter().position(|m| *m != 0.0).unwrap_or(0);
            [over(n[first], shape[first]), 0.0, 0.0]
        }
        Form::DerivativeLead => [n[1], over(n[2], n[1]), 0.0],
        Form::Lead2 | Form::Lead2Lag => squared_lead(form, n, metric),
        Form::LeadDroop => {
            // n = k (alpha, 1 + T alpha, T): k is a root of k^2 - n_1 k + n_0 n_2.
            let root = (n[1] * n[1] - 4.0 * n[0] * n[2]).max(0.0).sqrt();
            let k = 0.5 * (n[1] + root.copysign(n[1]));
            [k, over(n[2], k), over(n[0], k)]
        }
    }
}

/// Returns the gain k and the lead time constant T for which `k (1, 2 T, T^2)` is nearest to n.
fn squared_lead(form: Form, n: &[f64], metric: impl Fn(usize, usize) -> f64) -> [f64; MAX_VARYING] {
    let product = |a: &[f64], b: &[f64]| {
        let pairs = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        pairs.map(|(i, j)| a[i] * metric(i, j) * b[j]).sum::<f64>()
    };
    let (mut t, by, count) = LEAD_SCAN_S;
    let (mut best, mut gained) = ([n[0], 0.0, 0.0], f64::NEG_INFINITY);
    for _ in 0..count {
        let (shape, _) = form.shape(&[t, 0.0]);
        let (along, size) = (product(&shape, n), product(&shape, &shape));
        if size > 0.0 && along * along / size > gained {
            gained = along * along / size;
            best = [along / size, t, 0.0];
        }
        t *= by;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_recovered_from_the_numerator() {
        for form in Form::ALL {
            let x = [3.0, 0.02 * 1.12_f64.powi(20), 0.4];
            let (shape, _) = form.shape(&x[1..]);
            let n: Vec<f64> = shape.iter().map(|m| 3.0 * m).collect();
            let found = parameters(form, &n, |i, j| f64::from(u8::from(i == j)));
            for i in 0..=form.shape_coordinate_count() {
                assert!((found[i] - x[i]).abs() < 1e-12, "{form}: {found:?}");
            }
        }
        assert_eq!(parameters(Form::Lead, &[0.0, 1.0], |_, _| 1.0), [0.0; 3]);
    }
}
