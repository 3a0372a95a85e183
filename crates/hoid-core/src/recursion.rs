//! Outcome of a step, and steps that are shortened until the predictor is stable.

use crate::{shape::Shape, stability::roots_inside};

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// A-priori innovation eps.
    pub innovation: f64,
    /// True if stability or a bound shortened the step of the estimate.
    pub shortened: bool,
}

/// Polynomials whose roots a recursion keeps inside the unit circle. With unstable C and F the predictor and its
/// gradient diverge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stable {
    /// C and F.
    #[default]
    Predictor,
    /// C, D and F: with a stationary noise model, as in the thesis.
    PredictorAndNoise,
}

/// Largest number of halvings of a step; after them the estimate stays constant.
const HALVINGS: u32 = 12;

impl Stable {
    /// True if theta is stable.
    #[inline]
    pub fn holds<S: Shape>(self, shape: &S, theta: &[f64]) -> bool {
        let [_, _, c, d, f] = shape.split(theta);
        roots_inside(c, 1.0) && roots_inside(f, 1.0) && (self == Self::Predictor || roots_inside(d, 1.0))
    }
}

/// Returns `part/whole`; 1 if the two are equal, also if both are zero.
#[inline(always)]
pub fn ratio(part: f64, whole: f64) -> f64 {
    if part == whole { 1.0 } else { part / whole }
}

/// True if every number is finite; computed in floating-point registers and without a branch for each number.
#[inline(always)]
pub(crate) fn all_finite<const N: usize>(values: &[f64; N]) -> bool {
    // Zero times infinity or NaN is NaN.
    values.iter().fold(0.0, |sum, v| sum + 0.0 * v) == 0.0
}

/// Returns the largest of the fractions 1, 1/2, 1/4 ... of a step that is allowed, and theta after it; 0 and theta if
/// none is.
#[inline]
pub fn backtrack<const N: usize>(
    theta: &[f64; N],
    step: &[f64; N],
    allowed: impl Fn(&[f64; N]) -> bool,
) -> (f64, [f64; N]) {
    let whole: [f64; N] = core::array::from_fn(|i| theta[i] + step[i]);
    if all_finite(&whole) && allowed(&whole) {
        return (1.0, whole);
    }
    let (theta, step) = (*theta, *step);
    halved(&theta, &step, allowed)
}

/// The same for a whole step that is not allowed.
#[cold]
#[inline(never)]
fn halved<const N: usize>(theta: &[f64; N], step: &[f64; N], allowed: impl Fn(&[f64; N]) -> bool) -> (f64, [f64; N]) {
    let mut fraction = 0.5;
    for _ in 0..HALVINGS {
        let moved: [f64; N] = core::array::from_fn(|i| theta[i] + fraction * step[i]);
        if moved.iter().all(|t| t.is_finite()) && allowed(&moved) {
            return (fraction, moved);
        }
        fraction *= 0.5;
    }
    (0.0, *theta)
}
