//! Recursive refined instrumental variable method for `u = (B/F) q^-nk e + (1/D) eps` (P. C. Young, *Recursive
//! Estimation and Time-Series Analysis*, 2nd ed. 2011, ch. 7 and 8, where D is called C; *Automatica* 52 (2015) 35-46).
//!
//! The signals e, u and the noise-free output `x = (B/F) q^-nk e'` are filtered by D/F of an auxiliary model (index f).
//! For
//!
//! `phi = [e_f(t-nk) .., -u_f(t-1) ..]`,  `z = [e'_f(t-nk) .., -x_f(t-1) ..]`
//!
//! the symmetric form of the method computes the gain from the instruments alone, `g = P z/(1 + z' P z)`,
//! `rho <- rho + g (u_f - phi' rho)`. D is estimated by recursive least squares on `xi = u - (B/F) q^-nk e`. Histories
//! are a posteriori: each filter processes a sample again with the updated auxiliary model.
//!
//! **Auxiliary model.** The auxiliary model is the estimate, low-pass filtered with the shortest memory length of B and
//! F. If the estimate were not filtered, the instruments would depend on its errors, and with short memory lengths some
//! runs would diverge. The reported innovation and innovation variance are computed with the auxiliary model, whose
//! filters run in any case.
//!
//! **Instruments.** The signal e' is e itself, or the part of e that follows an external signal ([`super::laguerre`]).
//! With e itself, the method needs the correct noise model in a closed loop: z then contains past noise, which is
//! uncorrelated only with a white eps.
//!
//! **Covariance.** To first order the errors follow `t <- (I - A) t - g eps`, where A has the rows `g_i phi'` for B and
//! F and `g_i psi'` for D; psi is the gradient for all parameters, because D inherits the errors of B and F. The
//! covariance of theta is therefore `sigma^2 C` with `C <- (I - A) C (I - A)' + g g'` for any gain. For lambda = 1 it
//! equals the covariance of the batch method; with forgetting, C is about `P/(1 + lambda)`.
//!
//! **Stability.** A step of B and F is halved until the roots of F lie within a circle of radius [`MAX_POLE_RADIUS`].

mod filters;
mod forgetting;
mod laguerre;
mod options;

use hoid_core::{
    error_bars::MAX_VARIANCE_GROWTH,
    stability::roots_inside,
    state::{State, visit_all},
};
use hoid_ident::{IdentError, linalg::dot};
use hoid_model::Orders;

use hoid_track::{
    Sample,
    building::{History, Recursion, StepOutcome, limit_magnitude, weighted_sum},
};

use filters::{FilteredHistory, ResponseHistory, ThetaParts, fill_f};
use forgetting::{CAPACITY, Forgetting};
use laguerre::LaguerreRegression;

pub use options::RrivOptions;

/// Radius of the circle that must contain the roots of F; the filters then have time constants of at most 10 000
/// samples.
const MAX_POLE_RADIUS: f64 = 0.9999;
/// Number of halvings after which a step is omitted.
const MAX_HALVINGS: usize = 20;
/// Smallest weight of the newest theta in the low-pass filter of the auxiliary model.
const MIN_FILTER_WEIGHT: f64 = 1.0 / 1024.0;
/// Smallest innovation variance, as a fraction of the initial one.
const MIN_VARIANCE_RATIO: f64 = 1e-16;

/// Start of the recursion: a batch fit or a guess.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RefinedStart<'a> {
    /// Coefficients in the order of [`Orders::parameter_names`].
    pub theta: &'a [f64],
    /// Covariance of theta, stored by rows.
    pub covariance: &'a [f64],
    /// Variance of eps.
    pub innovation_variance: f64,
    /// Number of samples of the fit, which determines the initial weight of new samples in the innovation variance.
    pub samples: usize,
}

/// The recursion of the refined instrumental variable method.
#[derive(Debug, Clone)]
pub(crate) struct RefinedRecursion {
    orders: Orders,
    theta: Vec<f64>,
    /// Theta of the auxiliary model, which the filters use.
    auxiliary: Vec<f64>,
    /// Weight of the newest theta in the low-pass filter of the auxiliary model.
    share: f64,
    /// The matrix C, which is the covariance divided by sigma^2.
    spread: Vec<f64>,
    first_spread: Vec<f64>,
    variance: f64,
    min_variance: f64,
    samples: f64,
    /// Weight of the newest sample in the innovation variance in the steady state.
    newest_share: f64,
    system_gain: Forgetting,
    noise_gain: Forgetting,
    measured: ResponseHistory,
    /// Filters of the instruments and the last external value; `None` without an external signal.
    instrument: Option<(LaguerreRegression, ResponseHistory, f64)>,
    output: FilteredHistory,
    /// Past values of xi.
    output_errors: History,
    shortened: usize,
    work: WorkArrays,
}

impl State for RefinedRecursion {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let parts: &mut [&mut dyn State] = &mut [
            &mut self.theta.as_mut_slice(),
            &mut self.auxiliary.as_mut_slice(),
            &mut self.share,
            &mut self.spread.as_mut_slice(),
            &mut self.first_spread.as_mut_slice(),
            &mut self.variance,
            &mut self.min_variance,
            &mut self.samples,
            &mut self.newest_share,
            &mut self.system_gain,
            &mut self.noise_gain,
            &mut self.measured,
            &mut self.output,
            &mut self.output_errors,
            &mut self.shortened,
        ];
        visit_all(parts, each);
        if let Some((following, simulated, last)) = &mut self.instrument {
            visit_all(&mut [following, simulated, last], each);
        }
    }
}

/// Work arrays of one step.
#[derive(Debug, Clone)]
struct WorkArrays {
    phi: Vec<f64>,
    z: Vec<f64>,
    psi: Vec<f64>,
    gain: Vec<f64>,
    trial: Vec<f64>,
    short: Vec<f64>,
    short_gain: Vec<f64>,
    along_phi: Vec<f64>,
    along_psi: Vec<f64>,
    half: Vec<f64>,
}

impl RefinedRecursion {
    /// Creates the recursion with a forgetting factor in (0, 1] for each parameter. If `external` is true, the
    /// instruments are made from the external signal; a missing value is replaced by the last known value.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if the orders include A or C, or if a factor is out of range; [`IdentError::BadStart`]
    /// if the start cannot be used.
    pub fn new(orders: Orders, start: RefinedStart<'_>, lambda: &[f64], external: bool) -> Result<Self, IdentError> {
        let p = orders.parameter_count();
        check_arguments(&orders, &start, lambda)?;
        let variance = start.innovation_variance;
        let spread: Vec<f64> = start.covariance.iter().map(|c| c / variance).collect();
        let gain_of = |places: &[usize]| {
            let element = |k: usize| spread[places[k / places.len()] * p + places[k % places.len()]];
            let block: Vec<f64> = (0..places.len() * places.len()).map(element).collect();
            let factors: Vec<f64> = places.iter().map(|i| lambda[*i]).collect();
            Forgetting::new(&block, &factors).ok_or_else(|| IdentError::BadStart {
                reason: format!(
                    "its covariance is not positive, or the orders {orders} need more than {CAPACITY} \
                     parameters"
                ),
            })
        };
        let noise: Vec<usize> = (orders.nb..orders.nb + orders.nd).collect();
        let system: Vec<usize> = (0..p).filter(|i| !noise.contains(i)).collect();
        let zeros = vec![0.0; p];
        Ok(Self {
            theta: start.theta.to_vec(),
            auxiliary: start.theta.to_vec(),
            share: system
                .iter()
                .map(|i| 1.0 - lambda[*i])
                .fold(MIN_FILTER_WEIGHT, f64::max),
            system_gain: gain_of(&system)?,
            noise_gain: gain_of(&noise)?,
            variance,
            min_variance: MIN_VARIANCE_RATIO * variance,
            samples: start.samples as f64,
            newest_share: 1.0 - lambda.iter().copied().fold(1.0, f64::min),
            measured: ResponseHistory::new(&orders),
            instrument: external.then(|| (LaguerreRegression::new(), ResponseHistory::new(&orders), 0.0)),
            output: FilteredHistory::new(&orders),
            output_errors: History::new(orders.nd),
            shortened: 0,
            work: WorkArrays {
                phi: zeros.clone(),
                z: zeros.clone(),
                psi: zeros.clone(),
                gain: zeros.clone(),
                trial: zeros.clone(),
                short: vec![0.0; system.len()],
                short_gain: vec![0.0; system.len().max(noise.len())],
                along_phi: zeros.clone(),
                along_psi: zeros.clone(),
                half: vec![0.0; p * p],
            },
            first_spread: spread.clone(),
            spread,
            orders,
        })
    }

    /// Returns the number of steps that were shortened to keep F stable.
    #[cfg(test)]
    pub fn shortened_step_count(&self) -> usize {
        self.shortened
    }

    /// Processes a sample. If the output is missing, the prediction replaces it.
    fn take(&mut self, sample: Sample, output: Option<f64>, moves: bool) -> StepOutcome {
        let e = limit_magnitude(sample.e);
        let nk = self.orders.nk;
        self.measured.input.push(e);
        if let Some((following, simulated, last)) = &mut self.instrument {
            *last = sample.reference.unwrap_or(*last);
            let followed = following.step(*last, e);
            simulated.input.push(followed);
        }
        let before = ThetaParts::of(&self.auxiliary, &self.orders);
        let predicted =
            self.measured.response(before.b, before.f, nk) - weighted_sum(before.d, self.output_errors.newest_first());
        let u = limit_magnitude(output.unwrap_or(predicted));
        let innovation = limit_magnitude(u - predicted);
        let shortened = moves && self.update_estimate(u, innovation);
        if moves {
            self.update_auxiliary_theta();
        }
        let after = ThetaParts::of(&self.auxiliary, &self.orders);
        let xi = u - self.measured.response(after.b, after.f, nk);
        self.output_errors.push(xi);
        self.measured.advance(&after, nk);
        if let Some((_, simulated, _)) = &mut self.instrument {
            simulated.advance(&after, nk);
        }
        self.output.push(after.d, after.f, u);
        StepOutcome { innovation, shortened }
    }

    /// Moves the theta of the auxiliary model toward the estimate, unless F would become unstable: for nf > 2 the
    /// region of stable F is not convex.
    fn update_auxiliary_theta(&mut self) {
        let w = &mut self.work;
        for (trial, (auxiliary, theta)) in w.trial.iter_mut().zip(self.auxiliary.iter().zip(&self.theta)) {
            *trial = auxiliary + self.share * (theta - auxiliary);
        }
        if roots_inside(&w.trial[self.orders.nb + self.orders.nd..], MAX_POLE_RADIUS) {
            self.auxiliary.copy_from_slice(&w.trial);
        }
    }

    /// Updates theta, C and the innovation variance. Returns true if the step was shortened.
    fn update_estimate(&mut self, u: f64, innovation: f64) -> bool {
        let Orders { nb, nd, nf, nk, .. } = self.orders;
        let noise = nb..nb + nd;
        let parts = ThetaParts::of(&self.auxiliary, &self.orders);
        let now = ThetaParts::of(&self.theta, &self.orders);
        let w = &mut self.work;
        self.measured.regressors(&parts, nk, &mut w.psi);
        w.phi.copy_from_slice(&w.psi);
        fill_f(&self.output, nf, &mut w.phi);
        w.phi[noise.clone()].fill(0.0);
        match &self.instrument {
            Some((_, simulated, _)) => simulated.regressors(&parts, nk, &mut w.z),
            None => w.z.copy_from_slice(&w.psi),
        }
        for (place, xi) in w.psi[noise.clone()].iter_mut().zip(self.output_errors.newest_first()) {
            *place = -xi;
        }
        let error = self.output.next(parts.d, parts.f, u)
            - weighted_sum(now.b, &w.phi[..nb])
            - weighted_sum(now.f, &w.phi[noise.end..]);

        // Step of B and F.
        w.short[..nb].copy_from_slice(&w.z[..nb]);
        w.short[nb..].copy_from_slice(&w.z[noise.end..]);
        self.system_gain.gain(&w.short, &mut w.short_gain[..nb + nf]);
        w.gain[..nb].copy_from_slice(&w.short_gain[..nb]);
        w.gain[noise.clone()].fill(0.0);
        w.gain[noise.end..].copy_from_slice(&w.short_gain[nb..nb + nf]);
        let mut share = 1.0;
        for _ in 0..MAX_HALVINGS {
            for (i, t) in w.trial.iter_mut().enumerate() {
                *t = limit_magnitude(self.theta[i] + share * w.gain[i] * error);
            }
            if roots_inside(&w.trial[noise.end..], MAX_POLE_RADIUS) {
                break;
            }
            share *= 0.5;
        }
        if !roots_inside(&w.trial[noise.end..], MAX_POLE_RADIUS) {
            share = 0.0;
            w.trial.copy_from_slice(&self.theta);
        }
        self.theta.copy_from_slice(&w.trial);
        w.gain.iter_mut().for_each(|g| *g *= share);

        // Step of D, from the residual xi of the auxiliary model.
        let gain = &mut w.short_gain[..nd];
        self.noise_gain.gain(&w.psi[noise.clone()], gain);
        let parts = ThetaParts::of(&self.auxiliary, &self.orders);
        let now = ThetaParts::of(&self.theta, &self.orders);
        let xi = u - self.measured.response(parts.b, parts.f, nk);
        let error = limit_magnitude(xi - dot(&w.psi[noise.clone()], now.d));
        for (t, g) in self.theta[noise.clone()].iter_mut().zip(gain.iter()) {
            *t = limit_magnitude(*t + g * error);
        }
        w.gain[noise.clone()].copy_from_slice(gain);

        let explained = self.update_error_covariance(&noise);
        self.samples += 1.0;
        let newest = (innovation * innovation / (1.0 + explained) - self.variance)
            * self.newest_share.max(1.0 / self.samples.max(1.0));
        self.variance = (self.variance + newest).max(self.min_variance);
        let shortened = share < 1.0;
        self.shortened += usize::from(shortened);
        shortened
    }

    /// Updates `C <- (I - A) C (I - A)' + g g'`. Returns `psi' C psi` before the update.
    fn update_error_covariance(&mut self, noise: &std::ops::Range<usize>) -> f64 {
        let w = &mut self.work;
        let p = self.theta.len();
        for i in 0..p {
            let row = &self.spread[i * p..(i + 1) * p];
            w.along_phi[i] = dot(row, &w.phi);
            w.along_psi[i] = dot(row, &w.psi);
        }
        let explained = dot(&w.along_psi, &w.psi);
        let row = |i: usize| noise.contains(&i);
        for i in 0..p {
            for j in 0..p {
                let along = if row(i) { w.along_psi[j] } else { w.along_phi[j] };
                w.half[i * p + j] = self.spread[i * p + j] - w.gain[i] * along;
            }
        }
        for i in 0..p {
            let half = &w.half[i * p..(i + 1) * p];
            let (by_phi, by_psi) = (dot(half, &w.phi), dot(half, &w.psi));
            for j in 0..=i {
                let by = if row(j) { by_psi } else { by_phi };
                let value = limit_magnitude(half[j] - w.gain[j] * by + w.gain[i] * w.gain[j]);
                self.spread[i * p + j] = value;
                self.spread[j * p + i] = value;
            }
        }
        if (0..p).any(|i| self.spread[i * (p + 1)] < 0.0) {
            // Rounding errors can make C invalid, like P; C is then reset.
            self.spread.copy_from_slice(&self.first_spread);
        }
        for i in 0..p {
            // The first-order recursion of C can be unstable although the recursion of theta is stable. Each variance
            // is therefore limited to [`MAX_VARIANCE_GROWTH`] times its initial value.
            let limit = MAX_VARIANCE_GROWTH * self.first_spread[i * (p + 1)];
            let found = self.spread[i * (p + 1)];
            if limit > 0.0 && found > limit {
                let share = (limit / found).sqrt();
                for j in 0..p {
                    self.spread[i * p + j] *= share;
                    self.spread[j * p + i] *= share;
                }
            }
        }
        if explained.is_finite() { explained.max(0.0) } else { 0.0 }
    }
}

impl Recursion for RefinedRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        self.take(sample, Some(sample.u), true)
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        self.take(sample, Some(sample.u), false)
    }

    fn bridge(&mut self, sample: Sample) {
        self.take(sample, None, false);
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        for (c, spread) in into.iter_mut().zip(&self.spread) {
            *c = limit_magnitude(self.variance * spread);
        }
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.variance
    }
}

fn check_arguments(orders: &Orders, start: &RefinedStart<'_>, lambda: &[f64]) -> Result<(), IdentError> {
    let p = orders.parameter_count();
    let bad = |reason: String| Err(IdentError::BadStart { reason });
    if orders.na + orders.nc > 0 || orders.nb == 0 {
        return Err(IdentError::BadOption {
            option: "the orders of the refined recursion".to_owned(),
            found: orders.to_string(),
            expected: "na = 0, nc = 0 and nb of 1 or more: Box-Jenkins with an autoregressive noise, or output error"
                .to_owned(),
        });
    }
    if lambda.len() != p || lambda.iter().any(|l| !(*l > 0.0 && *l <= 1.0)) {
        return Err(IdentError::BadOption {
            option: "the forgetting factors".to_owned(),
            found: format!("{lambda:?}"),
            expected: format!("{p} numbers above 0 and at most 1, one for each parameter"),
        });
    }
    if start.theta.len() != p || start.covariance.len() != p * p {
        return bad(format!(
            "it has {} coefficients and {} elements of the covariance, but the orders {orders} need {p} and {}",
            start.theta.len(),
            start.covariance.len(),
            p * p
        ));
    }
    let diagonal = |i: usize| start.covariance[i * p + i];
    if start.theta.iter().chain(start.covariance).any(|v| !v.is_finite()) || (0..p).any(|i| diagonal(i) < 0.0) {
        return bad(
            "a coefficient is not finite, or a variance is negative; fit the start to other samples".to_owned(),
        );
    }
    if !(start.innovation_variance.is_finite() && start.innovation_variance > 0.0) {
        return bad(format!(
            "its innovation variance is {}; a recursion needs a positive variance, which an exact fit does not have",
            start.innovation_variance
        ));
    }
    if !roots_inside(&start.theta[p - orders.nf..], MAX_POLE_RADIUS) {
        return bad(format!(
            "F has a root outside the circle of radius {MAX_POLE_RADIUS}; start from a span that excites its poles"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
