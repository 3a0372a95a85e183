//! Filters of gains, level and corrections: one of each form, side by side.
//!
//! Behind the whitening filter, `y = psi(s)' s + eps` with `s = [theta, level, c]`, c the corrections
//! of omega, zeta and tau at which the basis was made, and the prediction
//!
//! `h(s) = sum_i theta_i (x_i + sum_j c_j dx_i/dj) + level D(1)`,
//!
//! which is linear in either of theta and c. With its gradient psi at s the innovation has the
//! variance `S = psi' P psi + sigma^2` (A. H. Jazwinski, *Stochastic Processes and Filtering Theory*,
//! 1970, section 8.3), and with the Student distribution of nu degrees of freedom
//!
//! `w = min(1, (nu + 1)/(nu + eps^2/S))`, `g = P psi/(psi' P psi + sigma^2/w)`,
//! `s <- s + g eps`, `P <- P - g (P psi)'`
//!
//! with eps limited to some standard deviations (J. Meinhold and N. Singpurwalla, JASA 84 (1989)
//! 479-486): an outlier says little.
//!
//! P is symmetric, and only its lower triangle is kept.

use super::{
    basis::{Point, Regressors},
    sizes::{FORMS, GAINS, HELD, LINEAR, STATES},
};
use crate::adaptive::elementary::{ln_1p, ln_of_normal};

/// A number of each form. A filter does the same with the numbers of both.
pub(super) use super::pair::Pair as Forms;
const _: () = assert!(FORMS == 2);

/// Largest correction of omega and zeta, as a share of theirs, and of tau, s.
const FARTHEST: [[f64; 2]; HELD] = [[-0.5, 0.6], [-0.8, 1.5], [-0.1, 0.1]];
/// What `eps^2/(nu S)` counts for at most, and where it is no number.
const LARGEST: f64 = 1e300;
/// Entries of the lower triangle, row by row, and those of the gains among them, which are the first.
const ENTRIES: usize = STATES * (STATES + 1) / 2;
const SHAPE: usize = GAINS * (GAINS + 1) / 2;

/// Where the entry of a row and a column stands.
const fn at(i: usize, j: usize) -> usize {
    let (row, column) = if i < j { (j, i) } else { (i, j) };
    row * (row + 1) / 2 + column
}

/// Lower triangle of a covariance of the gains, for each form.
pub(super) type Shapes = [Forms; SHAPE];

/// The same shape of each form from whole matrices.
pub(super) fn shapes_of(matrices: &[[[f64; GAINS]; GAINS]; FORMS]) -> Shapes {
    let mut shapes = [Forms::ZERO; SHAPE];
    for i in 0..GAINS {
        for j in 0..=i {
            shapes[at(i, j)] = Forms(matrices.map(|m| m[i][j]));
        }
    }
    shapes
}

/// What a sample says to every filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Output behind the whitening filter, responses and their derivatives, D(1).
    y: Forms,
    x: [Forms; GAINS],
    by: [[Forms; GAINS]; HELD],
    level: Forms,
    /// Variance of eps.
    variance: Forms,
    /// Bounds of the corrections.
    bounds: [[Forms; 2]; HELD],
    /// nu and limit, and what is made of them.
    nu: f64,
    limit: f64,
    per_nu: Forms,
    per_more: Forms,
}

impl Seen {
    #[inline(always)]
    pub fn new(y: f64, r: &Regressors, level: f64, variance: f64, point: Point, [nu, limit]: [f64; 2]) -> Self {
        let of = [point.omega, point.zeta, 1.0];
        Self {
            y: Forms::both(y),
            x: r.x.map(Forms::both),
            by: r.by.map(|by| by.map(Forms::both)),
            level: Forms::both(level),
            variance: Forms::both(variance),
            bounds: core::array::from_fn(|i| FARTHEST[i].map(|bound| Forms::both(bound * of[i]))),
            nu,
            limit,
            per_nu: Forms::both(1.0 / nu),
            per_more: Forms::both(1.0 / (nu + 1.0)),
        }
    }
}

/// A filter of each form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kalman {
    /// Gains, level, corrections.
    pub state: [Forms; STATES],
    /// Lower triangle of their covariance.
    pub(super) covariance: [Forms; ENTRIES],
    /// Its weight among those of its form, and the logarithm.
    pub weight: Forms,
    pub log_weight: Forms,
}

crate::state!([] Kalman { state, covariance, weight, log_weight });

/// What a filter foretells of a sample before it takes it: the innovation, `P psi` and `psi' P psi`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foretold {
    pub eps: Forms,
    through: [Forms; STATES],
    spread: Forms,
}

impl Foretold {
    pub const NOTHING: Self = Self {
        eps: Forms::ZERO,
        through: [Forms::ZERO; STATES],
        spread: Forms::ZERO,
    };

    /// How much the sample moves the filter, and the logarithm of its density, but for a constant.
    #[inline(always)]
    pub fn weighed(&self, seen: &Seen) -> (Move, Forms) {
        let Self { eps, spread, .. } = *self;
        let total = spread + seen.variance;
        let square = eps * eps / total;
        let one = Forms::both(1.0);
        let per_weight = ((Forms::both(seen.nu) + square) * seen.per_more).at_least(one);
        let back = Forms::both(-1.0) / (spread + seen.variance * per_weight);
        let mut limited = eps;
        // Hardly ever, and where a number is none.
        if !square.0.iter().all(|square| *square <= seen.limit * seen.limit) {
            let most = total.map(|total| seen.limit * libm::sqrt(total));
            limited = eps.at_least(Forms::ZERO - most).at_most(most);
        }
        let tails = (square * seen.per_nu).at_most(Forms::both(LARGEST)).map(ln_1p);
        let log_density = Forms::both(-0.5) * (total.map(ln_of_normal) + Forms::both(seen.nu + 1.0) * tails);
        (Move { back, limited }, log_density)
    }
}

/// `-1/(psi' P psi + sigma^2/w)`, and the limited innovation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Move {
    back: Forms,
    limited: Forms,
}

impl Move {
    pub const NONE: Self = Self {
        back: Forms::ZERO,
        limited: Forms::ZERO,
    };
}

/// `a' b`.
#[inline(always)]
fn product(a: [Forms; STATES], b: &[Forms; STATES]) -> Forms {
    let mut sum = a[0] * b[0];
    for i in 1..STATES {
        sum += a[i] * b[i];
    }
    sum
}

/// A row of P times psi.
#[inline(always)]
fn row<const I: usize>(p: &[Forms; ENTRIES], psi: &[Forms; STATES]) -> Forms {
    product(core::array::from_fn(|j| p[at(I, j)]), psi)
}

/// A row of P without its share of `g (P psi)'`; `back` is -g.
#[inline(always)]
fn learn<const I: usize>(p: &mut [Forms; ENTRIES], through: &[Forms; STATES], back: Forms) {
    for j in 0..=I {
        p[at(I, j)] += back * through[j];
    }
}

impl Kalman {
    /// Zero, and known exactly.
    pub const ZERO: Self = Self {
        state: [Forms::ZERO; STATES],
        covariance: [Forms::ZERO; ENTRIES],
        weight: Forms::ZERO,
        log_weight: Forms::ZERO,
    };

    /// Prediction and its gradient.
    #[inline(always)]
    fn predicted(&self, seen: &Seen) -> (Forms, [Forms; STATES]) {
        let s = &self.state;
        let mut psi = [Forms::ZERO; STATES];
        let mut sum = seen.level * s[GAINS];
        psi[GAINS] = seen.level;
        for i in 0..GAINS {
            psi[i] = seen.x[i];
            for j in 0..HELD {
                psi[i] += s[LINEAR + j] * seen.by[j][i];
            }
            sum += s[i] * psi[i];
        }
        for j in 0..HELD {
            psi[LINEAR + j] = s[0] * seen.by[j][0];
            for i in 1..GAINS {
                psi[LINEAR + j] += s[i] * seen.by[j][i];
            }
        }
        (sum, psi)
    }

    /// The innovations, without an update.
    pub fn innovation(&self, seen: &Seen) -> Forms {
        seen.y - self.predicted(seen).0
    }

    /// What it foretells of a sample.
    #[inline(always)]
    pub fn foretold(&self, seen: &Seen) -> Foretold {
        let (predicted, psi) = self.predicted(seen);
        let p = &self.covariance;
        let through = [
            row::<0>(p, &psi),
            row::<1>(p, &psi),
            row::<2>(p, &psi),
            row::<3>(p, &psi),
            row::<4>(p, &psi),
            row::<5>(p, &psi),
            row::<6>(p, &psi),
        ];
        Foretold {
            eps: seen.y - predicted,
            through,
            // Rounding may leave a covariance that is not positive where almost nothing is open.
            spread: product(through, &psi).at_least(Forms::ZERO),
        }
    }

    /// Takes the sample.
    #[inline(always)]
    pub fn learn(&mut self, foretold: &Foretold, by: &Move, seen: &Seen) {
        let through = &foretold.through;
        let back = through.map(|through| through * by.back);
        let p = &mut self.covariance;
        learn::<0>(p, through, back[0]);
        learn::<1>(p, through, back[1]);
        learn::<2>(p, through, back[2]);
        learn::<3>(p, through, back[3]);
        learn::<4>(p, through, back[4]);
        learn::<5>(p, through, back[5]);
        learn::<6>(p, through, back[6]);
        for i in 0..STATES {
            self.state[i] -= back[i] * by.limited;
        }
        for (i, [low, high]) in seen.bounds.into_iter().enumerate() {
            self.state[LINEAR + i] = self.state[LINEAR + i].at_least(low).at_most(high);
        }
    }

    /// Adds a variance to the gains, of these shapes.
    #[inline(always)]
    pub fn open_gains(&mut self, shapes: &Shapes, variance: f64) {
        for (p, shape) in self.covariance.iter_mut().zip(shapes) {
            *p += Forms::both(variance) * *shape;
        }
    }

    /// Adds a variance to a state.
    #[inline(always)]
    pub fn open(&mut self, state: usize, variance: f64) {
        self.covariance[at(state, state)] += Forms::both(variance);
    }

    /// Forgets how well gains and level are known, and all that was learnt of the corrections'
    /// covariance: they begin with these standard deviations.
    pub fn reopen(&mut self, shapes: &Shapes, gain: f64, level: f64, held: [f64; HELD]) {
        self.covariance = [Forms::ZERO; ENTRIES];
        self.open_gains(shapes, gain * gain);
        self.open(GAINS, level * level);
        for (i, deviation) in held.into_iter().enumerate() {
            self.open(LINEAR + i, deviation * deviation);
        }
    }

    /// Everywhere at this estimate with its covariance.
    pub fn place_at(&mut self, state: &[f64; STATES], covariance: &[[f64; STATES]; STATES]) {
        self.state = state.map(Forms::both);
        for i in 0..STATES {
            for j in 0..=i {
                self.covariance[at(i, j)] = Forms::both(covariance[i][j]);
            }
        }
    }

    /// Gains, level and corrections of a form.
    pub fn state_of(&self, form: usize) -> [f64; STATES] {
        self.state.map(|s| s.0[form])
    }

    /// Covariance of two of them.
    pub fn covariance_of(&self, form: usize, i: usize, j: usize) -> f64 {
        self.covariance[at(i, j)].0[form]
    }

    /// Takes over state and covariance of another filter in a form; the weight stays.
    pub fn follow(&mut self, other: &Self, form: usize) {
        let to = self.state.iter_mut().chain(&mut self.covariance);
        for (to, from) in to.zip(other.state.iter().chain(&other.covariance)) {
            to.0[form] = from.0[form];
        }
    }
}
