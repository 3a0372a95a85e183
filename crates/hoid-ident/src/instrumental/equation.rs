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

use hoid_core::filter::{divide_in_place, moving_sum, multiply};
use hoid_model::{Orders, polynomial::product, polynomial_model::monic};
use nalgebra::DMatrix;

use crate::{
    IdentError,
    initial_states::{FreeResponses, Past},
    least_squares::{LeastSquares, add_scaled, dot},
    prediction_error::Data,
    starts::{noise_model, reflected_inside},
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
        moving_sum(b, self.nk, &extended, &mut output);
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
