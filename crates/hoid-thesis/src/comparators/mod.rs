//! The other methods of the survey as comparators: methods described in Part II of the thesis (section 2.4) that need
//! more than the past samples, such as the lines, later samples or a second run. The recursive methods are in
//! `hoid_survey`.
//!
//! A comparator processes a record and returns the operator's response at some frequencies at requested times, and the
//! operator's parameters if it estimates them. Each comparator is small, follows the source that it names, and was
//! tuned on separate runs (described in `research/notes/survey-methods.md`). The comparators are used by the plan of a
//! [survey](crate::survey), not by `track --method`, because they are included only for comparison.
//!
//! | module | method |
//! |---|---|
//! | `comparator` | [`Comparator`]: the interface common to all methods |
//! | `rls_fir` | finite impulse response by regularised recursive least squares, converted to a frequency response |
//! | `fourier` | Fourier coefficients at the lines, in a moving window |
//! | `wavelet` | wavelet transforms at the lines |
//! | `genetic_sigmoid` | maximum likelihood of a sigmoid by a genetic search |
//! | `lpv_subspace` | predictor-based subspace identification of an LPV model |
//! | `rpem_by_vaf` | RPEM whose covariance is updated by the VAF of a validation set (a proposal in section VII) |
//! | `unit_responses` | the operator's responses to the error and the error rate with unit gain |
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

pub(crate) use comparator::delayed_response;
pub use comparator::{Comparator, ComparatorDescription, Task, TrackingResult};
pub use fourier::FourierCoefficients;
pub use genetic_sigmoid::GeneticSigmoid;
pub use lpv_subspace::LpvSubspace;
pub use rls_fir::RlsFir;
pub use rpem_by_vaf::RpemByVaf;
pub use wavelet::WaveletRatio;

/// All comparators with their default options.
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

/// Message that explains why a comparator, given by its name or the first word of the name, does not track a recording,
/// and which command runs it; `None` if no comparator has this name.
pub fn untracked_comparator_message(name: &str) -> Option<String> {
    let typed = name.trim().to_ascii_lowercase();
    let (_, about) = names_and_descriptions().find(|(word, _)| *word == typed)?;
    let ComparatorDescription {
        name,
        help,
        source,
        extra_information,
    } = about;
    let (what, why) = match extra_information {
        // The only comparator that needs no further information is a recursion with more coefficients than a tracked
        // model may have.
        "" => (
            "does not track recordings",
            "it has more coefficients than the 64 of a tracked model; for up to 64, use --method rls --structure fir"
                .to_owned(),
        ),
        extra_information => (
            "is not a recursion over a recording",
            format!("it needs {extra_information}"),
        ),
    };
    Some(format!(
        "{name} {what} ({help}; {source}): {why}. It is available only for simulated runs: cargo run --release -p \
         hoid-evidence --example survey_methods. For recordings, use a method listed by hoid track --methods, or hoid \
         describe for the response at the lines of an excitation"
    ))
}

/// The names that [`untracked_comparator_message`] accepts: the name of each comparator and its first word, such as
/// `lpv`, unless that word names a recursive method.
pub fn names_and_descriptions() -> impl Iterator<Item = (&'static str, ComparatorDescription)> {
    let all = comparators().into_iter().map(|one| one.description());
    all.flat_map(|about| {
        let first = about.name.split('-').next().unwrap_or(about.name);
        let is_short = first != about.name && !["rpem", "rls"].contains(&first);
        let short = is_short.then_some((first, about));
        [Some((about.name, about)), short].into_iter().flatten()
    })
}

#[cfg(test)]
mod tests;
