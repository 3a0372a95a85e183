//! The prefiltered equation, its instruments and its solution.
//!
//! With poles `f_1 .. f_n` (of A or F) the equation is `u(t) = -f_1 u(t-1) - .. + b_0 e(t-nk) + .. + r(t)`. A filter L,
//! which is at rest at the first row, is applied to each column of the equation. The instruments are the same columns,
//! filtered by L as well, but with the noise-free input x instead of e and `(B/F) q^-nk x` instead of u.
//!
//! **Solution.** With `Z = Q T` and orthonormal Q (two passes of Gram-Schmidt), `Q' Phi theta = Q' y` is solved by QR
//! with column pivoting. The condition number of Z then has no effect, and the rank is determined as in least squares.

use std::{borrow::Cow, ops::Range};

use hoid_core::filter::{divide_in_place, fir, multiply};
use hoid_model::{
    Orders,
    polynomial::{product, reflect_roots_inside},
    polynomial_model::monic,
};

use super::columns::{Columns, orthonormal_basis, with_past};
use crate::{
    IdentError,
    criterion::Data,
    criterion::initial_state_responses::{InitialHistory, InitialStateResponses},
    linalg::{
        least_squares::LeastSquares,
        vectors::{add_scaled, dot},
    },
};

/// The prefilter `D/(C F)`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Prefilter<'p> {
    pub d: &'p [f64],
    pub c: &'p [f64],
    pub f: &'p [f64],
}

impl Prefilter<'_> {
    /// Filters the signal from the first sample for which D has all its past samples; 1/(C F) is at rest at this
    /// sample.
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        multiply(self.d, x, &mut y);
        y.drain(..self.d.len().min(x.len()));
        divide_in_place(self.c, &mut y);
        divide_in_place(self.f, &mut y);
        y
    }
}

/// A noise-free input and the samples for which it is valid.
#[derive(Debug, Clone)]
pub(crate) struct Source<'a> {
    /// Noise-free input of each whole record.
    pub inputs: Vec<Cow<'a, [f64]>>,
    /// Samples for which this source gives instruments, counted through all records.
    pub samples: Range<usize>,
}

impl<'a> Source<'a> {
    /// Returns the measured inputs as a source for all samples.
    pub fn measured_inputs(data: &[Data<'a>]) -> Vec<Self> {
        vec![Self {
            inputs: data.iter().map(|d| Cow::Borrowed(d.e)).collect(),
            samples: 0..usize::MAX,
        }]
    }
}

/// Data, noise-free inputs and orders of an estimate. A system is a vector `[f_1 .. f_n, b_0 .. ]`, with A instead of F
/// for ARX.
pub(crate) struct IvProblem<'a> {
    pub poles: usize,
    pub nb: usize,
    pub nk: usize,
    pub data: Vec<Data<'a>>,
    /// Noise-free inputs; each input is used only for its own samples.
    pub sources: Vec<Source<'a>>,
    /// Sample of each record at which the equation has its first row.
    pub first: usize,
    names: Vec<String>,
}

/// The filtered equation with its instruments.
pub(crate) struct Equation {
    pub y: Vec<f64>,
    pub phi: Columns,
    pub z: Columns,
}

impl<'a> IvProblem<'a> {
    /// Creates the problem for these orders; na or nf must be zero.
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

    /// Returns the problem with the same orders for other data and noise-free inputs.
    pub fn with_data<'b>(&self, data: Vec<Data<'b>>, sources: Vec<Source<'b>>) -> IvProblem<'b> {
        IvProblem {
            poles: self.poles,
            nb: self.nb,
            nk: self.nk,
            data,
            sources,
            first: self.first,
            names: self.names.clone(),
        }
    }

    /// Returns the number of rows of each record in the equation, for a filter with this order of D.
    pub fn row_counts(&self, order_of_d: usize) -> Vec<usize> {
        self.data
            .iter()
            .map(|d| (d.u.len() - self.first).saturating_sub(order_of_d))
            .collect()
    }

    /// Returns the filtered columns `[-u(t-i), e(t-nk-j)]` of these pairs of output and input.
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

    /// Returns the response `(B/F) q^-nk x` of a system with stable F to a noise-free input x.
    fn simulate(&self, system: &[f64], x: &[f64]) -> Vec<f64> {
        let (f, b) = system.split_at(self.poles);
        let (extended, past) = with_past(x);
        let mut output = vec![0.0; extended.len()];
        fir(b, self.nk, &extended, &mut output);
        divide_in_place(f, &mut output);
        output.drain(..past);
        output
    }

    /// Returns the filtered equation. Its instruments come from the noise-free inputs and from the outputs that this
    /// system (with stable F) simulates from them.
    pub fn equation(&self, filter: Prefilter<'_>, system: &[f64]) -> Equation {
        let measured: Vec<(&[f64], &[f64])> = self.data.iter().map(|d| (d.u, d.e)).collect();
        let mut equation = Equation {
            y: self.filtered_output(filter),
            phi: self.columns(filter, &measured),
            z: self.instruments(filter, system),
        };
        let free = self.initial_state_responses(filter);
        // 1/(C F) starts at rest at the first row, whereas the true filter does not. The difference is a free response,
        // which is projected out of all columns, so the estimate does not depend on the unknown past.
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
            // Each source is used only in the rows whose noise did not enter its weights (split-sample instruments).
            for rows in self.rows_of(&source.samples, filter.d.len()) {
                for (to, from) in z.iter_mut().zip(&columns) {
                    to[rows.clone()].copy_from_slice(&from[rows.clone()]);
                }
            }
        }
        z
    }

    /// Returns the rows of the equation that belong to a range of samples; the samples are counted through all records.
    fn rows_of(&self, samples: &Range<usize>, order_of_d: usize) -> Vec<Range<usize>> {
        let (mut sample, mut row) = (0, 0);
        let mut found = Vec::new();
        for (data, rows) in self.data.iter().zip(self.row_counts(order_of_d)) {
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

    /// Returns, for each record, the initial-state responses of 1/(C F) and the number of rows.
    fn initial_state_responses(&self, filter: Prefilter<'_>) -> Vec<(InitialStateResponses, usize)> {
        let poles = product(&monic(filter.c), &monic(filter.f));
        let past = InitialHistory {
            c: &[],
            d: &[],
            f: &[&poles[1..]],
            lead: 0,
            noise: None,
            weights: None,
            level: false,
        };
        let rows = self.row_counts(filter.d.len());
        rows.into_iter()
            .map(|n| (InitialStateResponses::of(&past, n), n))
            .collect()
    }

    /// Returns the prediction error `eps = (D/C) (u - (B/F) q^-nk e)` of a system with stable F, with 1/(C F) at rest
    /// at the first row, and its negative gradient psi for F and B. `filter` is `D/(C F)` with the same F. The equation
    /// `F C eps = D (F u - B q^-nk e)` gives `psi_fi = -(D/(C F)) u(t-i) + (1/F) eps(t-i)` and
    /// `psi_bj = (D/(C F)) e(t-nk-j)`.
    pub fn prediction_error(&self, filter: Prefilter<'_>, system: &[f64]) -> (Vec<f64>, Columns) {
        let measured: Vec<(&[f64], &[f64])> = self.data.iter().map(|d| (d.u, d.e)).collect();
        let mut psi = self.columns(filter, &measured);
        let mut eps = self.filtered_output(filter);
        for (column, t) in psi.iter().zip(system) {
            add_scaled(&mut eps, -t, column);
        }
        let mut at = 0;
        for n in self.row_counts(filter.d.len()) {
            // d/df_i of F C eps = D (F u - B e): the second term of psi_fi is eps(t-i)/F.
            let mut through = eps[at..at + n].to_vec();
            divide_in_place(filter.f, &mut through);
            for (i, column) in psi[..self.poles].iter_mut().enumerate() {
                let lag = (i + 1).min(n);
                add_scaled(&mut column[at + lag..at + n], 1.0, &through[..n - lag]);
            }
            at += n;
        }
        (eps, psi)
    }

    /// Solves the filtered equation by least squares.
    pub fn least_squares(&self, filter: Prefilter<'_>) -> Result<Vec<f64>, IdentError> {
        let measured: Vec<(&[f64], &[f64])> = self.data.iter().map(|d| (d.u, d.e)).collect();
        let free = self.initial_state_responses(filter);
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

    /// Returns an orthonormal basis of the instruments `z`.
    ///
    /// # Errors
    /// [`IdentError::SingularInstruments`] if the instruments are linearly dependent.
    pub fn basis(&self, z: &Columns) -> Result<Columns, IdentError> {
        let (q, kept) = orthonormal_basis(z);
        if let Some(lost) = (0..z.len()).find(|i| !kept.contains(i)) {
            let dependence = if dot(&z[lost], &z[lost]) == 0.0 {
                format!("the instrument of {} is zero", self.names[lost])
            } else {
                format!(
                    "the instrument of {} is a combination of the other instruments",
                    self.names[lost]
                )
            };
            return Err(IdentError::SingularInstruments { dependence });
        }
        Ok(q)
    }

    /// Solves `Z' Phi theta = Z' y`.
    ///
    /// # Errors
    /// [`IdentError::SingularInstruments`] if there is no unique solution.
    pub fn solve(&self, equation: &Equation) -> Result<Vec<f64>, IdentError> {
        // Z = Q T with regular T, so Z' Phi theta = Z' y and Q' Phi theta = Q' y have the same solution. The second
        // form avoids the condition number of Z.
        let q = self.basis(&equation.z)?;
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
                    "the instruments do not distinguish the regressors: {}",
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

    /// Returns the system with its poles inside the unit circle, and whether poles had to be moved.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] if the roots cannot be found.
    pub fn stabilise(&self, system: &[f64]) -> Result<(Vec<f64>, bool), IdentError> {
        let mut stable = reflect_roots_inside(&system[..self.poles]).ok_or(IdentError::NoFiniteLoss)?;
        let moved = stable != system[..self.poles];
        stable.extend_from_slice(&system[self.poles..]);
        Ok((stable, moved))
    }
}

impl Equation {
    /// Returns the residual `y - Phi theta`.
    pub fn residual(&self, theta: &[f64]) -> Vec<f64> {
        let mut r = self.y.clone();
        for (column, t) in self.phi.iter().zip(theta) {
            add_scaled(&mut r, -t, column);
        }
        r
    }
}

/// Projects the initial-state responses out of a column.
fn eliminate(free: &[(InitialStateResponses, usize)], column: &mut [f64]) {
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

#[cfg(test)]
mod tests;
