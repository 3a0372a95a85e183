//! Result of a step of a recursion, and steps that are shortened until the predictor is stable.

use crate::{shape::Shape, stability::roots_inside};

/// Result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// A-priori innovation eps.
    pub innovation: f64,
    /// True if the step of the estimate was shortened by a stability condition or a bound.
    pub shortened: bool,
}

/// Polynomials whose roots a recursion keeps inside the unit circle. If C or F is unstable, the predictor and its
/// gradient diverge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StablePolynomials {
    /// C and F.
    #[default]
    Predictor,
    /// C, D and F, so the noise model is stationary, as in the thesis.
    PredictorAndNoise,
}

/// Maximum number of halvings of a step. If it is reached, the estimate stays constant.
const MAX_HALVINGS: u32 = 12;

impl StablePolynomials {
    /// True if all roots of the selected polynomials of theta are inside the unit circle.
    #[inline]
    pub fn accepts<S: Shape>(self, shape: &S, theta: &[f64]) -> bool {
        let [_, _, c, d, f] = shape.split(theta);
        roots_inside(c, 1.0) && roots_inside(f, 1.0) && (self == Self::Predictor || roots_inside(d, 1.0))
    }
}

/// Returns `part/whole`, or 1 if `part` and `whole` are equal, including two zeros.
#[inline(always)]
pub fn ratio(part: f64, whole: f64) -> f64 {
    if part == whole { 1.0 } else { part / whole }
}

/// True if every number is finite. The test uses floating-point registers and no branch for each number.
#[inline(always)]
pub(crate) fn all_finite<const N: usize>(values: &[f64; N]) -> bool {
    // Zero times infinity or NaN is NaN.
    values.iter().fold(0.0, |sum, v| sum + 0.0 * v) == 0.0
}

/// Reduces a step to the largest of the fractions 1, 1/2, 1/4 ... at which the new theta is allowed. Returns the
/// fraction and the new theta, or 0 and the old theta if no fraction is allowed.
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
    halve_until_allowed(&theta, &step, allowed)
}

/// Like [`backtrack`], for a full step that is not allowed.
#[cold]
#[inline(never)]
fn halve_until_allowed<const N: usize>(
    theta: &[f64; N],
    step: &[f64; N],
    allowed: impl Fn(&[f64; N]) -> bool,
) -> (f64, [f64; N]) {
    let mut fraction = 0.5;
    for _ in 0..MAX_HALVINGS {
        let moved: [f64; N] = core::array::from_fn(|i| theta[i] + fraction * step[i]);
        if moved.iter().all(|t| t.is_finite()) && allowed(&moved) {
            return (fraction, moved);
        }
        fraction *= 0.5;
    }
    (0.0, *theta)
}
