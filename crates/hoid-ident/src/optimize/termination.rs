//! How a search ended.

use std::fmt;

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// A linear problem, solved directly.
    Direct,
    /// The next step promises no decrease that matters.
    SmallDecrease,
    /// The loss is smallest on the border of stability: a root of C or F lies on the unit circle.
    Border,
    /// The residuals are zero up to rounding.
    ExactFit,
    /// The limit of iterations was reached first.
    IterationLimit,
    /// No step lowers the loss although the gradient is not zero; often the loss falls only across
    /// the border of stability.
    NoDescent,
    /// An iteration of instrumental variables that moves the parameters no more.
    Settled,
    /// An iteration of instrumental variables without an end, which moves the parameters by less
    /// than half a standard error: they solve its equation for instruments that were then held.
    InstrumentsHeld,
    /// Instrumental variables ended with a pole outside the unit circle, which was then reflected
    /// into it.
    UnstableEstimate,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Direct => "solved directly (linear least squares)",
            Self::SmallDecrease => "converged: the next step promises no decrease of the loss",
            Self::Border => {
                "converged at the border of stability: a root of C or F lies on the unit circle, and standard errors mean little"
            }
            Self::ExactFit => "converged: the residuals are zero up to rounding",
            Self::IterationLimit => "not converged: iteration limit reached",
            Self::NoDescent => "not converged: no step inside the region of stable C and F lowers the loss",
            Self::Settled => "converged: a further iteration does not move the parameters",
            Self::InstrumentsHeld => {
                "converged with the instruments held: made again they go on to move the parameters, by less than half a standard error"
            }
            Self::UnstableEstimate => {
                "not converged: the estimate had a pole outside the unit circle, reflected into it"
            }
        })
    }
}

/// How a search ended, and after how many steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Termination {
    /// Why it ended.
    pub reason: Reason,
    /// Steps taken from the start that won.
    pub iterations: usize,
}

impl Termination {
    /// True when a minimum was reached.
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
    /// The reason, and the number of steps where there was a search.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.reason, self.iterations) {
            (Reason::Direct, _) => write!(f, "{}", self.reason),
            (_, 1) => write!(f, "{}; 1 iteration", self.reason),
            (_, n) => write!(f, "{}; {n} iterations", self.reason),
        }
    }
}
