//! The recursive prediction-error method in physical parameters.
//!
//! The parameters are `eta = [K_e, K_e_dot, omega_nm, zeta_nm, c.., d..]`, or with the delay
//! `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e, c.., d..]`. The predictor is the Box-Jenkins predictor with the
//! polynomials `theta(eta)` of the exact zero-order hold ([`hoid_core::zoh_operator`]); its gradient is
//! `psi_eta = (d theta/d eta)' psi_theta`. The step is computed as in [`hoid_core::rpem`], but each forgetting factor
//! now belongs to a quantity whose rate of change the user knows: operators adapt their gains, but hardly their
//! neuromuscular system.
//!
//! Each parameter stays within its bounds: a step is cut off at the bound. C (and D, with
//! [`StablePolynomials::PredictorAndNoise`]) is kept stable by halving the step.
//!
//! If the delay is a parameter, `tau_e = l Ts + delta`, and B has three coefficients after a delay of `nk = l + 1`
//! samples. When tau_e passes a whole sample, B is shifted along the past input that the predictor keeps, without a
//! transient. At a delay of whole samples the model is continuous, but its derivative has a kink (see
//! [`hoid_core::zoh_operator`]).

use hoid_core::{
    adaptation::Adaptation,
    bounds::clamp,
    error_bars::{ErrorBars, ErrorPropagation},
    predictor::{Predictor, Regressor},
    recursion::{StablePolynomials, Step, backtrack, ratio},
    sensitivities::{ErrorLayout, LinearForm, Sensitivities},
    shape::Shape,
    zoh_operator::{zoh_operator, zoh_operator_delayed},
};

/// Index of omega_nm in eta.
const OMEGA_INDEX: usize = 2;
/// Index of zeta_nm in eta.
const ZETA_INDEX: usize = 3;
/// Index of tau_e in eta, if tau_e is a parameter.
const TAU_INDEX: usize = 4;

/// Model of the recursion: orders, sample time and bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalModel<S, const N: usize> {
    /// Orders: nc and nd are arbitrary, na = 0, nf = 2, and nb = 2, or 3 if tau_e is a parameter.
    pub shape: S,
    /// If tau_e is a parameter, the smallest delay nk in samples; the recursion receives the input `x(t) = e(t - nk)`.
    pub smallest_nk: Option<usize>,
    /// Sample time in s.
    pub sample_time: f64,
    /// Smallest and largest value of each parameter.
    pub bounds: [[f64; 2]; N],
    /// Noise polynomials that are kept stable.
    pub stable: StablePolynomials,
}

/// The recursion. N is the capacity for parameters; K is the capacity for the errors of the filters
/// ([`ErrorLayout::filter_error_count`]; 0 for the default error bars); L is the number of past inputs that are kept,
/// at least nc: 2 if tau_e is not a parameter, otherwise 3 plus the range of the delay.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalRpem<S, const N: usize, const K: usize, const L: usize, A> {
    model: PhysicalModel<S, N>,
    predictor: Predictor<S, N, L>,
    eta: [f64; N],
    /// Polynomials at eta, their Jacobian with respect to the operator's parameters, and the whole samples of the
    /// delay.
    polynomials: Polynomials<N>,
    psi: [f64; N],
    adaptation: A,
    bars: ErrorBars<N, K>,
    restarts: u64,
}

#[derive(Debug, Clone, PartialEq)]
struct Polynomials<const N: usize> {
    theta: [f64; N],
    /// The rows are b.., f1, f2; the columns are the operator's parameters.
    jacobian: [[f64; 5]; 5],
    whole_samples: usize,
}

hoid_core::state!([const N: usize] Polynomials<N> { theta, jacobian, whole_samples });
hoid_core::state!([S, const N: usize, const K: usize, const L: usize, A: hoid_core::state::State] PhysicalRpem<S, N, K, L, A> {
    predictor, eta, polynomials, psi, adaptation, bars, restarts,
});

impl<S: Shape, const N: usize> PhysicalModel<S, N> {
    /// Number of operator parameters, which precede c and d in eta.
    fn operator_parameter_count(&self) -> usize {
        self.shape.nb() + 2
    }

    fn polynomials(&self, eta: &[f64; N]) -> Polynomials<N> {
        let gains = [eta[0], eta[1], eta[2], eta[3]];
        let noise = self.shape.nc() + self.shape.nd();
        let mut theta = [0.0; N];
        let mut jacobian = [[0.0; 5]; 5];
        let (operator, mut whole_samples) = (self.operator_parameter_count(), 0);
        if self.smallest_nk.is_some() {
            let samples = eta[TAU_INDEX] / self.sample_time;
            // The tolerance allows for rounding errors: 0.29/0.01 is 28.999999999999996.
            let whole = libm::floor(samples * (1.0 + 1e-12) + 1e-12).max(0.0);
            whole_samples = whole as usize;
            let delta = (eta[TAU_INDEX] - whole * self.sample_time).clamp(0.0, self.sample_time);
            let (values, by) = zoh_operator_delayed(gains, delta, self.sample_time);
            jacobian = by;
            theta[..3].copy_from_slice(&values[..3]);
            theta[3 + noise..5 + noise].copy_from_slice(&values[3..]);
        } else {
            let (values, by) = zoh_operator(gains, self.sample_time);
            for (row, by) in jacobian.iter_mut().zip(by) {
                row[..4].copy_from_slice(&by);
            }
            theta[..2].copy_from_slice(&values[..2]);
            theta[2 + noise..4 + noise].copy_from_slice(&values[2..]);
        }
        let nb = operator - 2;
        theta[nb..nb + noise].copy_from_slice(&eta[operator..operator + noise]);
        Polynomials {
            theta,
            jacobian,
            whole_samples,
        }
    }

    fn is_within_bounds(&self, eta: &[f64; N]) -> bool {
        eta.iter()
            .zip(&self.bounds)
            .all(|(e, [low, high])| low <= e && e <= high)
    }
}

impl<S: Shape, const N: usize, const K: usize, const L: usize, A: Adaptation<N>> PhysicalRpem<S, N, K, L, A> {
    /// Creates the recursion at eta with filters at rest. `None` if the orders do not satisfy [`PhysicalModel::shape`],
    /// if N, K or L is too small, if eta lies outside the bounds, if the bounds allow omega_nm or zeta_nm to become
    /// zero, or if the noise model is not stable.
    pub fn new(model: PhysicalModel<S, N>, eta: [f64; N], adaptation: A, bars: ErrorBars<N, K>) -> Option<Self> {
        let shape = model.shape;
        let predictor = Predictor::new(shape, Regressor::Gradient)?;
        let nb = if model.smallest_nk.is_some() { 3 } else { 2 };
        let orders = (shape.na(), shape.nb(), shape.nf()) == (0, nb, 2);
        let sound = orders
            && model.sample_time > 0.0
            && model.bounds[OMEGA_INDEX][0] > 0.0
            && model.bounds[ZETA_INDEX][0] > 0.0
            && model.is_within_bounds(&eta);
        if !sound || ErrorLayout::for_capacity::<S, K>(&shape).filter_error_count() > K {
            return None;
        }
        let polynomials = model.polynomials(&eta);
        if !model.stable.accepts(&shape, &polynomials.theta) {
            return None;
        }
        let mut recursion = Self {
            model,
            predictor,
            eta,
            polynomials,
            psi: [0.0; N],
            adaptation,
            bars,
            restarts: 0,
        };
        recursion.apply_delay();
        Some(recursion)
    }

    /// Shifts B in the predictor to the delay of the estimate.
    fn apply_delay(&mut self) {
        if let Some(first) = self.model.smallest_nk {
            let nk = self.polynomials.whole_samples + 1;
            self.predictor.set_offset(nk.saturating_sub(first));
        }
    }

    #[inline(always)]
    fn predict(&mut self, x: f64, u: f64) -> f64 {
        let (of_theta, innovation) = self.predictor.predict(&self.polynomials.theta, x, u);
        self.psi = self.chain_rule(of_theta);
        innovation
    }

    /// Converts a gradient with respect to theta into one with respect to eta: `J' psi_theta`.
    #[inline(always)]
    fn chain_rule(&self, of_theta: [f64; N]) -> [f64; N] {
        let shape = self.model.shape;
        let (operator, noise) = (self.model.operator_parameter_count(), shape.nc() + shape.nd());
        let nb = operator - 2;
        let jacobian = &self.polynomials.jacobian;
        let mut row = of_theta;
        for j in 0..operator {
            let mut sum = 0.0;
            for i in 0..nb {
                sum += of_theta[i] * jacobian[i][j];
            }
            for i in 0..2 {
                sum += of_theta[nb + noise + i] * jacobian[nb + i][j];
            }
            row[j] = sum;
        }
        row[operator..operator + noise].copy_from_slice(&of_theta[nb..nb + noise]);
        row
    }

    /// Processes a sample `x(t) = e(t - nk)`, `u(t)`; nk is [`PhysicalModel::smallest_nk`] if the delay is a parameter.
    /// Both values must be finite.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        let innovation = self.predict(x, u);
        let (layout, rows) = self.sensitivities();
        let limited = self.bars.clip(innovation);
        let used = ratio(limited, innovation);
        let moved = self
            .adaptation
            .update(&self.psi, limited, &self.eta, self.bars.innovation_variance());
        let (operator, noise) = (
            self.model.operator_parameter_count(),
            self.model.shape.nc() + self.model.shape.nd(),
        );
        let (shape, stable) = (self.model.shape, self.model.stable);
        // The bounds keep the operator's part of theta stable; only the noise model has to be tested.
        let (allowed, mut eta) = backtrack(&self.eta, &moved.step, |eta| {
            let mut theta = [0.0; N];
            theta[operator - 2..operator - 2 + noise].copy_from_slice(&eta[operator..operator + noise]);
            stable.accepts(&shape, &theta)
        });
        let (fraction, cut) = self.limit_to_bounds(&moved.step, allowed, &mut eta);
        let mut gain = moved.gain;
        for i in 0..N {
            gain[i] *= fraction[i] * used;
        }
        self.eta = eta;
        self.bars.update(&layout, &rows, &gain, innovation);
        self.adaptation.add_drift_to(&mut self.bars);
        self.polynomials = self.model.polynomials(&eta);
        self.apply_delay();
        self.correct();
        Step {
            innovation,
            shortened: allowed < 1.0 || cut,
        }
    }

    /// Limits the new estimate to the bounds. Returns the fraction of the step that remains for each parameter, which
    /// is `allowed` inside the bounds, and whether a parameter was limited.
    #[inline(always)]
    fn limit_to_bounds(&self, step: &[f64; N], allowed: f64, eta: &mut [f64; N]) -> ([f64; N], bool) {
        let (mut fraction, mut cut) = ([allowed; N], false);
        for i in 0..N {
            let bounded = clamp(eta[i], self.model.bounds[i]);
            if bounded != eta[i] {
                cut = true;
                fraction[i] = if step[i] == 0.0 {
                    0.0
                } else {
                    (bounded - self.eta[i]) / step[i]
                };
                eta[i] = bounded;
            }
        }
        (fraction, cut)
    }

    /// As [`PhysicalRpem::step`], but only the filters are updated; the estimate stays constant.
    pub fn step_without_update(&mut self, x: f64, u: f64) -> Step {
        let innovation = self.predict(x, u);
        let (layout, rows) = self.sensitivities();
        self.bars.propagate(&layout, &rows);
        self.correct();
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`PhysicalRpem::step_without_update`] for a missing output, which the one-step prediction replaces.
    pub fn bridge(&mut self, x: f64) {
        self.predict(x, 0.0);
        self.predictor.bridge(&self.polynomials.theta);
        let (layout, rows) = self.sensitivities();
        self.bars.propagate(&layout, &rows);
        self.correct();
    }

    /// Returns the sensitivities with respect to eta, in which the noise parameters follow the operator parameters.
    #[inline(always)]
    fn sensitivities(&self) -> (ErrorLayout, Sensitivities<N, K>) {
        if K == 0 {
            return (ErrorLayout::NO_FILTER_ERRORS, Sensitivities::from_gradient(&self.psi));
        }
        let layout = ErrorLayout::of(&self.model.shape);
        let rows = self.predictor.sensitivities(&self.polynomials.theta, &layout);
        let in_eta = |row: LinearForm<N, K>| LinearForm {
            theta: self.chain_rule(row.theta),
            filters: row.filters,
        };
        let layout = ErrorLayout {
            noise: (self.model.operator_parameter_count(), layout.noise.1),
            ..layout
        };
        let rows = Sensitivities {
            w: in_eta(rows.w),
            v: in_eta(rows.v),
            e: in_eta(rows.e),
        };
        (layout, rows)
    }

    #[inline(always)]
    fn correct(&mut self) {
        if !self.predictor.correct(&self.polynomials.theta).is_finite() {
            self.predictor.reset();
            self.restarts += 1;
        }
    }

    /// Returns the estimate eta.
    pub fn eta(&self) -> &[f64; N] {
        &self.eta
    }

    /// Returns the polynomials at eta, `[b.. c.. d.. f..]`.
    pub fn theta(&self) -> &[f64; N] {
        &self.polynomials.theta
    }

    /// Returns the Jacobian of `[b.., f1, f2]` with respect to the operator's parameters.
    pub fn jacobian(&self) -> &[[f64; 5]; 5] {
        &self.polynomials.jacobian
    }

    /// Returns the gradient psi at the last sample.
    pub fn psi(&self) -> &[f64; N] {
        &self.psi
    }

    /// Returns the adaptation with its covariance.
    pub fn adaptation(&self) -> &A {
        &self.adaptation
    }

    /// Returns the delay of b0 in samples if tau_e is a parameter: the whole samples of tau_e, plus one for the hold.
    pub fn nk(&self) -> usize {
        self.polynomials.whole_samples + 1
    }

    /// Returns the adaptation, for modification by the caller.
    pub fn adaptation_mut(&mut self) -> &mut A {
        &mut self.adaptation
    }

    /// Returns the covariance of eta divided by sigma^2.
    pub fn normalised_covariance(&self) -> [[f64; N]; N] {
        self.adaptation.normalised_covariance(&self.bars)
    }

    /// Returns the innovation variance sigma^2.
    pub fn innovation_variance(&self) -> f64 {
        self.bars.innovation_variance()
    }

    /// Returns the number of overflows after which the filters were reset.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}
