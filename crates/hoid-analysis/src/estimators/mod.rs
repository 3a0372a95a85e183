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
    /// Kind of system whose records it judges: for a person, who responds to an error within a second, a missing
    /// response is reported.
    const OF: Of = Of::Person;

    /// Its entries in the registry: one, or one for each of its methods.
    fn specs() -> Vec<MethodSpec>;

    /// Its options and those of the analysis that apply to it, in the order in which they are set and printed.
    fn options_of_analysis() -> Vec<AnalysisOption<Self>>;

    /// True if orders and delay count samples, so that a high rate is kept.
    fn counts_samples(&self) -> bool {
        false
    }

    /// Names of its inputs besides the error.
    fn further_inputs(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Method and limits of its search.
    fn search(&self) -> &SearchOptions;

    /// Returns the name of its treatment of initial states.
    fn initial_state(&self) -> &'static str;

    /// Returns the same estimator with its defaults.
    fn by_default(&self) -> Self;

    /// Its name among the printed settings.
    fn structure(&self) -> Setting {
        Setting::new("structure", OPERATOR)
    }

    /// A printed setting that is not set by an option.
    fn beside_options(&self) -> Option<Setting> {
        None
    }

    /// Fits recordings that have been repaired and decimated; removes their means or level if the fit is made without
    /// them.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no fit.
    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<Fitted<Self::Fit>, AnalysisError>;

    /// Stores the final verdict, for a fit that contains one.
    fn judged(_fit: &mut Self::Fit, _verdict: &Verdict) {}
}

/// A fit, before the findings of the recordings.
#[derive(Debug, Clone)]
pub struct Fitted<F> {
    /// The fit.
    pub fit: F,
    /// Its own verdict, with that of a second opinion.
    pub verdict: Verdict,
    /// The describing function that accompanies it.
    pub described: Option<Description>,
    /// Trend that was removed from e and u.
    pub taken_out: Detrend,
    /// The settings of the estimator that were used.
    pub used: Vec<Setting>,
    /// Values that were found for open settings.
    pub found: Vec<Setting>,
}

impl<E: BatchEstimator> Identification<E> {
    /// Sets an option of the registry by its name; false for an option of another estimator.
    ///
    /// # Errors
    /// [`AnalysisError`] for a text that is not a valid value, or a value out of its bounds.
    pub fn set(&mut self, name: &str, text: &str) -> Result<bool, AnalysisError> {
        let option = E::options_of_analysis()
            .into_iter()
            .find(|option| option.setting.name == name);
        option.map_or(Ok(false), |option| option.set(self, text).map(|()| true))
    }

    /// Returns the printed settings of the estimator at a sample time.
    pub(crate) fn settings(&self, sample_time: SampleTime) -> Vec<Setting> {
        let options = E::options_of_analysis();
        let own = options.iter().filter_map(|option| option.words(self, sample_time));
        let own = own.map(|(name, words)| Setting::new(name, words));
        let structure = [self.estimator.structure()].into_iter();
        structure.chain(own).chain(self.estimator.beside_options()).collect()
    }
}

/// Returns the settings of options.
fn known<E: 'static>(options: Vec<AnalysisOption<E>>) -> Vec<hoid_ident::settings::Setting> {
    options.into_iter().map(|option| option.setting).collect()
}
