//! Termination of a search.

use std::fmt;

/// Reason for the end of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// The problem is linear and was solved directly.
    Direct,
    /// The next step is not predicted to decrease the loss significantly.
    SmallDecrease,
    /// The loss is smallest on the border of stability: a root of C or F is on the unit circle.
    Border,
    /// The residuals are zero up to rounding.
    ExactFit,
    /// The largest number of iterations was reached.
    IterationLimit,
    /// No step decreases the loss although the gradient is not zero. Often the loss decreases only beyond the border of
    /// stability.
    NoDescent,
    /// An instrumental variable iteration has converged.
    Settled,
    /// An instrumental variable iteration did not converge, but its steps are less than half a standard error. The
    /// parameters solve its equation with instruments that were kept fixed.
    InstrumentsHeld,
    /// An instrumental variable iteration ended with a pole outside the unit circle, which was reflected inside.
    UnstableEstimate,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Direct => "solved directly (linear least squares)",
            Self::SmallDecrease => "converged: the next step would not decrease the loss",
            Self::Border => {
                "converged at the border of stability: a root of C or F lies on the unit circle, so standard errors \
                 are unreliable"
            }
            Self::ExactFit => "converged: the residuals are zero up to rounding",
            Self::IterationLimit => "not converged: iteration limit reached",
            Self::NoDescent => "not converged: no step with stable C and F lowers the loss",
            Self::Settled => "converged: a further iteration does not change the parameters",
            Self::InstrumentsHeld => {
                "converged with the instruments kept constant: new instruments still change the parameters, by less \
                 than half a standard error"
            }
            Self::UnstableEstimate => {
                "not converged: a pole of the estimate was outside the unit circle and was reflected inside"
            }
        })
    }
}

/// Reason for the end of a search, and its number of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Termination {
    /// Reason for the end of the search.
    pub reason: Reason,
    /// Number of steps that led to the result.
    pub iterations: usize,
}

impl Termination {
    /// True if a minimum or a solution was reached.
    pub fn converged(&self) -> bool {
        matches!(
            self.reason,
            Reason::Direct
                | Reason::SmallDecrease
                | Reason::Border
                | Reason::ExactFit
                | Reason::Settled
                | Reason::InstrumentsHeld
        )
    }
}

impl fmt::Display for Termination {
    /// Formats the reason and, unless the problem was solved directly, the number of steps.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.reason, self.iterations) {
            (Reason::Direct, _) => write!(f, "{}", self.reason),
            (_, 1) => write!(f, "{}; 1 iteration", self.reason),
            (_, n) => write!(f, "{}; {n} iterations", self.reason),
        }
    }
}
