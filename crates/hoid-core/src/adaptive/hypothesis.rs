//! One hypothesis: a Kalman filter of the operator that supposes that the person last changed at its birth.
//!
//! With `y = D u` and `r` the whitened signals, the innovation and its negative gradient at eta are
//!
//! `eps = y - K_e psi_1 - K_e_dot psi_2`, `psi_1 = r_1 + d_omega r_3 + d_zeta r_5`, `psi_2 = r_2 + d_omega r_4 + d_zeta r_6`,
//! `psi_3 = K_e r_3 + K_e_dot r_4`, `psi_4 = K_e r_5 + K_e_dot r_6`,
//!
//! with `d_omega`, `d_zeta` the distances from the point of the filters. Before it is seen, eps has a Student distribution of the variance
//! `v = sigma^2 + psi' P psi` and of the n residuals that sigma^2 rests on, with the density
//! `v^{-1/2} exp(-(n + 1)/2 ln(1 + eps^2/(n v)) - 1/(4 n))` up to a factor (the Gamma functions give `-1/(4 n) + O(n^{-3})`).
//!
//! An innovation beyond the limit counts as one at the limit, in the density and in sigma^2, and as a measurement of so large
//! a variance that it lies there (P. J. Huber, *Robust Statistics*, 1981, section 7.3): an outlier tells nothing of who foretells better.

use crate::{
    adaptive::{Suppositions, response::Signals},
    error_bars::Level,
    factored::Factored,
    state::State,
};

/// Number of the operator's parameters: K_e, K_e_dot, omega_nm, zeta_nm.
pub const OPERATOR: usize = 4;
/// Variances and signals beyond this would overflow in products.
pub(super) const LARGEST: f64 = 1e60;
/// Largest square of an innovation over its variance that sigma^2 takes.
const LEVEL_LIMIT: f64 = 9.0;
/// How far omega_nm and zeta_nm may be from the point of the filters, as a share of it: the derivatives reach no further.
const REACH: f64 = 0.5;
/// Least innovation variance, as a share of that at the start: what a silence leaves.
const LEAST_SHARE: f64 = 1e-9;

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; OPERATOR],
    /// Its covariance.
    pub covariance: Factored<OPERATOR>,
    /// Innovation variance.
    pub level: Level,
    /// Probability.
    pub weight: f64,
    /// Sample of its birth.
    pub born: u64,
    /// Whether the neuromuscular system changed too at its birth.
    pub whole: bool,
    /// Its delay, in samples beyond the shortest.
    pub later: usize,
    /// What held before.
    pub before: Before,
    least: f64,
}

/// What held before a change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Before {
    /// `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; OPERATOR],
    /// Covariance of K_e and K_e_dot: variances, then the covariance.
    pub gains: [f64; 3],
    /// Variances of omega_nm and zeta_nm.
    pub neuromuscular: [f64; 2],
    /// Innovation variance.
    pub variance: f64,
    /// Mean and variance of the delay, in samples beyond the shortest.
    pub delay: [f64; 2],
}

crate::state!([] Hypothesis { eta, covariance, level, weight, born, whole, later, before, least });
crate::state!([] Before { eta, gains, neuromuscular, variance, delay });

/// A place of the bank: whether there is a hypothesis, and it.
impl State for Option<Hypothesis> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut is_there = self.is_some();
        is_there.visit(each);
        // What is restored into a place that was empty replaces all of these numbers.
        *self = is_there.then(|| self.take().unwrap_or_else(Hypothesis::nothing));
        if let Some(hypothesis) = self {
            hypothesis.visit(each);
        }
    }
}

/// psi at eta, of the whitened signals of filters about a point.
#[inline(always)]
pub fn gradient(eta: &[f64; OPERATOR], r: &Signals, about: [f64; 2]) -> [f64; OPERATOR] {
    let (omega, zeta) = (eta[2] - about[0], eta[3] - about[1]);
    [
        r[0] + omega * r[2] + zeta * r[4],
        r[1] + omega * r[3] + zeta * r[5],
        eta[0] * r[2] + eta[1] * r[3],
        eta[0] * r[4] + eta[1] * r[5],
    ]
}

impl Hypothesis {
    fn nothing() -> Self {
        Self {
            eta: [0.0; OPERATOR],
            covariance: Factored::diagonal([0.0; OPERATOR]),
            level: Level::new(0.0, 1.0, 1.0),
            weight: 0.0,
            born: 0,
            whole: false,
            later: 0,
            before: Before::default(),
            least: 0.0,
        }
    }

    /// From the estimate at the start, its covariance and the innovation variance. `None` unless the covariance is positive.
    pub fn new(eta: [f64; OPERATOR], covariance: &[[f64; OPERATOR]; OPERATOR], level: Level) -> Option<Self> {
        let covariance = Factored::of(covariance)?;
        let mut first = Self {
            eta,
            covariance,
            level,
            weight: 1.0,
            born: 0,
            whole: false,
            later: 0,
            before: Before::default(),
            least: LEAST_SHARE * level.variance(),
        };
        first.before = first.now();
        Some(first)
    }

    /// Takes a sample: the innovation, and the density that it had.
    #[inline(always)]
    pub fn step(&mut self, y: f64, r: &Signals, about: [f64; 2], suppositions: &Suppositions) -> (f64, f64) {
        let psi = gradient(&self.eta, r, about);
        let eps = y - self.eta[0] * psi[0] - self.eta[1] * psi[1];
        let variance = self.level.variance().max(self.least);
        let (f, v) = self.covariance.projections(&psi);
        let total = variance + f[0] * v[0] + f[1] * v[1] + f[2] * v[2] + f[3] * v[3];
        if !(total > 0.0 && total < LARGEST) {
            return (eps, 1.0);
        }
        let deviation = libm::sqrt(total);
        let limit = suppositions.limit * deviation;
        let excess = eps.abs() / limit;
        let (used, doubt) = if excess > 1.0 {
            (libm::copysign(limit, eps), excess * excess)
        } else {
            (eps, 1.0)
        };
        let square = used * used / total;
        let n = self.level.weight();
        let density = exp(-0.5 * (n + 1.0) * log1p(square / n) - 0.25 / n) / deviation;
        let gain = self.covariance.measure_projected((f, v), variance * doubt);
        for i in 0..OPERATOR {
            let [mut low, mut high] = suppositions.bounds[i];
            if i >= 2 {
                low = low.max((1.0 - REACH) * about[i - 2]);
                high = high.min((1.0 + REACH) * about[i - 2]);
            }
            let moved = self.eta[i] + gain[i] * used;
            // Bounds need not be ordered numbers here: a comparison that fails changes nothing.
            self.eta[i] = if moved < low {
                low
            } else if moved > high {
                high
            } else {
                moved
            };
        }
        self.level.take(square.min(LEVEL_LIMIT) * variance);
        (eps, density)
    }

    /// `g^2` and `g^2/omega^2` at the crossover.
    fn scales(&self, suppositions: &Suppositions) -> [f64; 2] {
        let square = suppositions.crossover * suppositions.crossover;
        let g = self.eta[0] * self.eta[0] + square * self.eta[1] * self.eta[1];
        [g, g / square]
    }

    /// What the gains drift between two births, until no less is known than after a change. Just after a change they go on changing.
    pub fn drift(&mut self, now: u64, suppositions: &Suppositions) {
        let scales = self.scales(suppositions);
        let s = suppositions;
        // Of the first, born at sample 0, nothing is said to have changed.
        let unrest = match self.born {
            0 => 0.0,
            born => exp(-((now - born) as f64) / s.unrest_for),
        };
        let samples = f64::from(s.spacing);
        for i in 0..2 {
            let jump = s.jump[i] * s.jump[i];
            if self.covariance.element(i, i) < jump * scales[i] {
                let rate = s.drift * s.drift + s.unrest[i] * s.unrest[i] * unrest;
                self.widen(i, rate * samples * scales[i]);
            }
        }
        if self.whole {
            for i in 0..2 {
                let deviation = s.neuromuscular[i] * self.eta[2 + i];
                let variance = deviation * deviation;
                if self.covariance.element(2 + i, 2 + i) < variance {
                    self.widen(2 + i, s.unrest[2 + i] * s.unrest[2 + i] * unrest * samples * variance);
                }
            }
        }
    }

    /// The same with the delay so many samples beyond the shortest.
    pub fn delayed(self, later: usize) -> Self {
        Self { later, ..self }
    }

    /// The hypothesis that the delay is, and was, another near its own.
    pub fn beside(&self, later: usize, suppositions: &Suppositions) -> Self {
        let mut other = self.delayed(later);
        let (scales, away) = (self.scales(suppositions), later.abs_diff(self.later) as f64);
        for i in 0..OPERATOR {
            let scale = if i < 2 { scales[i] } else { self.eta[i] * self.eta[i] };
            let worth = away * suppositions.delays.worth[i];
            other.widen(i, worth * worth * scale);
        }
        other
    }

    /// The hypothesis that the person changes now, the neuromuscular system included or not.
    pub fn opened(&self, now: u64, whole: bool, suppositions: &Suppositions) -> Self {
        let mut child = *self;
        let scales = self.scales(suppositions);
        for i in 0..2 {
            child.widen(i, suppositions.jump[i] * suppositions.jump[i] * scales[i]);
        }
        if whole {
            for i in 0..2 {
                let deviation = suppositions.neuromuscular[i] * self.eta[2 + i];
                child.widen(2 + i, deviation * deviation);
            }
        }
        child.level.doubt(suppositions.doubt);
        child.born = now;
        child.whole = whole;
        child.before = self.now();
        child
    }

    fn widen(&mut self, i: usize, variance: f64) {
        let mut unit = [0.0; OPERATOR];
        unit[i] = 1.0;
        self.covariance.add(variance, unit);
    }

    /// What holds.
    pub fn now(&self) -> Before {
        let p = &self.covariance;
        Before {
            eta: self.eta,
            gains: [p.element(0, 0), p.element(1, 1), p.element(0, 1)],
            neuromuscular: [p.element(2, 2), p.element(3, 3)],
            variance: self.level.variance(),
            delay: [self.later as f64, 0.0],
        }
    }

    /// True when every number inside is finite.
    pub fn is_sound(&self) -> bool {
        self.covariance.is_sound() && self.eta.iter().all(|e| e.is_finite()) && self.level.variance().is_finite()
    }
}

/// `ln(1 + x)` for x that is not negative, in a third of the time where x is small: with `z = x/(2 + x)`, `2 (z + z^3/3 + z^5/5 + ...)`, whose next term is
/// below 1e-16 of the first.
#[inline(always)]
fn log1p(x: f64) -> f64 {
    if x > 0.25 {
        return libm::log1p(x);
    }
    let z = x / (2.0 + x);
    let s = z * z;
    let mut sum = 1.0 / 15.0;
    for k in [13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        sum = sum * s + 1.0 / k;
    }
    2.0 * z * sum
}

/// `e^x` without a call, to 4e-16 between -700 and 700 and libm's beyond: `2^k e^r` with `|r| <= ln(2)/2`, by Taylor's series.
#[inline(always)]
fn exp(x: f64) -> f64 {
    if x.abs() >= 700.0 || x.is_nan() {
        return libm::exp(x);
    }
    // Adding and taking away 3/2 2^52 rounds to the nearest whole number.
    const ROUNDS: f64 = 6_755_399_441_055_744.0;
    const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    let k = (x * core::f64::consts::LOG2_E + ROUNDS) - ROUNDS;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let mut sum = 1.0 / 6_227_020_800.0;
    for factorial in [
        479_001_600.0,
        39_916_800.0,
        3_628_800.0,
        362_880.0,
        40_320.0,
        5_040.0,
        720.0,
        120.0,
        24.0,
        6.0,
        2.0,
        1.0,
        1.0,
    ] {
        sum = sum * r + 1.0 / factorial;
    }
    sum * f64::from_bits(((k as i64 + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_short_functions_are_libm_s() {
        for i in 0..4000 {
            let x = f64::from(i) * 1e-3;
            assert!((super::log1p(x) - libm::log1p(x)).abs() <= 4e-16 * libm::log1p(x));
            for x in [-x, x, -180.0 * x] {
                let e = libm::exp(x);
                assert!((super::exp(x) - e).abs() <= 4e-16 * e, "{x}");
            }
        }
        assert_eq!(super::exp(f64::NEG_INFINITY), 0.0);
        assert!(super::exp(f64::NAN).is_nan() && super::log1p(1e300) == libm::log1p(1e300));
    }
}
