//! The prediction-error criterion of the general model, its gradient and its Gauss-Newton matrix.
//!
//! For `A u = (B/F) q^-nk e + (C/D) eps` and given theta
//!
//! `w = (B/F) q^-nk e`,  `v = A u - w`,  `eps = (D/C) v`                                            (eq. 5.4)
//!
//! and the negative gradient `psi = -d eps/d theta` is made of shifts of one filtered signal each (Ljung, *System
//! Identification*, 1999, eq. 10.53; with the signs of this notation):
//!
//! | parameter | psi(t) |
//! |---|---|
//! | `a_j` | `-(D/C) u(t-j)` |
//! | `b_j` | `(D/(C F)) e(t-nk-j)` |
//! | `c_j` | `(1/C) eps(t-j)` |
//! | `d_j` | `-(1/C) v(t-j)` |
//! | `f_j` | `-(D/(C F)) w(t-j)` |
//!
//! **Initial states.** With [`InitialState::Zero`] everything before the record is zero and all residuals count. With
//! [`InitialState::Estimate`] nothing is assumed: residuals are used from the first sample at which every input and output
//! in the regression lies inside the record, and what then remains unknown, the nf past values of w and the nc past values of
//! eps, is estimated in each record. eps is affine in these states, so that they are eliminated exactly for each theta
//! (variable projection; G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413-432): with the orthonormal basis Q of
//! their responses, `eps = (I - Q Q') eps_0`. The loss is then a function of theta alone, its gradient is `-psi' eps` exactly
//! (the states are optimal), and the Gauss-Newton matrix is `psi' (I - Q Q') psi` (the approximation of L. Kaufman, *BIT* 15
//! (1975) 49-57). A shifted signal differs from the true derivative only by a free response of 1/F or 1/C, which lies in the
//! span of Q: shifting stays exact.
//!
//! With [`InitialState::Backcast`] the past of w is unknown as before, but that of the noise is stationary
//! ([`crate::pem::stationary_noise`]): the residuals start nd samples earlier, and the state of the noise model counts as r further
//! residuals z. Where there is no input, A plays the part of D and the residuals start with the record.
//!
//! **Weights** multiply the squared residuals; they serve the robust loss.
//!
//! **A long record** passes span by span behind its first part ([`long`]), so that a fit needs no memory beside the record.

use std::{
    borrow::Cow,
    cell::Cell,
    ops::{Deref, DerefMut, Range},
};

use hoid_core::{
    filter::{SecondOrder, divide, divide_from},
    stability::roots_inside,
};
use hoid_model::{Orders, Record};

use crate::{
    linalg::least_squares::{add_scaled, dot, solve_symmetric},
    linalg::products::{Lagged, gram, variance},
    optimize::{Linearisation, Objective},
    pem::initial_states::FreeResponses,
    pem::initial_states::Past,
    pem::stationary_noise::StationaryPast,
};

/// Samples of the first part. A record twice as long counts as long: others, all of some minutes, pass whole.
const HEAD: usize = 1 << 15;

/// What is assumed about the time before a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InitialState {
    /// Input, output and innovations were zero.
    Zero,
    /// Nothing is assumed: the initial states of each record are estimated with the parameters.
    #[default]
    Estimate,
    /// The noise was stationary before the record as well (Box and Jenkins's unconditional sum of squares); of the response
    /// to the input nothing is assumed.
    Backcast,
}

/// Input and output of one record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Data<'a> {
    pub e: &'a [f64],
    pub u: &'a [f64],
}

impl<'a> Data<'a> {
    /// Input and output of each record.
    pub fn of(records: &'a [Record]) -> Vec<Self> {
        let one = |r: &'a Record| Self {
            e: r.input(),
            u: r.output(),
        };
        records.iter().map(one).collect()
    }
}

/// The criterion over one or several records with a common theta.
#[derive(Debug, Clone)]
pub(crate) struct Criterion<'a> {
    pub orders: Orders,
    pub data: Vec<Data<'a>>,
    pub initial: InitialState,
    /// First sample whose residual counts, in each record; at least [`first_residual`].
    pub first: usize,
    /// Square roots of the weights of the residuals of each record, from the first residual on; none where all count the
    /// same.
    pub weights: Option<&'a [Vec<f64>]>,
}

/// First sample whose residual can be had under the rule of the module, for these orders.
pub fn first_residual(orders: &Orders, initial: InitialState) -> usize {
    match initial {
        InitialState::Zero => 0,
        InitialState::Estimate => orders.first_regressed_sample() + orders.nd,
        InitialState::Backcast if orders.nb == 0 => 0,
        InitialState::Backcast => orders.first_regressed_sample(),
    }
}

/// Variance of the output around its mean, from sample `first` of each record on.
pub(crate) fn output_variance(data: &[Data<'_>], first: usize) -> f64 {
    let outputs: Vec<&[f64]> = data.iter().map(|d| &d.u[first..]).collect();
    variance(&outputs)
}

/// Signals of one record at one theta. Each has `pad` zeros in front, so that a shift needs no case distinction.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    pad: usize,
    s: Vec<f64>,
    w: Vec<f64>,
    v: Vec<f64>,
    eps: Vec<f64>,
    filtered: [Vec<f64>; 5],
    scratch: Vec<f64>,
}

thread_local! {
    /// The workspace that the last fit on this thread has left.
    static LEFT: Cell<Option<Workspace>> = const { Cell::new(None) };
}

/// A workspace for one fit, kept for the next on the same thread: getting fresh pages for each fit costs a quarter of a study's time. What is in
/// it is written before it is read.
#[derive(Debug, Default)]
pub(crate) struct Borrowed(Workspace);

impl Workspace {
    /// The workspace of this thread, or a new one when it is in use.
    pub fn of_thread() -> Borrowed {
        Borrowed(LEFT.take().unwrap_or_default())
    }
}

impl Deref for Borrowed {
    type Target = Workspace;

    fn deref(&self) -> &Workspace {
        &self.0
    }
}

impl DerefMut for Borrowed {
    fn deref_mut(&mut self) -> &mut Workspace {
        &mut self.0
    }
}

impl Drop for Borrowed {
    fn drop(&mut self) {
        if self.0.eps.capacity() <= KEPT {
            LEFT.set(Some(std::mem::take(&mut self.0)));
        }
    }
}

/// Longest signals that are kept between fits, samples: a record of an hour at 100 Hz would occupy the thread for ever.
const KEPT: usize = 1 << 17;

/// Polynomials of theta.
#[derive(Debug, Clone, Copy)]
struct Parts<'t> {
    a: &'t [f64],
    b: &'t [f64],
    c: &'t [f64],
    d: &'t [f64],
    f: &'t [f64],
}

/// A column of psi.
struct Column<'w> {
    values: Cow<'w, [f64]>,
    sign: f64,
    /// True when this is the column before it, one sample later.
    follows: bool,
}

/// What a pass over a record found besides its signals.
#[derive(Default)]
struct Passed {
    free: FreeResponses,
    noise: Option<StationaryPast>,
    z: Vec<f64>,
}

impl<'t> Parts<'t> {
    fn split(orders: &Orders, theta: &'t [f64]) -> Self {
        let (a, rest) = theta.split_at(orders.na);
        let (b, rest) = rest.split_at(orders.nb);
        let (c, rest) = rest.split_at(orders.nc);
        let (d, f) = rest.split_at(orders.nd);
        Self { a, b, c, d, f }
    }
}

impl Criterion<'_> {
    /// Number of residuals over all records.
    pub fn residuals(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Number of initial states over all records.
    pub fn states(&self) -> usize {
        match self.initial {
            InitialState::Zero => 0,
            InitialState::Estimate => self.data.len() * (self.orders.nf + self.orders.nc),
            // The states of the noise are random numbers with a known variance, not parameters.
            InitialState::Backcast => self.data.len() * self.orders.nf,
        }
    }

    /// Sum of squared residuals, without derivatives.
    #[cfg(test)]
    pub fn sum_of_squares(&self, theta: &[f64], workspace: &mut Workspace) -> f64 {
        self.linearise(theta, workspace).sum_of_squares
    }

    /// A and B of least squares for the other coefficients of theta, in one step because the residual is affine in them, and
    /// the sum of squares there. `None` when the regressors are singular or the loss is not finite.
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

    /// As [`Objective::linearise`], with the derivatives to the coefficients of one polynomial alone; those to others are zero.
    pub fn linearise_block(&self, theta: &[f64], block: Block, workspace: &mut Workspace) -> Linearisation {
        let (p, place) = (theta.len(), block.place(&self.orders));
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

    /// Residuals of one record, from [`Criterion::first`] on.
    pub fn residuals_of(&self, theta: &[f64], record: usize, workspace: &mut Workspace) -> Vec<f64> {
        let mut residuals = Vec::new();
        self.pass(theta, &[], record, workspace, |_, counted, ws| {
            // The whole of a short record at once; of a long one no more than it needs.
            residuals.reserve_exact(self.data[record].u.len() - self.first - residuals.len());
            residuals.extend_from_slice(&ws.eps[counted]);
        });
        residuals
    }

    /// Columns of psi in one record, from the first residual on, with the initial states projected out.
    pub fn jacobian(&self, theta: &[f64], record: usize, workspace: &mut Workspace) -> Vec<Vec<f64>> {
        let data = self.data[record];
        let passed = self.residual_pass(theta, record, data, workspace);
        self.gradient_pass(theta, &Block::ALL, data, workspace);
        let parts = Parts::split(&self.orders, theta);
        let project = |column: Column<'_>| {
            let mut column: Vec<f64> = column.values.iter().map(|x| column.sign * x).collect();
            let components: Vec<f64> = passed.free.basis().map(|q| dot(q, &column[..q.len()])).collect();
            for (q, component) in passed.free.basis().zip(components) {
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

    /// Adds one record to the normal equations of the coefficients of these polynomials.
    fn add_record(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        ws: &mut Workspace,
        total: &mut Linearisation,
    ) -> Passed {
        let parts = Parts::split(&self.orders, theta);
        self.pass(theta, blocks, record, ws, |passed, counted, ws| {
            let columns = self.columns(&parts, counted.clone(), ws, blocks);
            self.accumulate(passed, &columns, record, &ws.eps[counted], total);
        })
    }

    /// Passes a record, a long one span by span ([`long`]), and shows its residuals and the signals of these polynomials: where in the workspace those
    /// stand that count, with what the pass has found besides. Gives that of the initial states back.
    fn pass(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        ws: &mut Workspace,
        mut show: impl FnMut(&Passed, Range<usize>, &Workspace),
    ) -> Passed {
        if let Some(passed) = self.pass_in_spans(theta, blocks, record, HEAD, ws, &mut show) {
            return passed;
        }
        let data = self.data[record];
        let passed = self.residual_pass(theta, record, data, ws);
        self.gradient_pass(theta, blocks, data, ws);
        show(&passed, ws.pad + self.first..ws.pad + data.u.len(), ws);
        passed
    }

    /// First sample at which w and v are computed.
    fn first_regressed(&self) -> usize {
        match self.initial {
            InitialState::Zero => 0,
            InitialState::Estimate => self.first - self.orders.nd,
            InitialState::Backcast => self.first,
        }
    }

    /// The polynomial whose past is that of the noise: D, and A where there is no input.
    fn noise_poles<'t>(&self, parts: &Parts<'t>) -> &'t [f64] {
        if self.orders.nb == 0 && self.orders.nd == 0 {
            parts.a
        } else {
            parts.d
        }
    }

    /// w, v and eps of a record, or of its first part, with the best initial states in them.
    fn residual_pass(&self, theta: &[f64], record: usize, data: Data<'_>, ws: &mut Workspace) -> Passed {
        let parts = Parts::split(&self.orders, theta);
        let n = data.u.len();
        let o = &self.orders;
        ws.make_room(o, n);
        let pad = ws.pad;
        let regressed = self.first_regressed();
        let start = match self.initial {
            InitialState::Zero => 0,
            InitialState::Estimate | InitialState::Backcast => self.first,
        };

        self.filter_input(&parts, data, ws);
        let from = pad + regressed;
        ws.w[..from].fill(0.0);
        ws.v[..from].fill(0.0);
        self.response(&parts, data, regressed..n, from, ws);
        whiten(parts.c, parts.d, &ws.v, &mut ws.eps, pad + start);

        let weights = self.weights.map(|all| all[record].as_slice());
        let eps = &mut ws.eps[pad + self.first..];
        if let Some(weights) = weights {
            eps.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
        }
        let mut passed = Passed::default();
        if self.initial != InitialState::Zero {
            if self.initial == InitialState::Backcast {
                passed.noise = StationaryPast::of(parts.c, self.noise_poles(&parts));
            }
            let past = Past {
                c: parts.c,
                d: parts.d,
                f: parts.f,
                lead: self.first - regressed,
                noise: passed.noise.as_ref(),
                weights,
            };
            passed.free = FreeResponses::of(&past, n - self.first);
            passed.z = passed
                .free
                .eliminate(&mut ws.w[pad + regressed..], &mut ws.v[pad + regressed..], eps);
        }
        if let Some(weights) = weights {
            eps.iter_mut().zip(weights).for_each(|(x, w)| *x /= w);
        }
        passed
    }

    /// `w = B s` and `v = A u - w` of these samples, the first of which stands at `from` in the workspace.
    fn response(&self, parts: &Parts<'_>, data: Data<'_>, samples: Range<usize>, from: usize, ws: &mut Workspace) {
        let to = from + samples.len();
        let u = &data.u[samples.clone()];
        let (w, v) = (&mut ws.w[from..to], &mut ws.v[from..to]);
        match *parts.b {
            // The orders of the operator in one pass.
            [b0, b1] => {
                let inputs = ws.s[from..to].iter().zip(&ws.s[from - 1..to - 1]).zip(u);
                for ((w, v), ((s0, s1), u)) in w.iter_mut().zip(&mut *v).zip(inputs) {
                    *w = b0 * s0 + b1 * s1;
                    *v = u - *w;
                }
            }
            _ => {
                w.fill(0.0);
                for (j, &bj) in parts.b.iter().enumerate() {
                    add_scaled(w, bj, &ws.s[from - j..to - j]);
                }
                for ((v, w), u) in v.iter_mut().zip(&*w).zip(u) {
                    *v = u - w;
                }
            }
        }
        for (i, &ai) in parts.a.iter().enumerate() {
            let first = samples.start.max(i + 1);
            if first < samples.end {
                add_scaled(
                    &mut v[first - samples.start..],
                    ai,
                    &data.u[first - i - 1..samples.end - i - 1],
                );
            }
        }
    }

    /// The signals whose shifts are the columns of psi.
    fn gradient_pass(&self, theta: &[f64], blocks: &[Block], data: Data<'_>, ws: &mut Workspace) {
        let parts = Parts::split(&self.orders, theta);
        let (o, pad) = (&self.orders, ws.pad);
        let regressed = self.first_regressed();
        if blocks.contains(&Block::A) {
            self.filter_output(&parts, data, ws);
        }
        if blocks.contains(&Block::B) {
            self.whiten_input(&parts, ws);
        }
        let [_, _, xc, xd, xf] = &mut ws.filtered;
        if o.nc > 0 && blocks.contains(&Block::C) {
            xc[..pad].fill(0.0);
            divide(parts.c, &ws.eps[pad..], &mut xc[pad..]);
        }
        // Without C the signal of D is v itself.
        if o.nd > 0 && o.nc > 0 && blocks.contains(&Block::D) {
            xd[..pad].fill(0.0);
            divide(parts.c, &ws.v[pad..], &mut xd[pad..]);
        }
        if o.nf > 0 && blocks.contains(&Block::F) {
            let from = pad + regressed;
            if passes_once(o) {
                // w is zero before.
                let d1 = parts.d.first().copied().unwrap_or(0.0);
                xf[..from].fill(0.0);
                divide_and_whiten([parts.f[0], parts.f[1]], d1, &ws.w[from..], &mut xf[from..]);
            } else {
                ws.scratch[..from].copy_from_slice(&ws.w[..from]);
                divide(parts.f, &ws.w[from..], &mut ws.scratch[from..]);
                whiten(parts.c, parts.d, &ws.scratch, xf, from);
            }
        }
    }

    /// `(D/C) u`; with a stationary past u, because each shift is cut at the first residual before it is whitened.
    fn filter_output(&self, parts: &Parts<'_>, data: Data<'_>, ws: &mut Workspace) {
        if self.orders.na == 0 {
            return;
        }
        let pad = ws.pad;
        ws.scratch[..pad].fill(0.0);
        ws.scratch[pad..].copy_from_slice(data.u);
        let signal = &mut ws.filtered[Block::A as usize];
        if self.initial == InitialState::Backcast {
            signal.copy_from_slice(&ws.scratch);
        } else {
            whiten(parts.c, parts.d, &ws.scratch, signal, pad);
        }
    }

    /// `s = (1/F) e(t-nk)`, of which w is a moving sum: `w = B s`. Where the initial states are estimated, w may differ from the
    /// response that starts at rest by a free response of 1/F.
    fn filter_input(&self, parts: &Parts<'_>, data: Data<'_>, ws: &mut Workspace) {
        let (pad, n) = (ws.pad, data.u.len());
        if self.orders.nb == 0 {
            return;
        }
        let from = pad + self.orders.nk.min(n);
        ws.s[..from].fill(0.0);
        divide(parts.f, &data.e[..pad + n - from], &mut ws.s[from..]);
    }

    /// `(D/C) s`; with a stationary past s.
    fn whiten_input(&self, parts: &Parts<'_>, ws: &mut Workspace) {
        if self.orders.nb == 0 {
            return;
        }
        let from = ws.pad + self.orders.nk.min(ws.s.len() - ws.pad);
        let signal = &mut ws.filtered[Block::B as usize];
        if self.initial == InitialState::Backcast {
            signal.copy_from_slice(&ws.s);
        } else {
            whiten(parts.c, parts.d, &ws.s, signal, from);
        }
    }

    /// Columns of psi, in the order of theta, over these places of the workspace.
    fn columns<'w>(
        &self,
        parts: &Parts<'_>,
        counted: Range<usize>,
        ws: &'w Workspace,
        blocks: &[Block],
    ) -> Vec<Column<'w>> {
        let (first, end) = (counted.start, counted.end);
        let mut columns = Vec::with_capacity(self.orders.parameters());
        for &block in blocks {
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
                    follows: j > from && !late,
                });
            }
        }
        columns
    }

    /// Adds one record to the normal equations of these columns.
    fn accumulate(
        &self,
        passed: &Passed,
        columns: &[Column<'_>],
        record: usize,
        eps: &[f64],
        total: &mut Linearisation,
    ) {
        let Some(all) = self.weights else {
            return add_products(passed, columns, eps, total);
        };
        let weighted = |x: &[f64]| -> Vec<f64> { x.iter().zip(&all[record]).map(|(x, w)| x * w).collect() };
        let columns: Vec<Column<'_>> = columns
            .iter()
            .map(|column| Column {
                values: Cow::Owned(weighted(&column.values)),
                sign: column.sign,
                follows: false,
            })
            .collect();
        add_products(passed, &columns, &weighted(eps), total);
    }

    /// What the penalty on the stationary past adds to the descent.
    fn add_penalty(&self, passed: &Passed, total: &mut Linearisation) {
        let Some(noise) = &passed.noise else { return };
        let o = &self.orders;
        total.sum_of_squares += dot(&passed.z, &passed.z);
        let (poles, poles_at) = if o.nb == 0 && o.nd == 0 {
            (o.na, 0)
        } else {
            (o.nd, o.na + o.nb + o.nc)
        };
        let (by_c, by_d) = noise.descent(&passed.z, o.nc, poles);
        add_scaled(&mut total.descent[o.na + o.nb..], 1.0, &by_c);
        add_scaled(&mut total.descent[poles_at..], 1.0, &by_d);
    }
}

/// Products of the residuals and the columns of psi, with the initial states projected out.
fn add_products(passed: &Passed, columns: &[Column<'_>], eps: &[f64], total: &mut Linearisation) {
    let p = columns.len();
    // Components of each column in the space of the initial states, one row a column.
    let states = passed.free.basis().count();
    let mut inside = Vec::with_capacity(p * states);
    for column in columns {
        inside.extend(passed.free.basis().map(|q| dot(q, &column.values[..q.len()])));
    }
    let residuals = Lagged {
        values: eps,
        follows: false,
    };
    let lagged = columns.iter().map(|column| Lagged {
        values: &column.values,
        follows: column.follows,
    });
    let all: Vec<Lagged<'_>> = std::iter::once(residuals).chain(lagged).collect();
    let (raw, q) = (gram(&all), p + 1);
    total.sum_of_squares += raw[0];
    for (i, column) in columns.iter().enumerate() {
        total.descent[i] += column.sign * raw[i + 1];
        for (j, other) in columns[..=i].iter().enumerate() {
            let projected = raw[(i + 1) * q + j + 1]
                - dot(
                    &inside[i * states..(i + 1) * states],
                    &inside[j * states..(j + 1) * states],
                );
            let product = column.sign * other.sign * projected;
            total.gram[i * p + j] += product;
            if i != j {
                total.gram[j * p + i] += product;
            }
        }
    }
}

impl Objective for Criterion<'_> {
    type Workspace = Workspace;

    /// Roots of C and F inside the unit circle; a stationary past needs those of the noise poles there too.
    fn is_feasible(&self, theta: &[f64]) -> bool {
        let parts = Parts::split(&self.orders, theta);
        theta.iter().all(|v| v.is_finite())
            && roots_inside(parts.f, 1.0)
            && roots_inside(parts.c, 1.0)
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
            let passed = self.add_record(theta, &Block::ALL, index, workspace, &mut total);
            self.add_penalty(&passed, &mut total);
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
        let blocks = [c..d, d + o.nd..o.parameters(), noise_poles];
        blocks.into_iter().filter(|block| !block.is_empty()).collect()
    }

    fn output_power(&self) -> f64 {
        self.data.iter().map(|d| dot(d.u, d.u)).sum()
    }
}

/// The polynomials as blocks of theta; the number is the place of their signal in the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Block {
    A,
    B,
    C,
    D,
    F,
}

impl Block {
    const ALL: [Self; 5] = [Self::A, Self::B, Self::C, Self::D, Self::F];

    /// Its coefficients in theta.
    pub fn place(self, o: &Orders) -> Range<usize> {
        let counts = [o.na, o.nb, o.nc, o.nd, o.nf];
        let from = counts[..self as usize].iter().sum();
        from..from + counts[self as usize]
    }

    /// First shift, number of shifts, sign of psi.
    fn shifts(self, o: &Orders) -> (usize, usize, f64) {
        match self {
            Self::A => (1, o.na, -1.0),
            Self::B => (0, o.nb, 1.0),
            Self::C => (1, o.nc, 1.0),
            Self::D => (1, o.nd, -1.0),
            Self::F => (1, o.nf, -1.0),
        }
    }
}

impl Workspace {
    /// Makes room for a record, for the signals that these orders have; every pass writes all of a signal before it reads it, zeros in
    /// front included.
    fn make_room(&mut self, o: &Orders, n: usize) {
        let pad = o.na.max(o.nb).max(o.nd).max(o.nc + o.nf);
        self.pad = pad;
        let [a, b, c, d, f] = &mut self.filtered;
        for (signal, needed) in [
            (&mut self.s, o.nb > 0),
            (&mut self.w, true),
            (&mut self.v, true),
            (&mut self.eps, true),
            (&mut self.scratch, o.na > 0 || (o.nf > 0 && !passes_once(o))),
            (a, o.na > 0),
            (b, o.nb > 0),
            (c, o.nc > 0),
            (d, o.nd > 0 && o.nc > 0),
            (f, o.nf > 0),
        ] {
            signal.resize(if needed { pad + n } else { 0 }, 0.0);
        }
    }
}

/// True for the poles of the operator with a noise model of first order or none, whose signal of F comes from one pass.
fn passes_once(o: &Orders) -> bool {
    (o.nc, o.nf) == (0, 2) && o.nd <= 1
}

/// `y = (1 + d1 q^-1) / (1 + f1 q^-1 + f2 q^-2) x` from rest.
fn divide_and_whiten([f1, f2]: [f64; 2], d1: f64, x: &[f64], y: &mut [f64]) {
    let mut filter = SecondOrder::new(f1, f2);
    let mut before = 0.0;
    let (x_blocks, x_rest) = x.as_chunks::<4>();
    let (y_blocks, y_rest) = y.as_chunks_mut::<4>();
    for (y, x) in y_blocks.iter_mut().zip(x_blocks) {
        let s = filter.four(*x);
        *y = [s[0] + d1 * before, s[1] + d1 * s[0], s[2] + d1 * s[1], s[3] + d1 * s[2]];
        before = s[3];
    }
    for (y, x) in y_rest.iter_mut().zip(x_rest) {
        let s = filter.one(*x);
        *y = s + d1 * before;
        before = s;
    }
}

/// `y = (D/C) x` from index `from` on, zero before: zero state of 1/C, x as it is before.
fn whiten(c: &[f64], d: &[f64], x: &[f64], y: &mut [f64], from: usize) {
    if from >= x.len() {
        y.fill(0.0);
        return;
    }
    y[..from].fill(0.0);
    whiten_on(c, d, x, y, from);
}

/// `y = (D/C) x` from index `from` on; what stands before is what has gone into the filter and come out of it so far.
fn whiten_on(c: &[f64], d: &[f64], x: &[f64], y: &mut [f64], from: usize) {
    match *d {
        // The first lag in the same pass as the copy.
        [d1, ref rest @ ..] if from > 0 => {
            for ((y, x0), x1) in y[from..].iter_mut().zip(&x[from..]).zip(&x[from - 1..]) {
                *y = x0 + d1 * x1;
            }
            add_lags(rest, 2, x, y, from);
        }
        _ => {
            y[from..].copy_from_slice(&x[from..]);
            add_lags(d, 1, x, y, from);
        }
    }
    divide_from(c, y, from);
}

/// `y(t) += sum_i d_i x(t - first_lag - i)` from index `from` on.
fn add_lags(d: &[f64], first_lag: usize, x: &[f64], y: &mut [f64], from: usize) {
    for (i, &di) in d.iter().enumerate() {
        let lag = first_lag + i;
        let start = from.max(lag);
        if start < x.len() {
            add_scaled(&mut y[start..], di, &x[start - lag..x.len() - lag]);
        }
    }
}

mod spans;
#[cfg(test)]
mod tests;
