//! The filtered equation, its instruments, its solution and its covariance.
//!
//! With poles `f_1 .. f_n` (of A or F) the equation reads `u(t) = -f_1 u(t-1) - .. + b_0 e(t-nk) + .. + r(t)`; a filter L is laid over
//! each of its columns, at rest at the first row. The instruments are the same columns made of the noise-free input x and of
//! `(B/F) q^-nk x`, under the same filter.
//!
//! **Solution.** `Z = Q T` with orthonormal Q (Gram-Schmidt, twice), then `Q' Phi theta = Q' y` by QR with column pivoting: the
//! condition of Z does not enter twice, and the rank is decided as for least squares.
//!
//! **Covariance.** For a residual with the covariance matrix R, independent of Z,
//! `(Z' Phi)^-1 Z' R Z (Phi' Z)^-1` (T. Söderström and P. Stoica, *Instrumental Variable Methods for System Identification*, 1983,
//! ch. 5). R is that of a long autoregression `D r = eps` of the residual: `Z' R Z = lambda (H'Z)' (H'Z)`, with H' the filter 1/D run
//! backwards in time. Where the filter has made the residual white it is Ljung's (15.29), `lambda (Z'Z)^-1` for Z = Phi.

use std::{borrow::Cow, ops::Range};

use hoid_core::filter::{divide_in_place, fir, multiply};
use hoid_model::{
    Orders,
    polynomial::{product, reflected_inside},
    polynomial_model::monic,
};
use nalgebra::DMatrix;

use crate::{
    IdentError,
    initial_guess::noise_model::noise_model,
    linalg::least_squares::{LeastSquares, add_scaled, dot},
    pem::criterion::Data,
    pem::initial_states::{FreeResponses, Past},
};

/// Part of a column that must be its own, in amplitude, for it not to count as a combination of those before it. Twice
/// orthogonalised columns keep 1e-15.
const OWN_PART: f64 = 1e-10;
/// Longest invented past in samples.
const PAST: usize = 256;
/// Longest autoregression for the colour of a residual.
const LONGEST: usize = 30;

/// `D/(C F)`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Prefilter<'p> {
    pub d: &'p [f64],
    pub c: &'p [f64],
    pub f: &'p [f64],
}

impl Prefilter<'_> {
    /// The filtered signal from the first sample at which D has all its samples; 1/(C F) is at rest there.
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        multiply(self.d, x, &mut y);
        y.drain(..self.d.len().min(x.len()));
        divide_in_place(self.c, &mut y);
        divide_in_place(self.f, &mut y);
        y
    }
}

/// A noise-free input.
#[derive(Debug, Clone)]
pub(super) struct Source<'a> {
    /// The input of each record, whole.
    pub inputs: Vec<Cow<'a, [f64]>>,
    /// Samples in which instruments are made of it, counted through all records.
    pub samples: Range<usize>,
}

impl<'a> Source<'a> {
    /// The measured inputs, for all samples.
    pub fn measured(data: &[Data<'a>]) -> Vec<Self> {
        vec![Self {
            inputs: data.iter().map(|d| Cow::Borrowed(d.e)).collect(),
            samples: 0..usize::MAX,
        }]
    }
}

/// Data, noise-free inputs and orders. The system is a vector `[f_1 .. f_n, b_0 .. ]`, with A in place of F for ARX.
pub(super) struct Problem<'a> {
    pub poles: usize,
    pub nb: usize,
    pub nk: usize,
    pub data: Vec<Data<'a>>,
    /// Noise-free inputs; each serves in its own rows.
    pub sources: Vec<Source<'a>>,
    /// First row of each record.
    pub first: usize,
    names: Vec<String>,
}

/// Columns over the rows of all records, one after the other.
pub(super) type Columns = Vec<Vec<f64>>;

/// The filtered equation with its instruments.
pub(super) struct Equation {
    pub y: Vec<f64>,
    pub phi: Columns,
    pub z: Columns,
}

impl<'a> Problem<'a> {
    /// The equation of these orders; na and nf are not both positive.
    pub fn new(orders: &Orders, data: Vec<Data<'a>>, sources: Vec<Source<'a>>) -> Self {
        let letter = if orders.na > 0 { 'a' } else { 'f' };
        let poles = orders.na + orders.nf;
        let names = (1..=poles)
            .map(|i| format!("{letter}{i}"))
            .chain((0..orders.nb).map(|j| format!("b{j}")))
            .collect();
        Self {
            poles,
            nb: orders.nb,
            nk: orders.nk,
            data,
            sources,
            first: poles.max(orders.nk + orders.nb - 1),
            names,
        }
    }

    /// The same equation for other signals.
    pub fn of<'b>(&self, data: Vec<Data<'b>>, sources: Vec<Source<'b>>) -> Problem<'b> {
        Problem {
            poles: self.poles,
            nb: self.nb,
            nk: self.nk,
            data,
            sources,
            first: self.first,
            names: self.names.clone(),
        }
    }

    /// Rows of each record under a filter whose D has this order.
    pub fn rows(&self, order_of_d: usize) -> Vec<usize> {
        self.data
            .iter()
            .map(|d| (d.u.len() - self.first).saturating_sub(order_of_d))
            .collect()
    }

    /// Filtered columns `[-u(t-i), e(t-nk-j)]` of these outputs and inputs.
    fn columns(&self, filter: Prefilter<'_>, signals: &[(&[f64], &[f64])]) -> Columns {
        let shifted = |lag: usize, input: bool| {
            let mut column = Vec::new();
            for (u, e) in signals {
                let x = if input { e } else { u };
                column.extend(filter.apply(&x[self.first - lag..x.len() - lag]));
            }
            if !input {
                column.iter_mut().for_each(|v| *v = -*v);
            }
            column
        };
        (1..=self.poles)
            .map(|i| shifted(i, false))
            .chain((0..self.nb).map(|j| shifted(self.nk + j, true)))
            .collect()
    }

    /// `(B/F) q^-nk x` of a system with stable F and a noise-free input x.
    fn simulate(&self, system: &[f64], x: &[f64]) -> Vec<f64> {
        let (f, b) = system.split_at(self.poles);
        let (extended, past) = with_past(x);
        let mut output = vec![0.0; extended.len()];
        fir(b, self.nk, &extended, &mut output);
        divide_in_place(f, &mut output);
        output.drain(..past);
        output
    }

    /// The filtered equation with instruments from the noise-free inputs and what this system (with stable F) makes of them.
    pub fn equation(&self, filter: Prefilter<'_>, system: &[f64]) -> Equation {
        let measured: Vec<(&[f64], &[f64])> = self.data.iter().map(|d| (d.u, d.e)).collect();
        let mut equation = Equation {
            y: self.filtered_output(filter),
            phi: self.columns(filter, &measured),
            z: self.instruments(filter, system),
        };
        let free = self.free_responses(filter);
        let all = equation.phi.iter_mut().chain(&mut equation.z).chain([&mut equation.y]);
        all.for_each(|column| eliminate(&free, column));
        equation
    }

    fn instruments(&self, filter: Prefilter<'_>, system: &[f64]) -> Columns {
        let mut z = Columns::new();
        for source in &self.sources {
            let outputs: Vec<Vec<f64>> = source.inputs.iter().map(|x| self.simulate(system, x)).collect();
            let pairs: Vec<(&[f64], &[f64])> = outputs
                .iter()
                .zip(&source.inputs)
                .map(|(u, e)| (u.as_slice(), e.as_ref()))
                .collect();
            let columns = self.columns(filter, &pairs);
            if z.is_empty() {
                z = columns;
                continue;
            }
            for rows in self.rows_of(&source.samples, filter.d.len()) {
                for (to, from) in z.iter_mut().zip(&columns) {
                    to[rows.clone()].copy_from_slice(&from[rows.clone()]);
                }
            }
        }
        z
    }

    /// Rows of a range of samples that is counted through all records.
    fn rows_of(&self, samples: &Range<usize>, order_of_d: usize) -> Vec<Range<usize>> {
        let (mut sample, mut row) = (0, 0);
        let mut found = Vec::new();
        for (data, rows) in self.data.iter().zip(self.rows(order_of_d)) {
            let first = sample + data.u.len() - rows;
            let within = |s: usize| row + s.clamp(first, first + rows) - first;
            found.push(within(samples.start)..within(samples.end));
            sample += data.u.len();
            row += rows;
        }
        found
    }

    fn filtered_output(&self, filter: Prefilter<'_>) -> Vec<f64> {
        self.data
            .iter()
            .flat_map(|d| filter.apply(&d.u[self.first..]))
            .collect()
    }

    /// Free responses of 1/(C F) in each record, with its rows.
    fn free_responses(&self, filter: Prefilter<'_>) -> Vec<(FreeResponses, usize)> {
        let poles = product(&monic(filter.c), &monic(filter.f));
        let past = Past {
            c: &[],
            d: &[],
            f: &poles[1..],
            lead: 0,
            noise: None,
            weights: None,
        };
        let rows = self.rows(filter.d.len());
        rows.into_iter().map(|n| (FreeResponses::of(&past, n), n)).collect()
    }

    /// Least squares on the filtered equation.
    pub fn least_squares(&self, filter: Prefilter<'_>) -> Result<Vec<f64>, IdentError> {
        let measured: Vec<(&[f64], &[f64])> = self.data.iter().map(|d| (d.u, d.e)).collect();
        let free = self.free_responses(filter);
        let mut columns = self.columns(filter, &measured);
        let mut y = self.filtered_output(filter);
        columns
            .iter_mut()
            .chain([&mut y])
            .for_each(|column| eliminate(&free, column));
        let mut columns = columns.concat();
        let solved = LeastSquares::factor(&mut columns, &mut y);
        if !solved.has_full_rank() {
            return Err(IdentError::SingularRegressors {
                columns: solved.describe_dependence(&self.names),
            });
        }
        Ok(solved.solution())
    }

    /// Solution of `Z' Phi theta = Z' y`.
    ///
    /// # Errors
    /// [`IdentError::SingularInstruments`].
    pub fn solve(&self, equation: &Equation) -> Result<Vec<f64>, IdentError> {
        let (q, kept) = orthonormal(&equation.z);
        if let Some(lost) = (0..equation.z.len()).find(|i| !kept.contains(i)) {
            let dependence = if dot(&equation.z[lost], &equation.z[lost]) == 0.0 {
                format!("that of {} is zero", self.names[lost])
            } else {
                format!("that of {} is a combination of the others", self.names[lost])
            };
            return Err(IdentError::SingularInstruments { dependence });
        }
        let mut product: Vec<f64> = equation
            .phi
            .iter()
            .flat_map(|column| q.iter().map(move |q| dot(q, column)))
            .collect();
        let mut right: Vec<f64> = q.iter().map(|q| dot(q, &equation.y)).collect();
        let solved = LeastSquares::factor(&mut product, &mut right);
        if !solved.has_full_rank() {
            return Err(IdentError::SingularInstruments {
                dependence: format!(
                    "they do not tell the regressors apart: {}",
                    solved.describe_dependence(&self.names)
                ),
            });
        }
        let theta = solved.solution();
        if theta.iter().all(|v| v.is_finite()) {
            Ok(theta)
        } else {
            Err(IdentError::NoFiniteLoss)
        }
    }

    /// The system with its poles inside the unit circle, and whether they had to be moved.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] where the roots cannot be found.
    pub fn stabilised(&self, system: &[f64]) -> Result<(Vec<f64>, bool), IdentError> {
        let mut stable = reflected_inside(&system[..self.poles]).ok_or(IdentError::NoFiniteLoss)?;
        let moved = stable != system[..self.poles];
        stable.extend_from_slice(&system[self.poles..]);
        Ok((stable, moved))
    }
}

impl Equation {
    /// `y - Phi theta`.
    pub fn residual(&self, theta: &[f64]) -> Vec<f64> {
        let mut r = self.y.clone();
        for (column, t) in self.phi.iter().zip(theta) {
            add_scaled(&mut r, -t, column);
        }
        r
    }
}

/// Takes the free responses out of a column.
fn eliminate(free: &[(FreeResponses, usize)], column: &mut [f64]) {
    let mut rest = column;
    for (responses, rows) in free {
        let (part, others) = rest.split_at_mut(*rows);
        for q in responses.basis() {
            let component = dot(q, &part[..q.len()]);
            add_scaled(&mut part[..q.len()], -component, q);
        }
        rest = others;
    }
}

/// The signal behind an invented past, and the length of that past: reflected at the first sample and faded in, so that what is
/// simulated from it starts without a jump.
pub(super) fn with_past(x: &[f64]) -> (Vec<f64>, usize) {
    let length = PAST.min(x.len().saturating_sub(1));
    let fade = |k: usize| 0.5 + 0.5 * (std::f64::consts::PI * k as f64 / (length + 1) as f64).cos();
    let mut extended: Vec<f64> = (1..=length).rev().map(|k| fade(k) * (2.0 * x[0] - x[k])).collect();
    extended.extend_from_slice(x);
    (extended, length)
}

/// Orthonormal basis of the columns by Gram-Schmidt, twice, and the indices of the columns that have a part of their own.
pub(super) fn orthonormal(columns: &[Vec<f64>]) -> (Columns, Vec<usize>) {
    let mut q: Columns = Vec::new();
    let mut kept = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        let size = dot(column, column).sqrt();
        let mut own = column.clone();
        for _ in 0..2 {
            for q in &q {
                let component = dot(q, &own);
                add_scaled(&mut own, -component, q);
            }
        }
        let rest = dot(&own, &own).sqrt();
        // Written so that NaN is dropped too.
        if rest > OWN_PART * size {
            own.iter_mut().for_each(|v| *v /= rest);
            q.push(own);
            kept.push(index);
        }
    }
    (q, kept)
}

/// A residual cut into its records.
pub(super) fn cut(residual: &[f64], rows: &[usize]) -> Columns {
    let mut at = 0;
    rows.iter()
        .map(|n| {
            at += n;
            residual[at - n..at].to_vec()
        })
        .collect()
}

/// Long autoregression `D r = eps` of a residual: D, and the variance of eps.
pub(super) fn colour(residual: &[Vec<f64>], parameters: usize) -> (Vec<f64>, f64) {
    let n: usize = residual.iter().map(Vec::len).sum();
    let shortest = residual.iter().map(Vec::len).min().unwrap_or(0);
    let order = LONGEST.min(shortest / 10);
    let (_, d) = noise_model(residual, 0, order);
    let d = reflected_inside(&d).unwrap_or_default();
    let mut total = 0.0;
    let mut rows = 0;
    for r in residual {
        let mut eps = vec![0.0; r.len()];
        multiply(&d, r, &mut eps);
        let whole = &eps[order.min(eps.len())..];
        total += dot(whole, whole);
        rows += whole.len();
    }
    // Degrees of freedom that the parameters have taken, as for the innovation variance.
    let freedom = n as f64 / n.saturating_sub(parameters).max(1) as f64;
    (d, total / rows.max(1) as f64 * freedom)
}

/// `(Z' Phi)^-1 lambda K' K (Phi' Z)^-1` by rows, where K is Z with the colour of the residual laid over those columns that do
/// not depend on it. `None` where `Z' Phi` has no inverse.
pub(super) fn covariance(
    z: &[Vec<f64>],
    phi: &[Vec<f64>],
    independent: impl Fn(usize) -> bool,
    residual: &[Vec<f64>],
) -> Option<Vec<f64>> {
    let p = z.len();
    let (d, lambda) = colour(residual, p);
    // Unit columns: the units of the parameters do not reach the inverse.
    let length = |column: &Vec<f64>| dot(column, column).sqrt();
    let (of_z, of_phi): (Vec<f64>, Vec<f64>) = (z.iter().map(length).collect(), phi.iter().map(length).collect());
    let k: Columns = z
        .iter()
        .enumerate()
        .map(|(i, column)| {
            if !independent(i) {
                return column.clone();
            }
            let rows: Vec<usize> = residual.iter().map(Vec::len).collect();
            let mut backwards = cut(column, &rows);
            for part in &mut backwards {
                part.reverse();
                divide_in_place(&d, part);
                part.reverse();
            }
            backwards.concat()
        })
        .collect();
    let inverse = DMatrix::from_fn(p, p, |i, j| dot(&z[i], &phi[j]) / (of_z[i] * of_phi[j])).try_inverse()?;
    let middle = DMatrix::from_fn(p, p, |i, j| lambda * dot(&k[i], &k[j]) / (of_z[i] * of_z[j]));
    let scaled = &inverse * middle * inverse.transpose();
    let result: Vec<f64> = (0..p * p)
        .map(|at| {
            let (i, j) = (at / p, at % p);
            scaled[(i, j)] / (of_phi[i] * of_phi[j])
        })
        .collect();
    result.iter().all(|v| v.is_finite()).then_some(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: u32, w: f64) -> Vec<f64> {
        (0..n)
            .map(|t| (w * f64::from(t)).sin() + 0.3 * (2.3 * w * f64::from(t)).cos())
            .collect()
    }

    fn white(n: usize) -> Vec<f64> {
        // A linear congruential generator (D. E. Knuth, MMIX), shifted to zero mean.
        let mut state = 7_u64;
        (0..n)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    const ORDERS: Orders = Orders {
        na: 0,
        nb: 2,
        nc: 0,
        nd: 0,
        nf: 2,
        nk: 3,
    };
    const SYSTEM: [f64; 4] = [-1.5, 0.7, 1.0, 0.5];

    /// Output of the system in the middle of its life: nothing is at rest when the record begins.
    fn record() -> (Vec<f64>, Vec<f64>) {
        let x = white(600);
        let mut u = vec![0.0; 600];
        fir(&SYSTEM[2..], 3, &x, &mut u);
        divide_in_place(&SYSTEM[..2], &mut u);
        (x[250..].to_vec(), u[250..].to_vec())
    }

    #[test]
    fn without_noise_any_filter_and_any_instruments_give_the_system() {
        let (e, u) = record();
        let data = vec![
            Data { e: &e, u: &u },
            Data {
                e: &e[40..],
                u: &u[40..],
            },
        ];
        let problem = Problem::new(&ORDERS, data.clone(), Source::measured(&data));
        let (c, d, f) = ([0.4], [-0.8, 0.1], [-1.2, 0.5]);
        let filters = [
            Prefilter::default(),
            Prefilter {
                f: &f,
                ..Prefilter::default()
            },
            Prefilter { c: &c, d: &d, f: &f },
        ];
        for filter in filters {
            let equation = problem.equation(filter, &[-1.0, 0.3, 1.0, 1.0]);
            assert_eq!(equation.y.len(), problem.rows(filter.d.len()).iter().sum::<usize>());
            for (found, truth) in problem.solve(&equation).unwrap().iter().zip(SYSTEM) {
                // The condition of these regressors is about 1e2.
                assert!((found - truth).abs() < 1e-11, "{found} {truth}");
            }
            assert!(equation.residual(&SYSTEM).iter().all(|r| r.abs() < 1e-12));
        }
    }

    #[test]
    fn instruments_change_with_the_source_at_its_rows_alone() {
        let (e, u) = record();
        let data = vec![
            Data { e: &e, u: &u },
            Data {
                e: &e[40..],
                u: &u[40..],
            },
        ];
        let doubled = |x: &[f64]| Cow::Owned(x.iter().map(|v| 2.0 * v).collect::<Vec<f64>>());
        let sources = vec![
            Source {
                inputs: vec![Cow::Borrowed(e.as_slice()), Cow::Borrowed(&e[40..])],
                samples: 0..400,
            },
            Source {
                inputs: vec![doubled(&e), doubled(&e[40..])],
                samples: 400..660,
            },
        ];
        let split = Problem::new(&ORDERS, data.clone(), sources);
        let plain = Problem::new(&ORDERS, data.clone(), Source::measured(&data));
        let d = [-0.5];
        let filter = Prefilter {
            d: &d,
            ..Prefilter::default()
        };
        let (a, b) = (split.equation(filter, &SYSTEM), plain.equation(filter, &SYSTEM));
        // 350 samples in the first record; sample 400 is number 50 of the second. 4 samples and one of D come before the rows.
        let change = (350 - 5) + (50 - 5);
        for (x, y) in a.z.iter().zip(&b.z) {
            assert_eq!(x[..change], y[..change]);
            for (x, y) in x[change..].iter().zip(&y[change..]) {
                assert!((x - 2.0 * y).abs() < 1e-12, "{x} {y}");
            }
        }
        assert_eq!(a.phi, b.phi);
    }

    #[test]
    fn covariance_is_that_of_least_squares_for_white_residuals() {
        let residual = white(5000);
        let z = vec![wave(5000, 0.1), wave(5000, 0.7)];
        let found = covariance(&z, &z, |_| true, &[residual]).unwrap();
        let gram = DMatrix::from_fn(2, 2, |i, j| dot(&z[i], &z[j]));
        let expected = gram.try_inverse().unwrap() / 12.0;
        for i in 0..2 {
            // The spectrum of 5000 samples at one frequency, by an autoregression of order 30: 1 standard error is 11 %.
            let ratio = found[3 * i] / expected[(i, i)];
            assert!((0.6..1.6).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn covariance_knows_the_colour_at_the_frequency_of_the_instrument() {
        let mut residual = white(20_000);
        divide_in_place(&[-0.9], &mut residual);
        for w in [0.05_f64, 0.5, 2.5] {
            let z = vec![(0..20_000).map(|t| (w * f64::from(t)).sin()).collect::<Vec<f64>>()];
            let found = covariance(&z, &z, |_| true, std::slice::from_ref(&residual)).unwrap()[0];
            let response = 1.0 / (1.0 - 2.0 * 0.9 * w.cos() + 0.81);
            let expected = response / 12.0 / dot(&z[0], &z[0]);
            // As above, 6 %.
            assert!((0.75..1.3).contains(&(found / expected)), "{w}: {}", found / expected);
        }
    }

    #[test]
    fn an_invented_past_ends_where_the_record_begins() {
        let x = wave(2000, 0.01);
        let (extended, past) = with_past(&x);
        assert_eq!(past, PAST);
        assert_eq!(extended[past..], x);
        let steepest = extended.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(steepest < 0.03, "{steepest}");
        assert_eq!(with_past(&[5.0]), (vec![5.0], 0));
        assert_eq!(with_past(&[]), (vec![], 0));
    }

    #[test]
    fn dependent_columns_are_left_out_of_the_basis() {
        let (a, b) = (wave(100, 0.2), wave(100, 0.9));
        let sum: Vec<f64> = a.iter().zip(&b).map(|(x, y)| x - 3.0 * y).collect();
        let (basis, kept) = orthonormal(&[a, vec![0.0; 100], b, sum, vec![f64::NAN; 100]]);
        assert_eq!(kept, [0, 2]);
        assert!(dot(&basis[0], &basis[1]).abs() < 1e-14);
    }
}
