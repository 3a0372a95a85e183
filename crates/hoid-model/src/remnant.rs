//! The remnant filter `K_n / (T_n s + 1)^m`, m = 1..4: its discretisations, its monic noise model, and the way back (B.11-B.16).
//!
//! **Zero-order hold** (exact for white noise that is drawn once a sample, as the simulator does). With `a = Ts/T_n` and
//! `alpha = e^-a`
//!
//! `H(z) = K_n (n_1 z^-1 + ... + n_m z^-m) / (1 - alpha z^-1)^m`,  `n_j = a^m  integral over [j-1, j] of e^{-a t} B_m(t) dt`,
//!
//! B_m the cardinal B-spline of order m: the numerator samples an exponential spline (Unser and Blu, IEEE Trans. Signal
//! Processing 53, 2005). All n_j are integrals of what is positive, so that nothing cancels however fine the sampling.
//! For a to 0 the zeros go to the Euler-Frobenius zeros (m = 2: -1; m = 3: -3.73, -0.27; m = 4: -9.90, -1, -0.10).
//!
//! **Backward Euler** (B.11): `H(z) = K_n (1 - alpha)^m / (1 - alpha z^-1)^m` with `alpha = T_n/(T_n + Ts)`.
//!
//! **Noise model.** The same spectrum as `C/D eps'`, C and D monic and stable: the delay is dropped, numerator zeros zeta outside
//! the unit circle are reflected, and the standard deviation of eps' is `sigma' = K_n |n_1| prod over |zeta| > 1 of |zeta|`.
//!
//! **Retrieval.** Each coefficient `d_i = (-1)^i binom(m, i) alpha^i` of an estimated D gives an alpha and with it a time
//! constant; T_n is their mean (eq. 16, B.14), and K_n is sigma' over that of the filter with this T_n and K_n = 1 (backward
//! Euler: B.16). C is not used: where D is estimated without a C, m >= 2 and the truth is the zero-order hold, D absorbs the
//! missing C and T_n is biased.

use num_complex::Complex64;

use crate::{DiscreteTransferFunction, ModelError, NotConvertible, SampleTime, polynomial};

/// Highest order m of a remnant filter.
pub const HIGHEST_ORDER: usize = 4;

/// Smallest Ts/T_n, and the inverse of the largest, for which the filter is worked out.
const SMALLEST_RATIO: f64 = 1e-9;

/// `K_n / (T_n s + 1)^m`, driven by white noise of unit variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemnantFilter {
    /// Gain K_n.
    pub gain: f64,
    /// Time constant T_n in s.
    pub time_constant_s: f64,
    /// Order m, 1 to 4.
    pub order: usize,
}

/// How the remnant filter is taken to discrete time, or was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RemnantDiscretisation {
    /// Exact for noise held over each sample.
    #[default]
    ZeroOrderHold,
    /// `s = (1 - z^-1)/Ts`, the form of the reference text (eq. 13, B.11).
    BackwardEuler,
}

crate::named_choice!(RemnantDiscretisation, "discretisation of the remnant", 2, {
    ZeroOrderHold => "zoh",
    BackwardEuler => "backward-euler",
});

/// `C(q^-1)/D(q^-1) eps'`, both monic with all roots inside the unit circle.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseModel {
    /// `[1, c1, ...]` by ascending powers of `q^-1`.
    pub c: Vec<f64>,
    /// `[1, d1, ..., dm]` by ascending powers of `q^-1`.
    pub d: Vec<f64>,
    /// Standard deviation sigma' of eps'.
    pub innovation_sd: f64,
}

/// Time constant and gain found in a noise model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetrievedRemnant {
    /// Time constant T_n in s.
    pub t_n_s: f64,
    /// Gain K_n.
    pub k_n: f64,
}

impl RemnantFilter {
    /// A remnant filter with parameters that have a meaning.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] unless the gain is zero or more, the time constant positive, both finite, and the order 1 to 4.
    pub fn new(gain: f64, time_constant_s: f64, order: usize) -> Result<Self, ModelError> {
        let filter = Self {
            gain,
            time_constant_s,
            order,
        };
        filter.check()?;
        Ok(filter)
    }

    fn check(&self) -> Result<(), ModelError> {
        let refuse = |quantity, found, expected| {
            Err(ModelError::OutOfRange {
                quantity,
                found,
                expected,
            })
        };
        if !(self.gain.is_finite() && self.gain >= 0.0) {
            return refuse("remnant gain K_n", self.gain, "a finite number, zero or more");
        }
        if !(self.time_constant_s.is_finite() && self.time_constant_s > 0.0) {
            let found = self.time_constant_s;
            return refuse("remnant time constant T_n in s", found, "a positive finite number");
        }
        if !(1..=HIGHEST_ORDER).contains(&self.order) {
            return refuse("remnant order m", self.order as f64, "1, 2, 3 or 4");
        }
        Ok(())
    }

    /// `a = Ts/T_n` of a filter that passes the checks.
    pub(crate) fn ratio(&self, sample_time: SampleTime) -> Result<f64, ModelError> {
        self.check()?;
        let a = sample_time.s() / self.time_constant_s;
        if !(SMALLEST_RATIO..=1.0 / SMALLEST_RATIO).contains(&a) {
            return Err(ModelError::OutOfRange {
                quantity: "remnant time constant T_n in s",
                found: self.time_constant_s,
                expected: "a time between 1e-9 and 1e9 samples; check its unit against that of the sample time",
            });
        }
        Ok(a)
    }

    /// The discrete filter from the noise, one draw a sample, to the remnant n.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] as for [`RemnantFilter::new`], and when T_n is not between 1e-9 and 1e9 samples.
    pub fn discrete(
        &self,
        sample_time: SampleTime,
        how: RemnantDiscretisation,
    ) -> Result<DiscreteTransferFunction, ModelError> {
        let a = self.ratio(sample_time)?;
        let num: Vec<f64> = match how {
            RemnantDiscretisation::ZeroOrderHold => {
                let numerator = held_numerator(self.order, a);
                std::iter::once(0.0)
                    .chain(numerator.iter().map(|n| self.gain * n))
                    .collect()
            }
            RemnantDiscretisation::BackwardEuler => vec![self.gain * backward_gain(self.order, a)],
        };
        DiscreteTransferFunction::new(&num, &denominator(self.order, how.pole(a)), sample_time)
    }

    /// The monic noise model of the same spectrum.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] as for [`RemnantFilter::new`], and when T_n is not between 1e-9 and 1e9 samples.
    pub fn noise_model(&self, sample_time: SampleTime, how: RemnantDiscretisation) -> Result<NoiseModel, ModelError> {
        let a = self.ratio(sample_time)?;
        let (c, unit) = match how {
            RemnantDiscretisation::ZeroOrderHold => {
                let held = Factored::new(self.order, a);
                (held.c, held.innovation_sd)
            }
            RemnantDiscretisation::BackwardEuler => (vec![1.0], backward_gain(self.order, a)),
        };
        Ok(NoiseModel {
            c,
            d: denominator(self.order, how.pole(a)),
            innovation_sd: self.gain * unit,
        })
    }
}

impl RemnantDiscretisation {
    /// The pole alpha, from `a = Ts/T_n`.
    fn pole(self, a: f64) -> f64 {
        match self {
            Self::ZeroOrderHold => (-a).exp(),
            Self::BackwardEuler => 1.0 / (1.0 + a),
        }
    }

    /// `T_n/Ts` from the pole, and its derivative.
    fn time_constant(self, alpha: f64) -> (f64, f64) {
        match self {
            Self::ZeroOrderHold => {
                let log = alpha.ln();
                (-1.0 / log, 1.0 / (alpha * log * log))
            }
            Self::BackwardEuler => (alpha / (1.0 - alpha), 1.0 / ((1.0 - alpha) * (1.0 - alpha))),
        }
    }

    /// sigma' of the filter with K_n = 1, and its logarithmic derivative with respect to `a = Ts/T_n`.
    fn innovation_sd(self, order: usize, a: f64) -> (f64, f64) {
        match self {
            Self::ZeroOrderHold => {
                let held = Factored::new(order, a);
                (held.innovation_sd, held.log_derivative)
            }
            Self::BackwardEuler => (backward_gain(order, a), order as f64 / (a * (1.0 + a))),
        }
    }
}

/// T_n and K_n from the noise polynomial `1 + d[0] q^-1 + ... + d[m-1] q^-m` and the standard deviation of the innovation.
///
/// # Errors
/// [`NotConvertible::NotFinite`] for coefficients that are no numbers; [`NotConvertible::NotARemnantFilter`] when m is not 1 to 4, a
/// coefficient has the wrong sign, it implies a pole outside (0, 1), or T_n is nothing beside a sample.
pub fn retrieve(
    d: &[f64],
    innovation_sd: f64,
    sample_time: SampleTime,
    how: RemnantDiscretisation,
) -> Result<RetrievedRemnant, NotConvertible> {
    let poles = implied_poles(d, innovation_sd)?;
    let t_n_s = mean_time_constant(&poles, sample_time, how)?;
    let (unit, _) = how.innovation_sd(d.len(), sample_time.s() / t_n_s);
    Ok(RetrievedRemnant {
        t_n_s,
        k_n: innovation_sd / unit,
    })
}

/// Jacobian of `[T_n in s, K_n]` (rows) with respect to `[d_1, ..., d_m, sigma']` (columns) at what [`retrieve`] finds.
///
/// # Errors
/// As [`retrieve`].
pub fn retrieval_jacobian(
    d: &[f64],
    innovation_sd: f64,
    sample_time: SampleTime,
    how: RemnantDiscretisation,
) -> Result<[Vec<f64>; 2], NotConvertible> {
    let poles = implied_poles(d, innovation_sd)?;
    let (order, ts) = (d.len(), sample_time.s());
    let t_n_s = mean_time_constant(&poles, sample_time, how)?;
    let a = ts / t_n_s;
    let (unit, log_derivative) = how.innovation_sd(order, a);
    // a = Ts/T_n: da/dT_n = -a/T_n.
    let gain_by_time = innovation_sd / unit * log_derivative * a / t_n_s;
    let mut time: Vec<f64> = Vec::with_capacity(order + 1);
    for (i, (&alpha, &d)) in poles.iter().zip(d).enumerate() {
        let (_, by_pole) = how.time_constant(alpha);
        time.push(ts * by_pole * alpha / ((i + 1) as f64 * d) / order as f64);
    }
    let mut gain: Vec<f64> = time.iter().map(|t| gain_by_time * t).collect();
    time.push(0.0);
    gain.push(1.0 / unit);
    Ok([time, gain])
}

/// The pole alpha that each coefficient of D implies.
fn implied_poles(d: &[f64], innovation_sd: f64) -> Result<Vec<f64>, NotConvertible> {
    let order = d.len();
    let refuse = |reason: String| NotConvertible::NotARemnantFilter { order, reason };
    if !(1..=HIGHEST_ORDER).contains(&order) {
        return Err(refuse("the order must be 1, 2, 3 or 4".to_owned()));
    }
    let not_finite = |name: String, value| NotConvertible::NotFinite { name, value };
    if let Some(i) = d.iter().position(|v| !v.is_finite()) {
        return Err(not_finite(format!("d{}", i + 1), d[i]));
    }
    if !innovation_sd.is_finite() {
        return Err(not_finite("sigma'".to_owned(), innovation_sd));
    }
    if innovation_sd < 0.0 {
        let found = format!("the standard deviation of the innovation is {innovation_sd}, expected zero or more");
        return Err(refuse(found));
    }
    let mut poles = Vec::with_capacity(order);
    for i in 1..=order {
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        let power = sign * d[i - 1] / binomial(order, i);
        if power <= 0.0 {
            let expected = if sign > 0.0 { "positive" } else { "negative" };
            return Err(refuse(format!("d{i} = {:.6}, expected a {expected} number", d[i - 1])));
        }
        let alpha = power.powf(1.0 / i as f64);
        if alpha >= 1.0 {
            return Err(refuse(format!(
                "d{i} = {:.6} implies a pole at z = {alpha:.6}, expected one between 0 and 1",
                d[i - 1]
            )));
        }
        poles.push(alpha);
    }
    Ok(poles)
}

fn mean_time_constant(
    poles: &[f64],
    sample_time: SampleTime,
    how: RemnantDiscretisation,
) -> Result<f64, NotConvertible> {
    let sum: f64 = poles.iter().map(|&alpha| how.time_constant(alpha).0).sum();
    let samples = sum / poles.len() as f64;
    if samples < SMALLEST_RATIO {
        return Err(NotConvertible::NotARemnantFilter {
            order: poles.len(),
            reason: format!("T_n would be {samples:e} samples: the noise is white"),
        });
    }
    Ok(sample_time.s() * samples)
}

fn binomial(n: usize, k: usize) -> f64 {
    (1..=k).fold(1.0, |b, i| b * (n + 1 - i) as f64 / i as f64)
}

/// `(1 - alpha q^-1)^m`.
pub(crate) fn denominator(order: usize, alpha: f64) -> Vec<f64> {
    (0..=order)
        .map(|i| binomial(order, i) * (-alpha).powi(i as i32))
        .collect()
}

/// `(Ts/(T_n + Ts))^m` (B.12).
fn backward_gain(order: usize, a: f64) -> f64 {
    (a / (1.0 + a)).powi(order as i32)
}

/// Pieces of the cardinal B-spline of order m: on `[j, j + 1]`, in powers of `u = t - j`.
const B_SPLINES: [&[[f64; 4]]; HIGHEST_ORDER] = [
    &[[1.0, 0.0, 0.0, 0.0]],
    &[[0.0, 1.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0]],
    &[[0.0, 0.0, 0.5, 0.0], [0.5, 1.0, -1.0, 0.0], [0.5, -1.0, 0.5, 0.0]],
    &[
        [0.0, 0.0, 0.0, 1.0 / 6.0],
        [1.0 / 6.0, 0.5, 0.5, -0.5],
        [4.0 / 6.0, 0.0, -1.0, 0.5],
        [1.0 / 6.0, -0.5, 0.5, -1.0 / 6.0],
    ],
];

/// `integral over [0, 1] of u^k e^{-a u} du`, k = 0..4.
fn moments(a: f64) -> [f64; 5] {
    let decay = (-a).exp();
    let mut m = [0.0; 5];
    if a < 8.0 {
        // The highest by its series of positive terms, e^-a sum of a^i k!/(k + 1 + i)!; the others follow downwards by parts.
        let (mut term, mut sum) = (0.2, 0.0);
        for i in 0..80 {
            sum += term;
            term *= a / f64::from(i + 6);
        }
        m[4] = decay * sum;
        for k in (1..5).rev() {
            m[k - 1] = (a * m[k] + decay) / k as f64;
        }
    } else {
        m[0] = -(-a).exp_m1() / a;
        for k in 1..5 {
            m[k] = (k as f64 * m[k - 1] - decay) / a;
        }
    }
    m
}

/// `n_1, ..., n_m`.
fn held_numerator(order: usize, a: f64) -> Vec<f64> {
    let m = moments(a);
    let pieces = B_SPLINES[order - 1].iter().enumerate();
    let integral = |piece: &[f64; 4]| -> f64 { piece.iter().zip(&m).map(|(c, m)| c * m).sum() };
    pieces
        .map(|(j, piece)| a.powi(order as i32) * (-a * j as f64).exp() * integral(piece))
        .collect()
}

/// The derivatives of `n_1, ..., n_m` with respect to a.
fn held_numerator_derivative(order: usize, a: f64) -> Vec<f64> {
    let m = moments(a);
    let numerator = held_numerator(order, a);
    let pieces = B_SPLINES[order - 1].iter().zip(&numerator).enumerate();
    pieces
        .map(|(j, (piece, n))| {
            // The moments differentiate to minus the next ones.
            let moved: f64 = piece.iter().zip(&m[1..]).map(|(c, m)| c * m).sum();
            n * (order as f64 / a - j as f64) - a.powi(order as i32) * (-a * j as f64).exp() * moved
        })
        .collect()
}

/// The numerator of the zero-order hold with its zeros inside the unit circle, for K_n = 1.
pub(crate) struct Factored {
    pub c: Vec<f64>,
    /// Derivative of c with respect to `a = Ts/T_n`.
    pub c_derivative: Vec<f64>,
    pub innovation_sd: f64,
    /// Derivative of `ln innovation_sd` with respect to a.
    pub log_derivative: f64,
}

impl Factored {
    pub fn new(order: usize, a: f64) -> Self {
        let numerator = held_numerator(order, a);
        let derivative = held_numerator_derivative(order, a);
        let mut sd = numerator[0];
        let mut log_derivative = derivative[0] / numerator[0];
        let degree = numerator.len() - 1;
        let slope: Vec<f64> = numerator[..degree]
            .iter()
            .enumerate()
            .map(|(i, n)| (degree - i) as f64 * n)
            .collect();
        let at = |p: &[f64], z: Complex64| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * z + c);
        let (mut inside, mut moves) = (Vec::with_capacity(degree), Vec::with_capacity(degree));
        // At most three roots of positive coefficients: found unless a is so large that all but n_1 vanish.
        for zero in polynomial::roots(&numerator).unwrap_or_default() {
            // N(zeta, a) = 0 moves the zero by -N_a/N_zeta.
            let moved = -at(&derivative, zero) / at(&slope, zero);
            if zero.norm() <= 1.0 {
                inside.push(zero);
                moves.push(moved);
                continue;
            }
            let reflected = 1.0 / zero.conj();
            inside.push(reflected);
            moves.push(-moved.conj() * reflected * reflected);
            sd *= zero.norm();
            log_derivative += (moved / zero).re;
        }
        // dC = - sum over i of dzeta_i q^-1 prod over j != i of (1 - zeta_j q^-1).
        let mut c_derivative = vec![0.0; inside.len() + 1];
        for (i, moved) in moves.iter().enumerate() {
            let mut rest = vec![Complex64::new(1.0, 0.0)];
            for zero in inside.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, z)| z) {
                rest.push(Complex64::new(0.0, 0.0));
                for k in (1..rest.len()).rev() {
                    let lower = rest[k - 1];
                    rest[k] -= zero * lower;
                }
            }
            for (k, r) in rest.iter().enumerate() {
                c_derivative[k + 1] -= (moved * r).re;
            }
        }
        Self {
            c: polynomial::from_roots(&inside),
            c_derivative,
            innovation_sd: sd,
            log_derivative,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ContinuousTransferFunction,
        discretise::{Method, discretise},
    };

    const BOTH: [RemnantDiscretisation; 2] = [
        RemnantDiscretisation::ZeroOrderHold,
        RemnantDiscretisation::BackwardEuler,
    ];

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    fn filters() -> Vec<RemnantFilter> {
        let constants = [0.06, 0.003, 0.012, 0.5, 20.0];
        (1..=4)
            .flat_map(|m| constants.map(|t| RemnantFilter::new(0.3, t, m).unwrap()))
            .collect()
    }

    /// Variance of the output for white noise of unit variance: the sum of the squared impulse response.
    fn variance(h: &DiscreteTransferFunction, samples: usize) -> f64 {
        let mut y: Vec<f64> = Vec::with_capacity(samples);
        for k in 0..samples {
            let forced = h.num().get(k).copied().unwrap_or(0.0);
            let free: f64 = (1..h.den().len().min(k + 1)).map(|i| h.den()[i] * y[k - i]).sum();
            y.push(forced - free);
        }
        y.iter().map(|v| v * v).sum()
    }

    #[test]
    fn hold_agrees_with_the_general_discretisation() {
        for filter in filters() {
            let h = filter.discrete(ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
            let pole = [filter.time_constant_s, 1.0];
            let den = (1..filter.order).fold(pole.to_vec(), |p, _| polynomial::product(&p, &pole));
            let continuous = ContinuousTransferFunction::new(&[filter.gain], &den).unwrap();
            let general = discretise(&continuous, ts(), Method::ZeroOrderHold).unwrap();
            let largest = h.num().iter().fold(0.0, |m: f64, b| m.max(b.abs()));
            for (a, b) in h.num().iter().zip(general.num()) {
                // The general way keeps 14 digits of the largest coefficient.
                assert!((a - b).abs() < 2e-14 * largest, "{filter:?}: {h:?} and {general:?}");
            }
            for (a, b) in h.den().iter().zip(general.den()) {
                assert!((a - b).abs() < 1e-13, "{filter:?}");
            }
        }
    }

    #[test]
    fn backward_euler_agrees_with_the_general_discretisation() {
        for filter in filters() {
            let h = filter.discrete(ts(), RemnantDiscretisation::BackwardEuler).unwrap();
            let pole = [filter.time_constant_s, 1.0];
            let den = (1..filter.order).fold(pole.to_vec(), |p, _| polynomial::product(&p, &pole));
            let continuous = ContinuousTransferFunction::new(&[filter.gain], &den).unwrap();
            let general = discretise(&continuous, ts(), Method::BackwardEuler).unwrap();
            assert!((h.num()[0] / general.num()[0] - 1.0).abs() < 1e-13);
            assert!(general.num()[1..].iter().all(|&b| b == 0.0));
        }
    }

    #[test]
    fn first_order_is_an_autoregression() {
        // corrections.md: d1 = -0.8465 (exact) and -0.8571 (backward Euler).
        let filter = RemnantFilter::new(1.0, 0.06, 1).unwrap();
        let exact = filter.noise_model(ts(), RemnantDiscretisation::default()).unwrap();
        assert_eq!(exact.c, vec![1.0]);
        assert!((exact.d[1] + (-1.0f64 / 6.0).exp()).abs() < 1e-15 && (exact.d[1] + 0.8465).abs() < 5e-5);
        let euler = filter.noise_model(ts(), RemnantDiscretisation::BackwardEuler).unwrap();
        assert!((euler.d[1] + 0.8571).abs() < 5e-5);
        // A first-order process in closed form: variance (1 - alpha)^2/(1 - alpha^2).
        let alpha: f64 = (-1.0f64 / 6.0).exp();
        let h = filter.discrete(ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
        assert!((variance(&h, 400) - (1.0 - alpha) / (1.0 + alpha)).abs() < 1e-14);
    }

    #[test]
    fn noise_model_has_the_spectrum_of_the_filter() {
        for filter in filters() {
            for how in BOTH {
                let h = filter.discrete(ts(), how).unwrap();
                let model = filter.noise_model(ts(), how).unwrap();
                let monic = DiscreteTransferFunction::new(&model.c, &model.d, ts()).unwrap();
                assert_eq!((model.c[0], model.d[0]), (1.0, 1.0));
                assert!(polynomial::roots(&model.c).unwrap().iter().all(|z| z.norm() <= 1.0));
                for omega in [0.0, 1.0, 30.0, 150.0, 300.0] {
                    let (a, b) = (
                        h.response(omega).norm(),
                        monic.response(omega).norm() * model.innovation_sd,
                    );
                    // Near pi/Ts the numerator nearly vanishes: relative to its largest values.
                    assert!(
                        (a - b).abs() < 1e-11 * (a + 1e-6),
                        "{filter:?} {how:?} {omega}: {a} {b}"
                    );
                }
                if filter.time_constant_s < 0.1 {
                    let of_monic = variance(&monic, 4000) * model.innovation_sd.powi(2);
                    assert!((variance(&h, 4000) / of_monic - 1.0).abs() < 1e-9, "{filter:?} {how:?}");
                }
            }
        }
    }

    #[test]
    fn zeros_go_to_the_euler_frobenius_zeros() {
        for (m, expected) in [
            (2, vec![-1.0]),
            (3, vec![-2.0 - 3f64.sqrt(), -2.0 + 3f64.sqrt()]),
            (4, vec![-5.0 - 24f64.sqrt(), -1.0, -5.0 + 24f64.sqrt()]),
        ] {
            let zeros = polynomial::roots(&held_numerator(m, 1e-7)).unwrap();
            for (zero, expected) in zeros.iter().zip(expected) {
                // The zeros move by about a from their limits.
                assert!(
                    (zero - expected).norm() < 1e-6 * expected.abs(),
                    "{m}: {zero} and {expected}"
                );
            }
        }
    }

    #[test]
    fn numerator_sums_to_the_static_gain_for_any_sampling() {
        for m in 1..=4 {
            for a in [1e-9, 1e-3, 0.16, 1.0, 7.999, 8.0, 40.0, 800.0] {
                let sum: f64 = held_numerator(m, a).iter().sum();
                let expected = (-(-a).exp_m1()).powi(m as i32);
                assert!((sum / expected - 1.0).abs() < 2e-14, "{m} {a}: {sum} and {expected}");
            }
        }
    }

    #[test]
    fn retrieve_inverts_noise_model() {
        for filter in filters() {
            for how in BOTH {
                let model = filter.noise_model(ts(), how).unwrap();
                let found = retrieve(&model.d[1..], model.innovation_sd, ts(), how).unwrap();
                // T_n of 2000 samples leaves 1 - alpha with 12 digits, and K_n goes with its power m.
                let tolerance = 1e-14 * filter.time_constant_s.max(0.01) / 0.01 * 20.0;
                assert!(
                    (found.t_n_s / filter.time_constant_s - 1.0).abs() < tolerance,
                    "{filter:?} {how:?} {found:?}"
                );
                assert!(
                    (found.k_n / filter.gain - 1.0).abs() < 5.0 * tolerance,
                    "{filter:?} {how:?} {found:?}"
                );
            }
        }
    }

    #[test]
    fn retrieval_of_perturbed_coefficients_is_the_mean() {
        // By hand: m = 2, backward Euler, alpha from d1 = -1.7 is 0.85, from d2 = 0.7396 is 0.86.
        let found = retrieve(&[-1.7, 0.7396], 0.02, ts(), RemnantDiscretisation::BackwardEuler).unwrap();
        let expected = 0.5 * 0.01 * (0.85 / 0.15 + 0.86 / 0.14);
        assert!((found.t_n_s - expected).abs() < 1e-15);
        assert!((found.k_n - 0.02 * ((expected + 0.01) / 0.01f64).powi(2)).abs() < 1e-13);
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        for how in BOTH {
            for m in 1..=4 {
                for t in [0.004, 0.06, 0.3] {
                    let model = RemnantFilter::new(0.3, t, m).unwrap().noise_model(ts(), how).unwrap();
                    // Away from the exact filter, where the coefficients disagree.
                    let mut p: Vec<f64> = model.d[1..]
                        .iter()
                        .enumerate()
                        .map(|(i, d)| d * (1.0 - 3e-3 * i as f64))
                        .collect();
                    p.push(model.innovation_sd);
                    let exact = retrieval_jacobian(&p[..m], p[m], ts(), how).unwrap();
                    for j in 0..=m {
                        let h = 1e-5 * p[j].abs();
                        let at = |sign: f64| {
                            let mut q = p.clone();
                            q[j] += sign * h;
                            let r = retrieve(&q[..m], q[m], ts(), how).unwrap();
                            [r.t_n_s, r.k_n]
                        };
                        let (up, down) = (at(1.0), at(-1.0));
                        for i in 0..2 {
                            let difference = (up[i] - down[i]) / (2.0 * h);
                            // Truncation (h/(1 - alpha))^2 with 1 - alpha of 0.03 or more, and rounding eps/h.
                            assert!(
                                (exact[i][j] - difference).abs() <= 2e-6 * difference.abs(),
                                "{how:?} m {m} T_n {t} row {i} column {j}: {} and {difference}",
                                exact[i][j]
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_remnant_filter_is_named() {
        let reason = |d: &[f64], sd: f64| {
            let error = retrieve(d, sd, ts(), RemnantDiscretisation::ZeroOrderHold).unwrap_err();
            // As text: NaN is not equal to itself.
            let same = retrieval_jacobian(d, sd, ts(), RemnantDiscretisation::ZeroOrderHold).unwrap_err();
            assert_eq!(same.to_string(), error.to_string());
            error
        };
        for (d, word) in [
            (vec![0.3], "d1 = 0.300000, expected a negative number"),
            (vec![0.0], "expected a negative"),
            (vec![-1.0], "pole at z = 1.000000"),
            (vec![-1.2], "pole at z = 1.2"),
            (vec![-1.7, -0.7], "d2 = -0.700000, expected a positive number"),
            (vec![], "order must be"),
            (vec![-0.1; 5], "order must be"),
        ] {
            let error = reason(&d, 1.0);
            assert!(
                matches!(&error, NotConvertible::NotARemnantFilter { reason, .. } if reason.contains(word)),
                "{error}"
            );
        }
        assert!(matches!(reason(&[f64::NAN], 1.0), NotConvertible::NotFinite { name, .. } if name == "d1"));
        assert!(matches!(reason(&[-0.8], f64::NAN), NotConvertible::NotFinite { .. }));
        assert!(matches!(
            reason(&[-0.8], -1.0),
            NotConvertible::NotARemnantFilter { .. }
        ));
        let white = retrieve(&[-1e-320], 1.0, ts(), RemnantDiscretisation::BackwardEuler).unwrap_err();
        assert!(white.to_string().contains("white"), "{white}");
        // Noise-free: a gain of zero is a number.
        let silent = retrieve(&[-0.8], 0.0, ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
        assert_eq!(silent.k_n, 0.0);
    }

    #[test]
    fn bad_filters_are_refused() {
        for (gain, time, order) in [
            (f64::NAN, 0.06, 1),
            (-0.1, 0.06, 1),
            (0.1, 0.0, 1),
            (0.1, f64::INFINITY, 1),
            (0.1, 0.06, 0),
            (0.1, 0.06, 5),
        ] {
            assert!(RemnantFilter::new(gain, time, order).is_err());
            let literal = RemnantFilter {
                gain,
                time_constant_s: time,
                order,
            };
            assert!(literal.discrete(ts(), RemnantDiscretisation::ZeroOrderHold).is_err());
            assert!(literal.noise_model(ts(), RemnantDiscretisation::BackwardEuler).is_err());
        }
        for time in [1e-100, 1e100] {
            let absurd = RemnantFilter::new(0.1, time, 4).unwrap();
            assert!(absurd.discrete(ts(), RemnantDiscretisation::ZeroOrderHold).is_err());
            assert!(absurd.noise_model(ts(), RemnantDiscretisation::ZeroOrderHold).is_err());
        }
    }
}
