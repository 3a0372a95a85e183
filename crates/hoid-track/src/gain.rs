//! The gain of a recursion, as selected by the options.

use hoid_core::{
    adaptation::{Adaptation, Forgetting, ParameterStep},
    covariance::Covariance,
    error_bars::{ErrorBars, ErrorPropagation},
    innovation_variance::InnovationVariance,
    state::State,
    ud_covariance::UdCovariance,
    window::Window,
};
use hoid_model::SampleTime;

use hoid_ident::IdentError;

use crate::{forgetting::ForgettingRule, setup::Setup, shared_options::WindupGuard, start::StartState};

/// Limit of the variance of an unexcited parameter in P, as a multiple of its level with the excitation of the start
/// span: after a silence, the gain corresponds to about three times the typical standard error.
const MAX_VARIANCE_GROWTH: f64 = 10.0;
/// Limit of the variance of an unexcited parameter in P if the start covariance does not come from a fit, as a multiple
/// of its start value.
pub const VARIANCE_GROWTH_WITHOUT_FIT: f64 = 1e4;
/// Growing memory of a start without a fit: additional forgetting at the first sample, and the factor by which the
/// additional forgetting decays per sample.
const EARLY_FORGETTING: f64 = 0.01;
const EARLY_DECAY: f64 = 0.9993;
/// Smallest factor of variable forgetting: a memory of ten samples.
const MIN_FORGETTING_FACTOR: f64 = 0.9;
/// Longest sliding window (in samples); each sample takes as many numbers as there are parameters, plus one.
const MAX_WINDOW_SAMPLES: f64 = 1e7;
/// Memory length of the innovation variance, as a multiple of the shortest memory of a parameter.
const VARIANCE_MEMORY_RATIO: f64 = 4.0;

/// The gains of the kernel as one type, so each recursion is compiled once.
pub enum Gain<const N: usize> {
    /// P in factored form.
    Covariance(Covariance<N>),
    /// The sums of a sliding window.
    Window(Window<N, Vec<f64>>),
}

impl<const N: usize> State for Gain<N> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        match self {
            Self::Covariance(c) => c.visit(each),
            Self::Window(w) => w.visit(each),
        }
    }
}

impl<const N: usize> Gain<N> {
    /// Builds the gain with capacity for N parameters. If `growing` is true, the memory of a start without a fit grows
    /// from a short length, so the gradients of early, unreliable estimates are forgotten. Least squares has no such
    /// gradients.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other, or a start covariance that is not positive.
    pub fn new(setup: &Setup, from: &StartState, sample_time: SampleTime, growing: bool) -> Result<Self, IdentError> {
        let p = from.values.len();
        let lambda = setup
            .memories
            .iter()
            .map(|(_, memory)| memory.lambda(sample_time))
            .collect::<Result<Vec<f64>, _>>()?;
        let shortest = lambda.iter().copied().fold(1.0, f64::min);
        // Without a fit the innovation variance is unknown, and P and drift are in the units of the parameters.
        let unit = if from.variance > 0.0 { from.variance } else { 1.0 };
        let padded =
            |values: &[f64], fill: f64| -> [f64; N] { std::array::from_fn(|i| values.get(i).copied().unwrap_or(fill)) };
        let square = |values: &[f64]| -> [[f64; N]; N] {
            std::array::from_fn(|i| std::array::from_fn(|j| if i < p && j < p { values[i * p + j] } else { 0.0 }))
        };
        let forgetting = match &setup.forgetting {
            ForgettingRule::Exponential => Forgetting::Exponential {
                lambda: padded(&lambda, 1.0),
            },
            ForgettingRule::RandomWalk(drift) => {
                let names = setup.parameter_names();
                if let Some(unknown) = drift.keys().find(|k| !names.contains(k)) {
                    return Err(IdentError::UnknownParameter {
                        name: unknown.clone(),
                        available: names.join(", "),
                    });
                }
                let variance = |name: &String| drift.get(name).map_or(0.0, |d| d * d * sample_time.s() / unit);
                let each: Vec<f64> = names.iter().map(variance).collect();
                Forgetting::RandomWalk {
                    drift: padded(&each, 0.0),
                }
            }
            ForgettingRule::Window => {
                let samples = (1.0 / (1.0 - shortest)).round();
                if samples.is_nan() || samples > MAX_WINDOW_SAMPLES {
                    return Err(IdentError::BadOption {
                        option: "the sliding window".to_owned(),
                        found: match shortest < 1.0 {
                            true => format!("{samples} samples"),
                            false => "an infinite memory".to_owned(),
                        },
                        expected: "a memory in samples or seconds, of at most 10 million samples".to_owned(),
                    });
                }
                let memory = vec![0.0; Window::<N, Vec<f64>>::memory_length(samples as usize)];
                let Some(window) = Window::<N, Vec<f64>>::new(memory, p) else {
                    return Err(IdentError::BadOption {
                        option: "the sliding window".to_owned(),
                        found: format!("{samples} samples"),
                        expected: "at least one sample".to_owned(),
                    });
                };
                return Ok(Self::Window(window));
            }
            ForgettingRule::Variable => Forgetting::Variable {
                memory: 1.0 / (1.0 - shortest),
                smallest: MIN_FORGETTING_FACTOR,
            },
            ForgettingRule::Directional => Forgetting::Directional { lambda: shortest },
            ForgettingRule::Gradient(rate) => Forgetting::Gradient { rate: *rate },
        };
        let matrix = square(&from.covariance);
        let Some(factors) = UdCovariance::from_matrix(&matrix) else {
            return Err(IdentError::BadStart {
                reason: "its covariance is not positive; give a start covariance, such as 0.1".to_owned(),
            });
        };
        let bound = std::array::from_fn(|i| {
            let room = match (setup.windup_guard, setup.covariance) {
                (Some(WindupGuard::Off), _) => return f64::INFINITY,
                (Some(WindupGuard::Bound(multiple)), _) => multiple,
                // P is proportional to 1/N after a start of N samples, and to 1 - lambda with forgetting.
                (None, None) if from.from_fit && i < p => {
                    MAX_VARIANCE_GROWTH * (from.residuals * (1.0 - lambda[i])).max(1.0)
                }
                _ => VARIANCE_GROWTH_WITHOUT_FIT,
            };
            room * matrix[i][i]
        });
        let covariance = Covariance::new(factors, forgetting, bound);
        Ok(Self::Covariance(if from.from_fit || !growing {
            covariance
        } else {
            covariance.with_growing_memory(EARLY_FORGETTING, EARLY_DECAY)
        }))
    }
}

/// A gain whose covariance P can be scaled.
pub trait ScaleCovariance {
    /// Multiplies P by a factor; returns false if the gain has no P.
    fn scale(&mut self, factor: f64) -> bool;
}

impl<const N: usize> ScaleCovariance for Gain<N> {
    fn scale(&mut self, factor: f64) -> bool {
        match self {
            Self::Covariance(c) => c.scale(factor),
            Self::Window(_) => return false,
        }
        true
    }
}

impl<const N: usize> Adaptation<N> for Gain<N> {
    #[inline]
    fn update(&mut self, psi: &[f64; N], eps: f64, theta: &[f64; N], variance: f64) -> ParameterStep<N> {
        match self {
            Self::Covariance(c) => c.update(psi, eps, theta, variance),
            Self::Window(w) => w.update(psi, eps, theta, variance),
        }
    }

    fn own_covariance(&self) -> Option<[[f64; N]; N]> {
        match self {
            Self::Covariance(c) => c.own_covariance(),
            Self::Window(w) => w.own_covariance(),
        }
    }

    #[inline]
    fn add_drift_to<const K: usize, B: ErrorPropagation<N, K>>(&self, bars: &mut B) {
        match self {
            Self::Covariance(c) => c.add_drift_to(bars),
            Self::Window(w) => w.add_drift_to(bars),
        }
    }

    fn needs_innovation_variance(&self) -> bool {
        match self {
            Self::Covariance(c) => c.needs_innovation_variance(),
            Self::Window(w) => w.needs_innovation_variance(),
        }
    }

    fn is_valid(&self) -> bool {
        match self {
            Self::Covariance(c) => c.is_valid(),
            Self::Window(w) => w.is_valid(),
        }
    }
}

/// Returns the error bars at the start of a recursion, with capacity for N parameters and K filters.
///
/// # Errors
/// [`IdentError::BadOption`] for a memory that is too short.
pub fn error_bars<const N: usize, const K: usize>(
    setup: &Setup,
    from: &StartState,
    sample_time: SampleTime,
) -> Result<ErrorBars<N, K>, IdentError> {
    let mut shortest = 1.0_f64;
    for (_, memory) in &setup.memories {
        shortest = shortest.min(memory.lambda(sample_time)?);
    }
    let level = InnovationVariance::new(
        from.variance,
        from.residuals,
        1.0 - (1.0 - shortest) / VARIANCE_MEMORY_RATIO,
    );
    let p = from.values.len();
    let start: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| if i < p && j < p { from.spread[i * p + j] } else { 0.0 }));
    Ok(ErrorBars::new(&start, level, setup.limit))
}
