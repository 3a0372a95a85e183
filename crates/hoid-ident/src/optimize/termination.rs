//! Termination of a search.

use std::fmt;

/// Reason for the end of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// A linear problem, solved directly.
    Direct,
    /// The next step predicts no relevant decrease.
    SmallDecrease,
    /// The loss is smallest on the border of stability: a root of C or F is on the unit circle.
    Border,
    /// The residuals are zero up to rounding.
    ExactFit,
    /// The limit of iterations was reached.
    IterationLimit,
    /// No step decreases the loss although the gradient is not zero; often the loss decreases only across the border of
    /// stability.
    NoDescent,
    /// An iteration of instrumental variables has converged.
    Settled,
    /// An iteration of instrumental variables did not converge, and moves the parameters by less than half a standard
    /// error: they solve its equation for instruments that were then fixed.
    InstrumentsHeld,
    /// Instrumental variables ended with a pole outside the unit circle, which was then reflected into it.
    UnstableEstimate,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Direct => "solved directly (linear least squares)",
            Self::SmallDecrease => "converged: the next step promises no decrease of the loss",
            Self::Border => {
                "converged at the border of stability: a root of C or F lies on the unit circle, so that standard errors are unreliable"
            }
            Self::ExactFit => "converged: the residuals are zero up to rounding",
            Self::IterationLimit => "not converged: iteration limit reached",
            Self::NoDescent => "not converged: no step inside the region of stable C and F lowers the loss",
            Self::Settled => "converged: a further iteration does not change the parameters",
            Self::InstrumentsHeld => {
                "converged with the instruments held: new instruments still change the parameters, by less than half a standard error"
            }
            Self::UnstableEstimate => {
                "not converged: the estimate had a pole outside the unit circle, reflected into it"
            }
        })
    }
}

/// Reason and number of steps of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Termination {
    /// The reason.
    pub reason: Reason,
    /// Steps taken from the best start.
    pub iterations: usize,
}

impl Termination {
    /// True if a minimum was reached.
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
    /// Formats the reason, and the number of steps if there was a search.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.reason, self.iterations) {
            (Reason::Direct, _) => write!(f, "{}", self.reason),
            (_, 1) => write!(f, "{}; 1 iteration", self.reason),
            (_, n) => write!(f, "{}; {n} iterations", self.reason),
        }
    }
}
