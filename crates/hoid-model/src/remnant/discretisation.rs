//! The two discretisations of the remnant filter, each with its pole and gain.

use super::zoh_numerator::FactoredNumerator;

/// Lower limit of Ts/T_n for which the filter is computed; the upper limit is the reciprocal of this value.
pub(super) const MIN_TIME_CONSTANT_RATIO: f64 = 1e-9;

/// Discretisation of the remnant filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum RemnantDiscretisation {
    /// Exact for noise held over each sample.
    #[default]
    ZeroOrderHold,
    /// `s = (1 - z^-1)/Ts`, the form of the thesis (eq. 13, B.11).
    BackwardEuler,
}

crate::named_choice!(RemnantDiscretisation, "discretisation of the remnant", 2, {
    ZeroOrderHold => "zoh",
    BackwardEuler => "backward-euler",
});

impl RemnantDiscretisation {
    /// Returns the pole alpha as a function of `a = Ts/T_n`.
    pub(super) fn pole(self, a: f64) -> f64 {
        match self {
            Self::ZeroOrderHold => (-a).exp(),
            Self::BackwardEuler => 1.0 / (1.0 + a),
        }
    }

    /// Returns `T_n/Ts` as a function of the pole, and the derivative of this function.
    pub(super) fn time_constant(self, alpha: f64) -> (f64, f64) {
        match self {
            Self::ZeroOrderHold => {
                let log = alpha.ln();
                (-1.0 / log, 1.0 / (alpha * log * log))
            }
            Self::BackwardEuler => (alpha / (1.0 - alpha), 1.0 / ((1.0 - alpha) * (1.0 - alpha))),
        }
    }

    /// Returns sigma', the standard deviation of the innovation for K_n = 1, and its logarithmic derivative with
    /// respect to `a = Ts/T_n`.
    pub(super) fn innovation_sd(self, order: usize, a: f64) -> (f64, f64) {
        match self {
            Self::ZeroOrderHold => {
                let held = FactoredNumerator::new(order, a);
                (held.innovation_sd, held.log_derivative)
            }
            Self::BackwardEuler => (backward_gain(order, a), order as f64 / (a * (1.0 + a))),
        }
    }
}

/// Returns the coefficients of `(1 - alpha q^-1)^m`.
pub(crate) fn denominator(order: usize, alpha: f64) -> Vec<f64> {
    (0..=order)
        .map(|i| binomial(order, i) * (-alpha).powi(i as i32))
        .collect()
}

/// Returns the gain `(Ts/(T_n + Ts))^m` of the backward Euler filter (B.12).
pub(super) fn backward_gain(order: usize, a: f64) -> f64 {
    (a / (1.0 + a)).powi(order as i32)
}

pub(super) fn binomial(n: usize, k: usize) -> f64 {
    (1..=k).fold(1.0, |b, i| b * (n + 1 - i) as f64 / i as f64)
}
