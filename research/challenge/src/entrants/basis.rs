//! Estimation of three gains in the basis of a nominal operator.
//!
//! `u = sum over i = 0..2 of theta_i x_i + c + v`, where `x_i` is the response of `s^i/((T_I s + 1)(s^2/omega^2 + 2
//! zeta s/omega + 1)) e^(-tau s)` to e, with T_I = 3 s, omega = 11 rad/s, zeta = .25, tau = .2 s for all operators, and
//! v is autoregressive. A few seconds of data determine the numerator, but not the poles, the lag and the delay (the
//! principle of basis functions: P. S. C. Heuberger, P. M. J. Van den Hof and B. Wahlberg, *Modelling and
//! Identification with Rational Orthogonal Basis Functions*, 2005). The noise model is fitted to the start span by
//! alternating least squares and autocovariances, and then fixed. All signals are decimated to 50 to 60 samples per
//! second.

use hoid_model::Complex64;

use super::super::{
    entrant::{ReportedResponse, Task, complex_covariance},
    noise::levinson,
    operator::{Canonical, Operator, hold},
};

/// Number of regression coefficients: three gains and a constant.
pub(super) const GAIN_COUNT: usize = 4;
/// Vector with one element for each regression coefficient; `Square` is the corresponding square matrix.
pub(super) type Gains = [f64; GAIN_COUNT];
pub(super) type Square = [[f64; GAIN_COUNT]; GAIN_COUNT];

/// Order of the noise model.
const NOISE_ORDER: usize = 16;
/// Smallest sampling rate of the decimated signals, Hz.
const MIN_RATE_HZ: f64 = 50.0;
/// Time omitted at the start, because the filters start at rest, s.
const SETTLING_S: f64 = 5.0;
/// Limit of the residuals in the start span, standard deviations.
const RESIDUAL_LIMIT: f64 = 3.5;

const NOMINAL: Operator = Operator {
    gain: 1.0,
    lead_s: 0.0,
    leads: 0,
    lag_s: 3.0,
    omega_nm_rad_s: 11.0,
    zeta_nm: 0.25,
    third_s: 0.0,
    stick_rad_s: 0.0,
    tau_e_s: 0.2,
};

/// A sample after the whitening filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct WhitenedSample {
    pub t_s: f64,
    pub x: Gains,
    pub y: f64,
    /// True if the sample gives no update, because a value is missing or it belongs to the history.
    pub is_void: bool,
}

/// The whole run after the whitening filter, with the estimate from the start span.
#[derive(Debug)]
pub(super) struct WhitenedRun {
    pub samples: Vec<WhitenedSample>,
    /// Sample time of the decimated signals, s.
    pub every_s: f64,
    /// Gains from the start span; `covariance` is their covariance and `variance` the variance of the innovations.
    pub theta: Gains,
    pub covariance: Square,
    pub variance: f64,
    /// Standard deviation of u in the start span.
    pub size_u: f64,
}

/// One decimated sample: time, regressors and u.
struct DecimatedSample {
    t_s: f64,
    x: Gains,
    u: f64,
    is_history: bool,
}

/// # Errors
/// The reason, if the start span does not determine the gains.
pub(super) fn whiten_run(task: &Task) -> Result<WhitenedRun, String> {
    let plain = regressors(task);
    let thin = decimation_factor(task);
    let every_s = thin as f64 * task.sample_time.s();
    let from = task.start_s.0 + SETTLING_S;
    let in_start: Vec<usize> = (NOISE_ORDER..plain.len())
        .filter(|i| !plain[*i].is_history && plain[*i].t_s >= from && plain[*i].t_s < task.start_s.1)
        .collect();
    let mut a = vec![0.0; NOISE_ORDER + 1];
    a[0] = 1.0;
    let mut fit = None;
    for round in 0..3 {
        let white: Vec<WhitenedSample> = in_start
            .iter()
            .map(|i| at(&plain, *i, &a))
            .filter(|w| !w.is_void)
            .collect();
        let first = least_squares(&white)?;
        if round < 2 {
            let residual: Vec<f64> = in_start
                .iter()
                .map(|i| plain[*i].u - product(&plain[*i].x, &first.theta))
                .collect();
            if residual.iter().any(|r| !r.is_finite()) {
                return Err("samples of the start span are missing".to_owned());
            }
            a = levinson(&autocovariance(&residual)).0;
        }
        fit = Some(first);
    }
    let fit = fit.ok_or("no start")?;
    let values: Vec<f64> = in_start.iter().map(|i| plain[*i].u).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / values.len() as f64;
    Ok(WhitenedRun {
        samples: (0..plain.len()).map(|i| at(&plain, i, &a)).collect(),
        every_s,
        size_u: square.sqrt(),
        ..fit
    })
}

fn decimation_factor(task: &Task) -> usize {
    (1.0 / (task.sample_time.s() * MIN_RATE_HZ) + 1e-6).floor().max(1.0) as usize
}

fn regressors(task: &Task) -> Vec<DecimatedSample> {
    let ts = task.sample_time.s();
    let thin = decimation_factor(task);
    // Number of integration steps of at most 5 ms within a sample.
    let steps = (ts / 0.005 - 1e-9).ceil().max(1.0) as usize;
    let h = ts / steps as f64;
    let denominator = NOMINAL.denominator();
    let (mut state, mut errors, mut plain) = (Canonical::at_rest(), Vec::new(), Vec::new());
    let (mut last, mut count) = (0.0, 0);
    for (k, e, u) in task.samples() {
        if e.is_finite() {
            last = e;
        }
        errors.push(last);
        if count % thin == 0 {
            plain.push(DecimatedSample {
                t_s: k.map_or(f64::NAN, |k| task.time_s(k)),
                x: [state.x[0], state.x[1], state.x[2], 1.0],
                u: if e.is_finite() { u } else { f64::NAN },
                is_history: k.is_none(),
            });
        }
        for i in 0..steps {
            // Position, in samples, of the error at the time tau_e before the middle of the step.
            let place = count as f64 + (i as f64 + 0.5) / steps as f64 - NOMINAL.tau_e_s / ts;
            let v = if place < 0.0 { 0.0 } else { errors[place as usize] };
            state.advance(&denominator, [v; 3], h);
        }
        count += 1;
    }
    plain
}

/// Returns a sample after the whitening filter `1 + a_1 q^-1 + ...`.
fn at(plain: &[DecimatedSample], i: usize, a: &[f64]) -> WhitenedSample {
    let own = &plain[i];
    let is_void = i < NOISE_ORDER || own.is_history || plain[i - NOISE_ORDER..=i].iter().any(|p| !p.u.is_finite());
    let mut white = WhitenedSample {
        t_s: own.t_s,
        x: [0.0; GAIN_COUNT],
        y: 0.0,
        is_void,
    };
    if !is_void {
        for (lag, a) in a.iter().enumerate() {
            let past = &plain[i - lag];
            white.y += a * past.u;
            white.x.iter_mut().zip(&past.x).for_each(|(w, x)| *w += a * x);
        }
    }
    white
}

fn autocovariance(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let of = |lag: usize| values[lag..].iter().zip(values).map(|(a, b)| a * b).sum::<f64>() / n;
    let mut all: Vec<f64> = (0..=NOISE_ORDER).map(of).collect();
    all[0] *= 1.0 + 1e-9;
    all
}

/// Solves the regression by least squares, with outliers limited in a second pass.
fn least_squares(white: &[WhitenedSample]) -> Result<WhitenedRun, String> {
    let mut sums = Sums::default();
    white.iter().for_each(|w| sums.add(&w.x, w.y));
    let first = sums.solve()?;
    let bound = RESIDUAL_LIMIT * first.variance.sqrt();
    let mut limited = Sums::default();
    for w in white {
        let expected = product(&w.x, &first.theta);
        limited.add(&w.x, expected + (w.y - expected).clamp(-bound, bound));
    }
    let Solution {
        theta,
        covariance,
        variance,
    } = limited.solve()?;
    Ok(WhitenedRun {
        samples: Vec::new(),
        every_s: 0.0,
        theta,
        covariance,
        variance,
        size_u: 0.0,
    })
}

/// Sums of products of a regression.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub xx: Square,
    pub xy: Gains,
    pub yy: f64,
    pub n: f64,
}

/// Solution of a regression.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solution {
    pub theta: Gains,
    pub covariance: Square,
    pub variance: f64,
}

impl Sums {
    pub fn add(&mut self, x: &Gains, y: f64) {
        for (row, xi) in self.xx.iter_mut().zip(x) {
            row.iter_mut().zip(x).for_each(|(sum, xj)| *sum += xi * xj);
        }
        self.xy.iter_mut().zip(x).for_each(|(sum, xi)| *sum += xi * y);
        self.yy += y * y;
        self.n += 1.0;
    }

    pub fn join(&mut self, other: &Self) {
        for i in 0..GAIN_COUNT {
            for j in 0..GAIN_COUNT {
                self.xx[i][j] += other.xx[i][j];
            }
            self.xy[i] += other.xy[i];
        }
        self.yy += other.yy;
        self.n += other.n;
    }

    /// # Errors
    /// The reason, if the gains are not determined.
    pub fn solve(&self) -> Result<Solution, String> {
        let inverse = inverse(&self.xx).ok_or("the gains are not determined")?;
        let theta: Gains = std::array::from_fn(|i| product(&inverse[i], &self.xy));
        let left = self.yy - product(&theta, &self.xy);
        let variance = left.max(1e-12 * self.yy) / (self.n - GAIN_COUNT as f64).max(1.0);
        if !(variance.is_finite() && self.n > 2.0 * GAIN_COUNT as f64) {
            return Err("too few samples for the gains".to_owned());
        }
        Ok(Solution {
            theta,
            covariance: inverse.map(|row| row.map(|c| c * variance)),
            variance,
        })
    }
}

pub(super) fn product(a: &Gains, b: &Gains) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns the inverse of a positive definite matrix, by a Cholesky factorisation after scaling to a unit diagonal.
fn inverse(matrix: &Square) -> Option<Square> {
    let scale: Gains = std::array::from_fn(|i| matrix[i][i].sqrt());
    if scale.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return None;
    }
    let mut l = [[0.0; GAIN_COUNT]; GAIN_COUNT];
    for i in 0..GAIN_COUNT {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let own = matrix[i][j] / (scale[i] * scale[j]) - known;
            l[i][j] = match i == j {
                true if own > 1e-13 => own.sqrt(),
                true => return None,
                false => own / l[j][j],
            };
        }
    }
    let mut of_l = [[0.0; GAIN_COUNT]; GAIN_COUNT];
    for j in 0..GAIN_COUNT {
        for i in j..GAIN_COUNT {
            let known: f64 = (j..i).map(|k| l[i][k] * of_l[k][j]).sum();
            of_l[i][j] = (if i == j { 1.0 } else { 0.0 } - known) / l[i][i];
        }
    }
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..GAIN_COUNT).map(|k| of_l[k][i] * of_l[k][j]).sum::<f64>() / (scale[i] * scale[j]))
    }))
}

/// Returns the response of each regressor at a frequency, including the hold; zero for the constant.
pub(super) fn regressor_responses(task: &Task, omega_rad_s: f64) -> [Complex64; GAIN_COUNT] {
    let common = NOMINAL.response(omega_rad_s) * hold(omega_rad_s, task.sample_time);
    let s = Complex64::new(0.0, omega_rad_s);
    [common, common * s, common * s * s, Complex64::from(0.0)]
}

/// Returns the estimate of the response that corresponds to the gains.
pub(super) fn reported_response(task: &Task, theta: &Gains, covariance: &Square) -> ReportedResponse {
    let covariance: Vec<f64> = covariance.iter().flatten().copied().collect();
    let each: Vec<_> = task
        .lines_rad_s
        .iter()
        .map(|omega| regressor_responses(task, *omega))
        .collect();
    ReportedResponse {
        response: each
            .iter()
            .map(|g| g.iter().zip(theta).map(|(g, t)| g * t).sum())
            .collect(),
        covariance: Some(each.iter().map(|g| complex_covariance(g, &covariance)).collect()),
        parameters: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_the_identity() {
        let a: Square = std::array::from_fn(|i| {
            std::array::from_fn(|j| 10f64.powi((i + j) as i32) * if i == j { 2.0 } else { 0.5 })
        });
        let b = inverse(&a).unwrap();
        for i in 0..GAIN_COUNT {
            for j in 0..GAIN_COUNT {
                let sum: f64 = (0..GAIN_COUNT).map(|k| a[i][k] * b[k][j]).sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((sum - expected).abs() < 1e-9, "{i} {j} {sum}");
            }
        }
        assert!(inverse(&[[1.0; GAIN_COUNT]; GAIN_COUNT]).is_none());
    }
}
