//! Least-squares solution of the loop equations, with a scan over the delay.

use hoid_model::{Complex64, ContinuousTransferFunction};

use super::spectra::Spectra;
use crate::linalg::{
    least_squares::LeastSquares,
    vectors::{add_scaled, dot},
};

/// Scan of the delay of the element, s: smallest delay, largest delay, step.
const DELAY_SCAN_S: (f64, f64, f64) = (-0.5, 0.3, 0.01);
/// Half width of the smoothing window of the residual spectrum, in natural logarithms of the frequency.
const SMOOTHING_HALF_WIDTH: f64 = 0.35;
/// Number of iterations in which the weights are computed.
const ROUND_COUNT: usize = 3;

/// Least-squares fit of an element with `m` zeros and `n` poles; coefficients in descending powers of s.
pub(super) struct ElementFit {
    pub(super) num: Vec<f64>,
    pub(super) den: Vec<f64>,
    pub(super) delay_s: f64,
    pub(super) unexplained_share: f64,
    /// Weights of each record.
    weights: Vec<Vec<f64>>,
}

impl ElementFit {
    pub(super) fn of(spectra: &[Spectra], m: usize, n: usize, sample_time_s: f64) -> Option<Self> {
        let mut weights: Vec<Vec<f64>> = spectra.iter().map(|s| vec![1.0; s.omega.len()]).collect();
        let mut num = vec![1.0];
        let mut best = None;
        for round in 0..ROUND_COUNT {
            let rows: Vec<Rows> = (spectra.iter().zip(&weights))
                .map(|(s, w)| Rows::of(s, w, &num, m, n))
                .collect();
            let (from, to, step) = DELAY_SCAN_S;
            let scan = (0..=((to - from) / step).round() as usize).map(|k| from + k as f64 * step);
            let found = best_solution(scan.flat_map(|delay| Solution::candidates(&rows, delay)))?;
            let near = (-4..=4).map(|k| found.delay_s + 0.25 * f64::from(k) * step.min(sample_time_s));
            let found = best_solution(near.flat_map(|delay| Solution::candidates(&rows, delay)))?;
            num = found.theta[n..=n + m].iter().rev().copied().collect();
            if round + 1 < ROUND_COUNT {
                let mut rest = found.residuals.as_slice();
                for (w, s) in weights.iter_mut().zip(spectra) {
                    let (own, after) = rest.split_at(2 * s.omega.len());
                    rest = after;
                    update_weights(w, own, &s.omega, found.power);
                }
            }
            best = Some(found);
        }
        let found = best?;
        let descending = |range: std::ops::Range<usize>| found.theta[range].iter().rev().copied();
        Some(Self {
            den: [1.0].into_iter().chain(descending(0..n)).collect(),
            num: descending(n..n + m + 1).collect(),
            delay_s: found.delay_s,
            unexplained_share: found.sum_of_squares / found.power,
            weights,
        })
    }

    /// Returns the delay beyond that of the given element at which this element explains most of the power, and the
    /// share that it leaves unexplained, with the weights of this fit. Delays of up to `aligned_s` are tried. `None`
    /// without power.
    pub(super) fn of_given(
        &self,
        spectra: &[Spectra],
        given: &ContinuousTransferFunction,
        aligned_s: f64,
    ) -> Option<(f64, f64)> {
        let scale = given.den().first()?.recip();
        let num: Vec<f64> = given.num().iter().map(|b| b * scale).collect();
        let den: Vec<f64> = given.den().iter().map(|a| a * scale).collect();
        let (m, n) = (num.len() - 1, den.len() - 1);
        let rows: Vec<Rows> = (spectra.iter().zip(&self.weights))
            .map(|(s, w)| Rows::of(s, w, &num, m, n))
            .collect();
        let shifts = (-3..=3).map(|k| f64::from(k) / 3.0 * aligned_s);
        shifts
            .filter_map(|shift| {
                let delay_s = given.delay_s() + shift;
                let shares = [delay_s, 0.0]
                    .map(|of_disturbances| unexplained_share(&rows, (&num, &den), delay_s, of_disturbances));
                let share = shares.into_iter().flatten().min_by(f64::total_cmp)?;
                Some((shift, share))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Returns the share of the power that an element with these coefficients, in descending powers of s, does not explain;
/// the coefficients of the targets and of the disturbances are free.
fn unexplained_share(
    rows: &[Rows<'_>],
    (num, den): (&[f64], &[f64]),
    delay_s: f64,
    of_disturbances_s: f64,
) -> Option<f64> {
    let m = num.len() - 1;
    let (mut right, mut of_u, mut free) = (Vec::new(), Vec::new(), Vec::<Vec<f64>>::new());
    for rows in rows {
        let mut own = rows.right.clone();
        let ascending = den.iter().rev();
        rows.a_columns
            .iter()
            .zip(ascending)
            .for_each(|(column, a)| add_scaled(&mut own, *a, column));
        let mut inputs = rows.input_columns(delay_s, of_disturbances_s);
        let disturbances = inputs.split_off(m + 1);
        let mut by_u = vec![0.0; own.len()];
        inputs
            .iter()
            .zip(num.iter().rev())
            .for_each(|(column, b)| add_scaled(&mut by_u, *b, column));
        add_scaled(&mut own, 1.0, &by_u);
        let others = disturbances.into_iter().chain(rows.c_columns.iter().cloned());
        for (j, column) in others.enumerate() {
            if free.len() <= j {
                free.push(Vec::new());
            }
            free[j].extend(column);
        }
        right.extend(own);
        of_u.extend(by_u);
    }
    let mut residuals = right.clone();
    if !free.is_empty() {
        let solved = LeastSquares::factor(&mut free.concat(), &mut right);
        if !solved.has_full_rank() {
            return None;
        }
        let theta = solved.solution();
        free.iter()
            .zip(theta)
            .for_each(|(column, x)| add_scaled(&mut residuals, -x, column));
    }
    add_scaled(&mut of_u, -1.0, &residuals);
    let power = dot(&of_u, &of_u);
    (power > 0.0).then(|| dot(&residuals, &residuals) / power)
}

/// The equations of one record: real and imaginary parts at all frequencies, made orthogonal to the columns of T.
struct Rows<'a> {
    spectra: &'a Spectra,
    /// Factor of the equation at each frequency: its weight divided by `B h`.
    factor: Vec<Complex64>,
    /// Orthonormal columns that span T.
    transient: Vec<Vec<f64>>,
    m: usize,
    /// Columns that do not depend on the delay: the columns of A (`a_columns`), the columns of C (`c_columns`), and the
    /// right-hand side `s^n E`.
    a_columns: Vec<Vec<f64>>,
    c_columns: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn of(spectra: &'a Spectra, weights: &[f64], num: &[f64], m: usize, n: usize) -> Self {
        let s = |k: usize| Complex64::new(0.0, spectra.omega[k]);
        let all = 0..spectra.omega.len();
        let factor: Vec<Complex64> = all
            .clone()
            .map(|k| {
                let b = num.iter().fold(Complex64::new(0.0, 0.0), |sum, c| sum * s(k) + c);
                weights[k] / (b * spectra.hold[k])
            })
            .collect();
        let powers = |of: &[Complex64], i: usize| -> Vec<f64> {
            let value = |k: usize| of[k] * factor[k] * s(k).powu(i as u32);
            real_and_imaginary_parts(all.clone().map(value))
        };
        let ones = vec![Complex64::new(1.0, 0.0); spectra.omega.len()];
        let mut transient: Vec<Vec<f64>> = Vec::new();
        for i in 0..=n + 1 {
            let mut column = powers(&ones, i);
            let before = dot(&column, &column).sqrt();
            project_out(&mut column, &transient);
            project_out(&mut column, &transient);
            let norm = dot(&column, &column).sqrt();
            if norm > 1e-9 * before {
                column.iter_mut().for_each(|v| *v /= norm);
                transient.push(column);
            }
        }
        let free = |of: &[Complex64], i: usize| {
            let mut column = powers(of, i);
            project_out(&mut column, &transient);
            column
        };
        Self {
            m,
            a_columns: (0..n).map(|i| free(&spectra.e, i)).collect(),
            c_columns: spectra
                .targets
                .iter()
                .flat_map(|target| (0..=n).map(|i| free(target, i)).collect::<Vec<_>>())
                .collect(),
            right: free(&spectra.e, n),
            spectra,
            factor,
            transient,
        }
    }

    /// Returns the columns of B, delayed by `delay_s`, and the columns of `B kappa`, delayed by `of_disturbances_s`.
    fn input_columns(&self, delay_s: f64, of_disturbances_s: f64) -> Vec<Vec<f64>> {
        let disturbances = self.spectra.disturbances.iter().map(|d| (d, of_disturbances_s));
        let inputs = [(&self.spectra.u, delay_s)].into_iter().chain(disturbances);
        let column = |of: &[Complex64], delay_s: f64, i: usize| {
            let value = |(k, &omega): (usize, &f64)| {
                let s = Complex64::new(0.0, omega);
                of[k] * self.spectra.hold[k] * self.factor[k] * s.powu(i as u32) * (-s * delay_s).exp()
            };
            let mut column = real_and_imaginary_parts(self.spectra.omega.iter().enumerate().map(value));
            project_out(&mut column, &self.transient);
            column
        };
        inputs
            .flat_map(|(of, delay_s)| (0..=self.m).map(move |i| (of, delay_s, i)))
            .map(|(of, delay_s, i)| column(of, delay_s, i))
            .collect()
    }
}

/// Returns the real parts of all values, followed by their imaginary parts.
fn real_and_imaginary_parts(values: impl Iterator<Item = Complex64> + Clone) -> Vec<f64> {
    values.clone().map(|v| v.re).chain(values.map(|v| v.im)).collect()
}

/// Removes the components of a column along the orthonormal columns.
fn project_out(column: &mut [f64], orthonormal: &[Vec<f64>]) {
    for q in orthonormal {
        let along = dot(q, column);
        add_scaled(column, -along, q);
    }
}

/// Least-squares solution of the loop equations of all records, for one delay.
struct Solution {
    /// Coefficients `a_0 .. a_{n-1}`, `b_0 .. b_m` of u, followed by the coefficients of the disturbances and of the
    /// targets.
    theta: Vec<f64>,
    delay_s: f64,
    sum_of_squares: f64,
    /// Power of `B (U + kappa D)` plus the residuals; the sum of squares is the unexplained part of this power.
    power: f64,
    residuals: Vec<f64>,
}

impl Solution {
    /// Returns the solution with the same delay for the disturbances as for u and, if there are disturbances, the
    /// solution without a delay for them.
    fn candidates(rows: &[Rows<'_>], delay_s: f64) -> impl Iterator<Item = Self> {
        let disturbed = rows.iter().any(|rows| !rows.spectra.disturbances.is_empty());
        let on_time = (disturbed && delay_s != 0.0).then_some(0.0);
        let cases = [Some(delay_s), on_time].into_iter().flatten();
        cases.filter_map(move |of_disturbances| Self::of(rows, delay_s, of_disturbances))
    }

    fn of(rows: &[Rows<'_>], delay_s: f64, of_disturbances_s: f64) -> Option<Self> {
        let blocks: Vec<Vec<Vec<f64>>> = rows
            .iter()
            .map(|rows| {
                let negative = rows.a_columns.iter().map(|c| c.iter().map(|v| -v).collect::<Vec<_>>());
                let inputs = rows.input_columns(delay_s, of_disturbances_s);
                let inputs = inputs.into_iter().map(|c| c.iter().map(|v| -v).collect());
                negative.chain(inputs).chain(rows.c_columns.iter().cloned()).collect()
            })
            .collect();
        let p = blocks.first()?.len();
        let column = |j: usize| -> Vec<f64> { blocks.iter().flat_map(|block| block[j].iter().copied()).collect() };
        let columns: Vec<Vec<f64>> = (0..p).map(column).collect();
        let right: Vec<f64> = rows.iter().flat_map(|rows| rows.right.iter().copied()).collect();
        let freedom: usize = p + rows.iter().map(|rows| rows.transient.len()).sum::<usize>();
        if right.len() < 3 * freedom || dot(&right, &right) == 0.0 {
            return None;
        }
        let solved = LeastSquares::factor(&mut columns.concat(), &mut right.clone());
        if !solved.has_full_rank() {
            return None;
        }
        let theta = solved.solution();
        let inputs = rows[0].a_columns.len()..p - rows[0].c_columns.len();
        let mut residuals = right;
        (0..p).for_each(|j| add_scaled(&mut residuals, -theta[j], &columns[j]));
        let mut power = residuals.clone();
        inputs.for_each(|j| add_scaled(&mut power, theta[j], &columns[j]));
        Some(Self {
            sum_of_squares: dot(&residuals, &residuals),
            power: dot(&power, &power),
            theta,
            delay_s,
            residuals,
        })
    }
}

fn best_solution(all: impl Iterator<Item = Solution>) -> Option<Solution> {
    all.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))
}

/// Updates the weights from the smoothed spectrum of the residuals, from which the previous weights are removed. A
/// floor at the level of rounding errors retains all frequencies of exact data.
fn update_weights(weights: &mut [f64], residuals: &[f64], omega: &[f64], power: f64) {
    let n = omega.len();
    let own: Vec<f64> = (0..n)
        .map(|k| (residuals[k].powi(2) + residuals[n + k].powi(2)) / weights[k].powi(2))
        .collect();
    let floor = 1e-9 * power / n as f64;
    for (weight, at) in weights.iter_mut().zip(omega) {
        let near = (0..n).filter(|&k| (omega[k] / at).ln().abs() < SMOOTHING_HALF_WIDTH);
        let (sum, count) = near.fold((0.0, 0.0), |(sum, count), k| (sum + own[k], count + 1.0));
        *weight = 1.0 / (sum / count + floor).sqrt();
    }
}
