//! Estimators for recordings: the estimator, the trend that is removed from the data for it, and the verdict on its
//! fit.
//!
//! | file | the estimator |
//! |---|---|
//! | `operator` | the operator of a person, its form by evidence |
//! | `remnant` | an operator with a gain and a lead, and its remnant of order m |
//! | `sigmoid` | an operator whose gains change once |
//! | `polynomials`, `polynomial_options` | a polynomial structure, its orders given or searched; prediction error or instruments |

mod operator;
mod polynomial_options;
mod polynomials;
mod remnant;
mod sigmoid;

use hoid_ident::{SearchOptions, frequency::Description, settings::MethodSpec};
use hoid_model::{Detrend, SampleTime, Verdict};

pub use polynomial_options::Polynomials;
pub use polynomials::PolynomialFit;

use crate::{
    AnalysisError, answers::Answers, identification::Identification, names::OPERATOR, options::AnalysisOption,
    quality::Of, recordings::Recordings, settings::Setting,
};

/// A batch estimator as [`Identification`] runs it.
pub trait BatchEstimator: Sized + 'static {
    /// Its result.
    type Fit: Answers;
    /// Whose records it judges: of a person, who answers an error within a second, one without a response is reported.
    const OF: Of = Of::Person;

    /// Entries of the registry: one entry, or one for each of its methods.
    fn specs() -> Vec<MethodSpec>;

    /// Its options and those of the analysis around it that it has use for, in the order in which they are set
    /// and printed.
    fn options_of_analysis() -> Vec<AnalysisOption<Self>>;

    /// Whether orders and delay are numbers of samples, so that a high rate is kept.
    fn counts_samples(&self) -> bool {
        false
    }

    /// Method and limits of its search.
    fn search(&self) -> &SearchOptions;

    /// The report about initial states.
    fn initial_state(&self) -> &'static str;

    /// The same estimator with its defaults.
    fn by_default(&self) -> Self;

    /// Its name among the printed settings.
    fn structure(&self) -> Setting {
        Setting::new("structure", OPERATOR)
    }

    /// A printed setting that no option of its own sets.
    fn beside_options(&self) -> Option<Setting> {
        None
    }

    /// Fits recordings that have been repaired and are at their rate; takes out of them what it fits without.
    ///
    /// # Errors
    /// [`AnalysisError`] where there is no fit.
    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<Fitted<Self::Fit>, AnalysisError>;

    /// The verdict of all that is known, for a fit that carries it.
    fn judged(_fit: &mut Self::Fit, _verdict: &Verdict) {}
}

/// A fit, and the prior knowledge of it before the recordings are asked.
#[derive(Debug, Clone)]
pub struct Fitted<F> {
    /// The fit.
    pub fit: F,
    /// Its self-description, and what a second opinion reports.
    pub verdict: Verdict,
    /// The describing function that is next to it.
    pub described: Option<Description>,
    /// Trend removed from e and u for it.
    pub taken_out: Detrend,
    /// The settings of the estimator as it was used.
    pub used: Vec<Setting>,
    /// Findings about what was left open.
    pub found: Vec<Setting>,
}

impl<E: BatchEstimator> Identification<E> {
    /// Sets an option of the registry by its name; false for one of another estimator.
    ///
    /// # Errors
    /// [`AnalysisError`] for a text that is not a value of it, or out of its bounds.
    pub fn set(&mut self, name: &str, text: &str) -> Result<bool, AnalysisError> {
        let option = E::options_of_analysis()
            .into_iter()
            .find(|option| option.setting.name == name);
        option.map_or(Ok(false), |option| option.set(self, text).map(|()| true))
    }

    /// The settings of the estimator as they are printed, at a sample time.
    pub(crate) fn settings(&self, sample_time: SampleTime) -> Vec<Setting> {
        let options = E::options_of_analysis();
        let own = options.iter().filter_map(|option| option.words(self, sample_time));
        let own = own.map(|(name, words)| Setting::new(name, words));
        let structure = [self.estimator.structure()].into_iter();
        structure.chain(own).chain(self.estimator.beside_options()).collect()
    }
}

/// The settings of options.
fn known<E: 'static>(options: Vec<AnalysisOption<E>>) -> Vec<hoid_ident::settings::Setting> {
    options.into_iter().map(|option| option.setting).collect()
}
