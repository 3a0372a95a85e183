//! Further inputs: `w_i = (B_i/F_i) q^-nk_i x_i`, with separate polynomials for each input.
//!
//! Theta contains the coefficients of the first input and of the noise model, then `b_0 .. f_1 ..` of each further
//! input. The columns of psi have the same form as for the first input, with the signals of the further input:
//! `(D/(C F_i)) x_i(t - nk_i - j)` and `-(D/(C F_i)) w_i(t - j)`.

use std::{borrow::Cow, ops::Range};

use hoid_core::filter::divide;

use super::{
    further_input::FurtherSignals, normal_equations::Column, polynomials::Polynomials, prediction_error::Criterion,
    whitening::whiten, workspace::Workspace,
};
use crate::linalg::vectors::add_scaled;

impl Criterion<'_> {
    /// Returns B and F of each further input.
    pub(super) fn further_polynomials<'t>(
        &self,
        theta: &'t [f64],
    ) -> impl Iterator<Item = (&'t [f64], &'t [f64])> + use<'t, '_> {
        let mut at = self.orders.parameter_count();
        self.further.iter().map(move |input| {
            let b = &theta[at..at + input.orders.nb];
            at += input.orders.nb;
            let f = &theta[at..at + input.orders.nf];
            at += input.orders.nf;
            (b, f)
        })
    }

    /// Returns, for each further input, the indices in theta of its F coefficients.
    pub(super) fn further_poles(&self) -> impl Iterator<Item = Range<usize>> {
        let mut at = self.orders.parameter_count();
        self.further.iter().map(move |input| {
            let from = at + input.orders.nb;
            at = from + input.orders.nf;
            from..at
        })
    }

    /// Computes the signals s and w of the further inputs over these samples, and subtracts w from v.
    pub(super) fn compute_further_responses(
        &self,
        theta: &[f64],
        record: usize,
        samples: Range<usize>,
        ws: &mut Workspace,
    ) {
        let (pad, n) = (ws.pad, samples.end);
        ws.further.resize_with(self.further.len(), FurtherSignals::default);
        let from = pad + samples.start;
        for ((input, (b, f)), signals) in self
            .further
            .iter()
            .zip(self.further_polynomials(theta))
            .zip(&mut ws.further)
        {
            let FurtherSignals { s, w, .. } = signals;
            let start = pad + input.orders.nk.min(n);
            s.resize(pad + n, 0.0);
            s[..start].fill(0.0);
            divide(f, &input.values[record][..pad + n - start], &mut s[start..]);
            w.resize(pad + n, 0.0);
            w.fill(0.0);
            for (j, &bj) in b.iter().enumerate() {
                add_scaled(&mut w[from..], bj, &s[from - j..pad + n - j]);
            }
            add_scaled(&mut ws.v[from..pad + n], -1.0, &w[from..]);
        }
    }

    /// Computes the filtered signals of the further inputs, whose shifts are columns of psi.
    pub(super) fn whiten_further(&self, theta: &[f64], ws: &mut Workspace) {
        let parts = Polynomials::split(&self.orders, theta);
        let from = ws.pad + self.first_regressed_sample();
        for ((input, (_, f)), signals) in self
            .further
            .iter()
            .zip(self.further_polynomials(theta))
            .zip(&mut ws.further)
        {
            let FurtherSignals {
                s,
                w,
                b_columns: of_b,
                f_columns: of_f,
            } = signals;
            of_b.resize(s.len(), 0.0);
            let start = ws.pad + input.orders.nk.min(s.len() - ws.pad);
            whiten(parts.c, parts.d, s, of_b, start);
            if input.orders.nf > 0 {
                let mut filtered = vec![0.0; w.len()];
                divide(f, &w[from..], &mut filtered[from..]);
                of_f.resize(w.len(), 0.0);
                whiten(parts.c, parts.d, &filtered, of_f, from);
            }
        }
    }

    /// Returns the columns of psi for the further inputs, over these rows of the workspace.
    pub(super) fn further_columns<'w>(&self, counted: &Range<usize>, ws: &'w Workspace) -> Vec<Column<'w>> {
        let mut columns = Vec::new();
        let mut add = |signal: &'w [f64], shifts: Range<usize>, sign: f64| {
            let first = shifts.start;
            columns.extend(shifts.map(|j| Column {
                values: Cow::Borrowed(&signal[counted.start - j..counted.end - j]),
                sign,
                is_shift_of_previous: j > first,
            }));
        };
        for (input, signals) in self.further.iter().zip(&ws.further) {
            add(&signals.b_columns, 0..input.orders.nb, 1.0);
            add(&signals.f_columns, 1..input.orders.nf + 1, -1.0);
        }
        columns
    }
}
