//! The survey's other methods as comparators: those that Part II of the reference text describes
//! (section 2.4) and that are no recursive method of `hoid_track`.
//!
//! A comparator follows a record and says, at times that are asked for, what the operator's
//! response is at some frequencies, and its parameters where it has them. Each is small, after the
//! source that it names, tuned on runs of its own (the page "The survey's methods" of the book says
//! how), and reached by the plan of a [survey](crate::survey), not by `track --method`: these are
//! here to be compared with.
//!
//! | module | method |
//! |---|---|
//! | `comparator` | [`Comparator`]: what all of them do |
//! | `rls_fir` | finite impulse response by regularised recursive least squares, as a frequency response |
//! | `fourier` | Fourier coefficients at the lines, in a window that moves |
//! | `wavelet` | wavelet transforms at the lines |
//! | `genetic_sigmoid` | maximum likelihood of a sigmoid, from a genetic search |
//! | `lpv_subspace` | predictor-based subspace identification of an LPV model |
//! | `dual_ekf` | two extended Kalman filters that take turns |
//! | `linear_network` | a network of one linear layer that learns the equalization |
//! | `rpem_by_vaf` | RPEM, its covariance updated by the VAF of a validation set (a proposal of section VII) |
//! | `start` | what some of them start from: the Box-Jenkins fit of the first span |
//! | `unit_responses` | the operator's responses to error and error rate, of unit gain |
//! | `pade` | a delay as a rational function |
//! | `least_squares` | normal equations |

mod comparator;
mod dual_ekf;
mod fourier;
mod genetic_sigmoid;
mod least_squares;
mod linear_network;
mod lpv_subspace;
mod pade;
mod rls_fir;
mod rpem_by_vaf;
mod start;
mod unit_responses;
mod wavelet;

pub(crate) use comparator::response_of;
pub use comparator::{About, Comparator, Followed, Task};
pub use dual_ekf::DualEkf;
pub use fourier::FourierCoefficients;
pub use genetic_sigmoid::GeneticSigmoid;
pub use linear_network::LinearNetwork;
pub use lpv_subspace::LpvSubspace;
pub use rls_fir::RlsFir;
pub use rpem_by_vaf::RpemByVaf;
pub use wavelet::WaveletRatio;

/// All comparators with their defaults.
pub fn comparators() -> Vec<Box<dyn Comparator>> {
    vec![
        Box::new(RlsFir::default()),
        Box::new(FourierCoefficients::default()),
        Box::new(WaveletRatio::default()),
        Box::new(GeneticSigmoid::default()),
        Box::new(LpvSubspace::default()),
        Box::new(DualEkf::default()),
        Box::new(LinearNetwork::default()),
        Box::new(RpemByVaf::default()),
    ]
}

#[cfg(test)]
mod tests;
