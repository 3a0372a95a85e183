//! The criterion and its derivatives for several records at once, each with a theta of its own.
//!
//! What [`crate::prediction_error`] says of one Box-Jenkins model without C, with its initial states eliminated, for a record in each lane:
//!
//! `s = e(t-nk)/F`,  `w = B s`,  `v = u - w`,  `eps = D v`,  `x_b = D s`,  `r = w/F`,  `x_f = D r`
//!
//! The columns of psi are shifts of `x_b`, `-v` and `-x_f`. A recursion over t waits for its own last value, and eight records fill the
//! waiting time. All signals of some samples are made and multiplied before the next samples are begun, so that they stay in the
//! nearest memory; only the record itself is read from further away. The first of these spans reaches as far as the free responses
//! do, because the initial states must be known before w is filtered again.
//!
//! Every operation acts on each lane alone, and what one lane needs longer than another is zero there: the bits of a lane depend
//! neither on the registers nor on its neighbours. The sums run over time in another order than those of the criterion alone: they
//! differ from it by rounding.

use hoid_core::number::Number;
use hoid_lanes::SideBySide;
use hoid_model::Orders;

use super::{columns::Columns, rows::Rows};

/// Samples that are made and multiplied at a time.
const SPAN: usize = 64;
/// Samples of a free response between two looks at whether it has died away.
const LOOK: usize = 128;

/// Signals of a span, a row for each sample and in it a number for each lane. The rows before the first hold the end of the span before.
#[derive(Debug, Default)]
pub(super) struct Room {
    s: Rows,
    pub v: Rows,
    pub eps: Rows,
    pub x_b: Rows,
    r: Rows,
    pub x_f: Rows,
    /// Impulse response of 1/F, and `D/F`.
    h: Vec<f64>,
    dh: Vec<f64>,
    /// Orthonormal responses to the initial states, one after the other.
    q: Vec<f64>,
}

/// Sums over one record in each lane.
#[derive(Debug, Default)]
pub(super) struct Sums {
    /// Products of eps and the columns of psi without their signs, `[eps, x_b.., v.., x_f..]` by rows, the initial states projected out.
    pub products: Vec<f64>,
    /// Lanes whose free responses are not independent: nothing is said of them.
    pub dependent: Vec<bool>,
}

/// One pass.
pub(super) struct Pass<'a> {
    pub orders: Orders,
    /// First residual.
    pub first: usize,
    /// Samples.
    pub n: usize,
    /// Input and output, by rows.
    pub e: &'a [f64],
    pub u: &'a [f64],
    /// theta, a row for each parameter.
    pub theta: &'a [f64],
    pub room: &'a mut Room,
    pub sums: &'a mut Sums,
}

impl SideBySide for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Number>(self, zero: R) {
        let width = zero.lanes();
        let Self {
            orders: o,
            first,
            n,
            e,
            u,
            theta,
            room,
            sums,
        } = self;
        let (b, rest) = theta.split_at(o.nb * width);
        let (d, f) = rest.split_at(o.nd * width);
        let regressed = first - o.nd;
        let history = o.nb.max(o.nd).max(o.nf);
        let columns = Columns {
            nb: o.nb,
            nd: o.nd,
            nf: o.nf,
        };
        let states = free_responses(zero, d, f, n - first, room, &mut sums.dependent);
        let begin = o.nk;
        let mut to = first + states.rows;
        room.begin(history, (to - begin).max(SPAN), width);
        sums.products.clear();
        sums.products.resize(columns.count() * columns.count() * width, 0.0);
        let products = &mut sums.products;
        let mut inside = Vec::new();

        let mut from = begin;
        loop {
            let count = to - from;
            let at = history * width;
            let end = at + count * width;
            let (inputs, outputs) = (
                &e[(from - o.nk) * width..(to - o.nk) * width],
                &u[from * width..to * width],
            );
            respond(zero, [b, f], [inputs, outputs], room, at);
            if from == begin {
                // Nothing is known of w before all of its regressors lie inside the record.
                room.r[at..at + (regressed - begin) * width].fill(0.0);
                room.v[at..at + (regressed - begin) * width].fill(0.0);
            }
            whiten(zero, d, &room.v, &mut room.eps[at..end], at);
            whiten(zero, d, &room.s, &mut room.x_b[at..end], at);
            let mut counted = history;
            if from == begin {
                counted += first - begin;
                states.eliminate(zero, room, history + regressed - begin, counted);
            }
            filter_response(zero, [d, f], &mut room.r[..end], &mut room.x_f[at..end], at);
            if from == begin {
                inside = states.components(zero, &columns, room, counted);
                columns.add_row(zero, room, counted, 1.0, products);
            }
            columns.add_products(zero, room, counted, history + count, products);
            if to == n {
                // One row later than the last, a column that follows is the one before it in the last.
                columns.add_row(zero, room, history + count, -1.0, products);
                break;
            }
            room.go_on(history, count, width);
            (from, to) = (to, (to + SPAN).min(n));
        }
        columns.complete(zero, &inside, o.nf, products);
    }
}

impl Room {
    /// Room for spans of so many samples, with zeros before the first.
    fn begin(&mut self, history: usize, longest: usize, width: usize) {
        for signal in [
            &mut self.s,
            &mut self.v,
            &mut self.eps,
            &mut self.x_b,
            &mut self.r,
            &mut self.x_f,
        ] {
            signal.make_room((history + longest) * width);
            signal[..history * width].fill(0.0);
        }
    }

    /// Keeps the end of a span for the next.
    fn go_on(&mut self, history: usize, count: usize, width: usize) {
        for signal in [&mut self.s, &mut self.v, &mut self.x_b, &mut self.r, &mut self.x_f] {
            signal.copy_within(count * width..(count + history) * width, 0);
        }
    }
}

/// The responses to the initial states of 1/F.
struct Responses<R> {
    /// Rows of each, from the first residual on.
    rows: usize,
    nf: usize,
    /// `G[:, k] = sum over l <= k of Q_l r[k nf + l]`.
    r: Vec<R>,
}

impl<R: Number> Responses<R> {
    /// Takes the best initial states into w, v and eps: w begins in row `regressed` of the span, the residuals in row `counted`.
    #[inline(always)]
    fn eliminate(&self, zero: R, room: &mut Room, regressed: usize, counted: usize) {
        let (width, nf) = (zero.lanes(), self.nf);
        let eps = &mut room.eps[counted * width..(counted + self.rows) * width];
        let mut x = Vec::with_capacity(nf);
        for k in 0..nf {
            x.push(product(zero, self.response(&room.q, k, width), eps));
        }
        for k in 0..nf {
            add_scaled(-x[k], self.response(&room.q, k, width), eps);
        }
        // R x = -Q' eps by back substitution.
        for k in (0..nf).rev() {
            x[k] = -x[k];
            for l in k + 1..nf {
                x[k] = x[k] - self.r[l * nf + k] * x[l];
            }
            x[k] = x[k] / self.r[k * nf + k];
        }
        for k in 0..nf {
            let from = ((regressed + k) * width).min(room.r.len());
            let count = room.h.len().min(room.r.len() - from);
            add_scaled(x[k], &room.h[..count], &mut room.r[from..from + count]);
            add_scaled(-x[k], &room.h[..count], &mut room.v[from..from + count]);
        }
    }

    #[inline(always)]
    fn response<'q>(&self, q: &'q [f64], k: usize, width: usize) -> &'q [f64] {
        &q[k * self.rows * width..(k + 1) * self.rows * width]
    }

    /// Components of each column in the space of the responses, a row for each column.
    #[inline(always)]
    fn components(&self, zero: R, columns: &Columns, room: &Room, counted: usize) -> Vec<R> {
        let width = zero.lanes();
        let mut inside = Vec::with_capacity(columns.count() * self.nf);
        for column in 0..columns.count() {
            let values = columns.rows(room, column, counted, counted + self.rows, width);
            for k in 0..self.nf {
                inside.push(product(zero, self.response(&room.q, k, width), values));
            }
        }
        inside
    }
}

/// The orthonormal responses of `residuals` residuals, as [`crate::initial_states`] makes them.
#[inline(always)]
fn free_responses<R: Number>(
    zero: R,
    d: &[f64],
    f: &[f64],
    residuals: usize,
    room: &mut Room,
    dependent: &mut Vec<bool>,
) -> Responses<R> {
    let width = zero.lanes();
    let (nd, nf) = (d.len() / width, f.len() / width);
    impulse_response(zero, f, residuals + nd, &mut room.h);
    let length = room.h.len() / width;
    let longest = (length + nd).min(residuals + nd);
    room.h.resize(longest * width, 0.0);
    room.dh.clear();
    room.dh.extend_from_slice(&room.h);
    for i in 0..nd {
        let (k, lag) = (zero.load(&d[i * width..]), (i + 1) * width);
        if lag < room.dh.len() {
            add_scaled(k, &room.h[..longest * width - lag], &mut room.dh[lag..]);
        }
    }
    room.h.truncate(length * width);
    let rows = (length + nf - 1).min(residuals);
    room.q.clear();
    room.q.resize(nf * rows * width, 0.0);
    for k in 0..nf {
        // The state enters k samples after w starts, which is nd samples before the first residual.
        let (late, early) = (k.saturating_sub(nd), nd.saturating_sub(k));
        let count = (longest - early).min(rows - late.min(rows));
        let to = (k * rows + late) * width;
        add_scaled(
            zero.like(-1.0),
            &room.dh[early * width..(early + count) * width],
            &mut room.q[to..to + count * width],
        );
    }
    dependent.clear();
    dependent.resize(width, false);
    let mut r = vec![zero; nf * nf];
    for k in 0..nf {
        let (before, rest) = room.q.split_at_mut(k * rows * width);
        let column = &mut rest[..rows * width];
        let size = root(product(zero, column, column));
        // Twice, for orthogonality to rounding.
        for _ in 0..2 {
            for (l, q) in before.chunks_exact(rows * width).enumerate() {
                let component = product(zero, q, column);
                r[k * nf + l] = r[k * nf + l] + component;
                add_scaled(-component, q, column);
            }
        }
        let left = root(product(zero, column, column));
        for lane in 0..width {
            let independent = left.lane(lane) > 1e-10 * size.lane(lane);
            dependent[lane] |= !independent;
        }
        for value in column.chunks_exact_mut(width) {
            (zero.load(value) / left).store(value);
        }
        r[k * nf + k] = left;
    }
    Responses { rows, nf, r }
}

/// Impulse response of 1/F until it has died away in all lanes (1e-16 of its largest value) or `longest` is reached; zero in a lane in
/// which it has died away before.
#[inline(always)]
fn impulse_response<R: Number>(zero: R, f: &[f64], longest: usize, h: &mut Vec<f64>) {
    let (width, nf) = (zero.lanes(), f.len() / zero.lanes());
    // Rows of zeros for what lies before.
    h.clear();
    h.resize(nf * width, 0.0);
    let mut impulse = zero.like(1.0);
    let (mut largest, mut ends) = (vec![1.0_f64; width], vec![usize::MAX; width]);
    let mut rows = nf;
    while rows < nf + longest && ends.contains(&usize::MAX) {
        let to = (rows + LOOK).min(nf + longest);
        h.resize(to * width, 0.0);
        for row in rows..to {
            let mut y = impulse;
            impulse = zero;
            for i in (0..nf).rev() {
                y = y - zero.load(&f[i * width..]) * zero.load(&h[(row - 1 - i) * width..]);
            }
            y.store(&mut h[row * width..]);
        }
        for lane in 0..width {
            let mut size = 0.0_f64;
            for row in rows..to {
                size = size.max(h[row * width + lane].abs());
            }
            largest[lane] = largest[lane].max(size);
            if size < 1e-16 * largest[lane] {
                ends[lane] = ends[lane].min(to);
            }
        }
        rows = to;
    }
    for (lane, end) in ends.iter().enumerate() {
        for row in *end.min(&rows)..rows {
            h[row * width + lane] = 0.0;
        }
    }
    h.drain(..nf * width);
}

#[inline(always)]
fn root<R: Number>(mut x: R) -> R {
    for lane in 0..x.lanes() {
        x.set_lane(lane, x.lane(lane).sqrt());
    }
    x
}

/// `x' y` in each lane.
#[inline(always)]
fn product<R: Number>(zero: R, x: &[f64], y: &[f64]) -> R {
    let width = zero.lanes();
    let mut sum = zero;
    for (x, y) in x.chunks_exact(width).zip(y.chunks_exact(width)) {
        sum = sum + zero.load(x) * zero.load(y);
    }
    sum
}

/// `y += k x`.
#[inline(always)]
fn add_scaled<R: Number>(k: R, x: &[f64], y: &mut [f64]) {
    let width = k.lanes();
    for (y, x) in y.chunks_exact_mut(width).zip(x.chunks_exact(width)) {
        (k.load(y) + k * k.load(x)).store(y);
    }
}

/// `s = e/F`, `w = B s` (in the place of r) and `v = u - w` from place `at` on.
#[inline(always)]
fn respond<R: Number>(zero: R, [b, f]: [&[f64]; 2], [e, u]: [&[f64]; 2], room: &mut Room, at: usize) {
    let (width, end) = (zero.lanes(), at + e.len());
    if (b.len(), f.len()) == (2 * width, 2 * width) {
        // The orders of the operator in one pass.
        let (b0, b1) = (zero.load(b), zero.load(&b[width..]));
        let (f1, f2) = (zero.load(f), zero.load(&f[width..]));
        let (mut s1, mut s2) = (zero.load(&room.s[at - width..]), zero.load(&room.s[at - 2 * width..]));
        let inputs = e.chunks_exact(width).zip(u.chunks_exact(width));
        let signals = room.s[at..end]
            .chunks_exact_mut(width)
            .zip(room.r[at..end].chunks_exact_mut(width));
        for (((e, u), (s, w)), v) in inputs.zip(signals).zip(room.v[at..end].chunks_exact_mut(width)) {
            let s0 = (zero.load(e) - f2 * s2) - f1 * s1;
            let w0 = b0 * s0 + b1 * s1;
            s0.store(s);
            w0.store(w);
            (zero.load(u) - w0).store(v);
            (s2, s1) = (s1, s0);
        }
        return;
    }
    divide(zero, f, e, &mut room.s, at);
    moving_sum(zero, b, &room.s, &mut room.r[at..end], at);
    let rows = room.v[at..end]
        .chunks_exact_mut(width)
        .zip(room.r[at..end].chunks_exact(width));
    for ((v, w), u) in rows.zip(u.chunks_exact(width)) {
        (zero.load(u) - zero.load(w)).store(v);
    }
}

/// `r = w/F`, which takes the place of w from place `at` on, and `x_f = D r`.
#[inline(always)]
fn filter_response<R: Number>(zero: R, [d, f]: [&[f64]; 2], r: &mut [f64], x_f: &mut [f64], at: usize) {
    let width = zero.lanes();
    if (d.len(), f.len()) == (width, 2 * width) {
        let (d1, f1, f2) = (zero.load(d), zero.load(f), zero.load(&f[width..]));
        let (mut r1, mut r2) = (zero.load(&r[at - width..]), zero.load(&r[at - 2 * width..]));
        for (r, x_f) in r[at..].chunks_exact_mut(width).zip(x_f.chunks_exact_mut(width)) {
            let r0 = (zero.load(r) - f2 * r2) - f1 * r1;
            r0.store(r);
            (r0 + d1 * r1).store(x_f);
            (r2, r1) = (r1, r0);
        }
        return;
    }
    divide_again(zero, f, r, at);
    whiten(zero, d, r, x_f, at);
}

/// `y = x/F` from place `at` on, where y goes on from what stands before.
#[inline(always)]
fn divide<R: Number>(zero: R, f: &[f64], x: &[f64], y: &mut [f64], at: usize) {
    y[at..at + x.len()].copy_from_slice(x);
    let end = at + x.len();
    divide_again(zero, f, &mut y[..end], at);
}

/// `y <- y/F` from place `at` on; before it stands what was divided already.
#[inline(always)]
fn divide_again<R: Number>(zero: R, f: &[f64], y: &mut [f64], at: usize) {
    let width = zero.lanes();
    if f.len() == 2 * width {
        let (f1, f2) = (zero.load(f), zero.load(&f[width..]));
        let (mut y1, mut y2) = (zero.load(&y[at - width..]), zero.load(&y[at - 2 * width..]));
        for value in y[at..].chunks_exact_mut(width) {
            let next = (zero.load(value) - f2 * y2) - f1 * y1;
            next.store(value);
            (y2, y1) = (y1, next);
        }
        return;
    }
    let nf = f.len() / width;
    for row in at / width..y.len() / width {
        let mut next = zero.load(&y[row * width..]);
        for i in (0..nf).rev() {
            next = next - zero.load(&f[i * width..]) * zero.load(&y[(row - 1 - i) * width..]);
        }
        next.store(&mut y[row * width..]);
    }
}

/// `y = D x`, x from place `at` on.
#[inline(always)]
fn whiten<R: Number>(zero: R, d: &[f64], x: &[f64], y: &mut [f64], at: usize) {
    let width = zero.lanes();
    let end = at + y.len();
    if d.is_empty() {
        y.copy_from_slice(&x[at..end]);
        return;
    }
    match d.len() / width {
        1 => whiten_by::<R, 1>(zero, d, &x[at - width..end], y),
        2 => whiten_by::<R, 2>(zero, d, &x[at - 2 * width..end], y),
        3 => whiten_by::<R, 3>(zero, d, &x[at - 3 * width..end], y),
        4 => whiten_by::<R, 4>(zero, d, &x[at - 4 * width..end], y),
        _ => {
            y.copy_from_slice(&x[at..end]);
            for (i, di) in d.chunks_exact(width).enumerate() {
                let lag = (i + 1) * width;
                add_scaled(zero.load(di), &x[at - lag..end - lag], y);
            }
        }
    }
}

/// `y = D x` of order N in one pass; x begins N rows before y.
#[inline(always)]
fn whiten_by<R: Number, const N: usize>(zero: R, d: &[f64], x: &[f64], y: &mut [f64]) {
    let width = zero.lanes();
    let mut k = [zero; N];
    for i in 0..N {
        k[i] = zero.load(&d[i * width..]);
    }
    for (row, y) in y.chunks_exact_mut(width).enumerate() {
        let x = &x[row * width..(row + N + 1) * width];
        let mut sum = zero.load(&x[N * width..]);
        for i in 0..N {
            sum = sum + k[i] * zero.load(&x[(N - 1 - i) * width..]);
        }
        sum.store(y);
    }
}

/// `y = B x`, x from place `at` on.
#[inline(always)]
fn moving_sum<R: Number>(zero: R, b: &[f64], x: &[f64], y: &mut [f64], at: usize) {
    let width = zero.lanes();
    let end = at + y.len();
    y.fill(0.0);
    for (j, bj) in b.chunks_exact(width).enumerate() {
        let lag = j * width;
        add_scaled(zero.load(bj), &x[at - lag..end - lag], y);
    }
}
