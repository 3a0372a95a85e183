//! The survey's other methods as comparators: those that Part II of the thesis describes (section 2.4) and that need
//! more than the samples so far: the lines, what comes after, a second run. The recursive ones are in `hoid_survey`.
//!
//! A comparator processes a record and returns, at requested times, the operator's response at some frequencies, and
//! its parameters if it has them. Each is small, follows the source that it names, was tuned on separate runs
//! (`research/notes/survey-methods.md` states how), and is used by the plan of a [survey](crate::survey), not by
//! `track --method`: these methods are included only for comparison.
//!
//! | module | method |
//! |---|---|
//! | `comparator` | [`Comparator`]: the interface common to all methods |
//! | `rls_fir` | finite impulse response by regularised recursive least squares, as a frequency response |
//! | `fourier` | Fourier coefficients at the lines, in a window that moves |
//! | `wavelet` | wavelet transforms at the lines |
//! | `genetic_sigmoid` | maximum likelihood of a sigmoid, from a genetic search |
//! | `lpv_subspace` | predictor-based subspace identification of an LPV model |
//! | `rpem_by_vaf` | RPEM, its covariance updated by the VAF of a validation set (a proposal of section VII) |
//! | `unit_responses` | the operator's responses to error and error rate, of unit gain |
//! | `least_squares` | normal equations |

mod comparator;
mod fourier;
mod genetic_sigmoid;
mod least_squares;
mod lpv_subspace;
mod rls_fir;
mod rpem_by_vaf;
mod unit_responses;
mod wavelet;

pub(crate) use comparator::response_of;
pub use comparator::{About, Comparator, Followed, Task};
pub use fourier::FourierCoefficients;
pub use genetic_sigmoid::GeneticSigmoid;
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
        Box::new(RpemByVaf::default()),
    ]
}

/// Reason why a comparator, given by its name or the first word of it, does not track a recording, and the command that
/// runs it; `None` for a name that no comparator has.
pub fn not_tracked(name: &str) -> Option<String> {
    let typed = name.trim().to_ascii_lowercase();
    let (_, about) = names().find(|(word, _)| *word == typed)?;
    let About {
        name,
        help,
        source,
        told,
    } = about;
    let (what, why) = match told {
        // A recursion, of more coefficients than a model has.
        "" => (
            "does not track recordings",
            "with more coefficients than the 64 of a tracked model; up to 64 are followed by --method rls --structure fir"
                .to_owned(),
        ),
        told => ("is not a recursion over a recording", format!("which needs {told}")),
    };
    Some(format!(
        "{name} {what}: {help} ({source}), {why}. It follows simulated runs only: cargo run --release -p hoid-evidence \
         --example survey_methods. For recordings there are the methods of hoid track --methods, and hoid describe for \
         the response at the lines of an excitation"
    ))
}

/// The names under which [`not_tracked`] knows the comparators: each with its first word, such as `lpv`, unless that is
/// a recursive method.
pub fn names() -> impl Iterator<Item = (&'static str, About)> {
    let all = comparators().into_iter().map(|one| one.about());
    all.flat_map(|about| {
        let first = about.name.split('-').next().unwrap_or(about.name);
        let is_short = first != about.name && !["rpem", "rls"].contains(&first);
        let short = is_short.then_some((first, about));
        [Some((about.name, about)), short].into_iter().flatten()
    })
}

#[cfg(test)]
mod tests;
