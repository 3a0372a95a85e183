//! The outcome of a step, and steps that are shortened until they keep the predictor stable.

use crate::{shape::Shape, stability::roots_inside};

/// The outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// A-priori innovation eps.
    pub innovation: f64,
    /// True when stability or a bound made the step of the estimate shorter.
    pub shortened: bool,
}

/// Polynomials whose roots a recursion keeps inside the unit circle. Without C and F there the
/// predictor and its gradient diverge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stable {
    /// C and F.
    #[default]
    Predictor,
    /// C, D and F: a noise model that is stationary too, as the thesis has it.
    PredictorAndNoise,
}

/// Largest number of halvings of a step; after them the estimate stays.
const HALVINGS: u32 = 12;

impl Stable {
    /// True for a theta that may be used.
    #[inline]
    pub fn holds<S: Shape>(self, shape: &S, theta: &[f64]) -> bool {
        let [_, _, c, d, f] = shape.split(theta);
        roots_inside(c, 1.0) && roots_inside(f, 1.0) && (self == Self::Predictor || roots_inside(d, 1.0))
    }
}

/// `part/whole`; 1 where the two are equal, so also where both are zero.
#[inline(always)]
pub fn ratio(part: f64, whole: f64) -> f64 {
    if part == whole { 1.0 } else { part / whole }
}

/// True when every number is finite; in floating-point registers and without a branch for each
/// number.
#[inline(always)]
pub(crate) fn all_finite<const N: usize>(values: &[f64; N]) -> bool {
    // Zero times infinity or NaN is NaN.
    values.iter().fold(0.0, |sum, v| sum + 0.0 * v) == 0.0
}

/// The largest of the fractions 1, 1/2, 1/4 ... of a step that is allowed, and theta after it; 0
/// and theta when none is.
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
