//! The normal equations of a record: products of the residuals and the columns of psi, with the
//! initial states projected out.

use std::{borrow::Cow, ops::Range};

use super::{
    initial_state::InitialState,
    polynomials::{Block, Polynomials},
    prediction_error::Criterion,
    signals::EliminatedStates,
    whitening::whiten,
    workspace::Workspace,
};
use crate::{
    linalg::{
        products::{LaggedColumn, gram},
        vectors::{add_scaled, dot},
    },
    optimize::Linearisation,
};

/// A column of psi.
pub(super) struct Column<'w> {
    pub values: Cow<'w, [f64]>,
    pub sign: f64,
    /// True if this is the previous column delayed by one sample.
    pub is_shift_of_previous: bool,
}

impl Criterion<'_> {
    /// Adds the contribution of one record to the normal equations for the coefficients of these polynomials.
    pub(super) fn add_record(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        ws: &mut Workspace,
        total: &mut Linearisation,
    ) -> EliminatedStates {
        let parts = Polynomials::split(&self.orders, theta);
        self.process_record(theta, blocks, record, ws, |states, counted, ws| {
            let columns = self.columns(&parts, counted.clone(), ws, blocks);
            self.accumulate(states, &columns, record, &ws.eps[counted], total);
        })
    }

    /// Returns the columns of psi, in the order of theta, over these rows of the workspace.
    pub(super) fn columns<'w>(
        &self,
        parts: &Polynomials<'_>,
        counted: Range<usize>,
        ws: &'w Workspace,
        blocks: &[Block],
    ) -> Vec<Column<'w>> {
        let (first, end) = (counted.start, counted.end);
        let mut columns = Vec::with_capacity(self.orders.parameter_count());
        for &block in blocks {
            if block == Block::Further {
                columns.extend(self.further_columns(&counted, ws));
                continue;
            }
            let (from, count, sign) = block.shifts(&self.orders);
            let signal = match block {
                Block::D if self.orders.nc == 0 => &ws.v,
                _ => &ws.filtered[block as usize],
            };
            let late = self.initial == InitialState::Backcast && matches!(block, Block::A | Block::B);
            for j in from..from + count {
                let shifted = &signal[first - j..end - j];
                let values = if late {
                    let mut whitened = vec![0.0; shifted.len()];
                    whiten(parts.c, parts.d, shifted, &mut whitened, 0);
                    Cow::Owned(whitened)
                } else {
                    Cow::Borrowed(shifted)
                };
                columns.push(Column {
                    values,
                    sign,
                    is_shift_of_previous: j > from && !late,
                });
            }
        }
        columns
    }

    /// Adds the products of these columns of psi with each other and with the residuals to the normal equations, with
    /// the weights of the record if it has any.
    pub(super) fn accumulate(
        &self,
        states: &EliminatedStates,
        columns: &[Column<'_>],
        record: usize,
        eps: &[f64],
        total: &mut Linearisation,
    ) {
        let Some(all) = self.weights else {
            return add_products(states, columns, eps, total);
        };
        let weighted = |x: &[f64]| -> Vec<f64> { x.iter().zip(&all[record]).map(|(x, w)| x * w).collect() };
        let columns: Vec<Column<'_>> = columns
            .iter()
            .map(|column| Column {
                values: Cow::Owned(weighted(&column.values)),
                sign: column.sign,
                is_shift_of_previous: false,
            })
            .collect();
        add_products(states, &columns, &weighted(eps), total);
    }

    /// Adds the penalty on the states of stationary noise to the sum of squares and to the descent.
    pub(super) fn add_penalty(&self, states: &EliminatedStates, total: &mut Linearisation) {
        let Some(noise) = &states.noise else { return };
        let o = &self.orders;
        total.sum_of_squares += dot(&states.z, &states.z);
        let (poles, poles_at) = if o.nb == 0 && o.nd == 0 {
            (o.na, 0)
        } else {
            (o.nd, o.na + o.nb + o.nc)
        };
        let (by_c, by_d) = noise.descent(&states.z, o.nc, poles);
        add_scaled(&mut total.descent[o.na + o.nb..], 1.0, &by_c);
        add_scaled(&mut total.descent[poles_at..], 1.0, &by_d);
    }
}

/// Adds the products of the residuals and the columns of psi, with the initial states projected out.
fn add_products(states: &EliminatedStates, columns: &[Column<'_>], eps: &[f64], total: &mut Linearisation) {
    let p = columns.len();
    // Components of each column in the space of the initial states: one row per column of psi.
    let count = states.responses.basis().count();
    let mut inside = Vec::with_capacity(p * count);
    for column in columns {
        inside.extend(states.responses.basis().map(|q| dot(q, &column.values[..q.len()])));
    }
    let residuals = LaggedColumn {
        values: eps,
        is_shift_of_previous: false,
    };
    let lagged = columns.iter().map(|column| LaggedColumn {
        values: &column.values,
        is_shift_of_previous: column.is_shift_of_previous,
    });
    let all: Vec<LaggedColumn<'_>> = std::iter::once(residuals).chain(lagged).collect();
    let (raw, q) = (gram(&all), p + 1);
    total.sum_of_squares += raw[0];
    for (i, column) in columns.iter().enumerate() {
        total.descent[i] += column.sign * raw[i + 1];
        for (j, other) in columns[..=i].iter().enumerate() {
            let projected = raw[(i + 1) * q + j + 1]
                - dot(&inside[i * count..(i + 1) * count], &inside[j * count..(j + 1) * count]);
            let product = column.sign * other.sign * projected;
            total.gram[i * p + j] += product;
            if i != j {
                total.gram[j * p + i] += product;
            }
        }
    }
}
