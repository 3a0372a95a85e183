//! Batch estimators for recordings: each fits a model, removes the trend of the data if necessary, and assesses its
//! fit.
//!
//! | file | estimator |
//! |---|---|
//! | `operator` | operator of a person, whose form the evidence determines |
//! | `remnant` | operator with a gain and a lead, and a remnant of order m |
//! | `sigmoid` | operator whose gains change once |
//! | `polynomials`, `polynomial_options` | polynomial structure with given or searched orders, fitted by the prediction-error method or by instrumental variables |

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
    quality::SystemKind, recordings::Recordings, settings::Setting,
};

/// A batch estimator that [`Identification`] can run.
pub trait BatchEstimator: Sized + 'static {
    /// Type of the fit.
    type Fit: Answers;
    /// Kind of system whose records are assessed. For a person, who responds to an error within a second, a missing
    /// response is reported.
    const OF: SystemKind = SystemKind::Person;

    /// Returns the entries of the estimator in the registry: one entry, or one per method.
    fn specs() -> Vec<MethodSpec>;

    /// Returns the options of the estimator and the applicable options of the analysis, in the order in which they are
    /// set and printed.
    fn options_of_analysis() -> Vec<AnalysisOption<Self>>;

    /// True if orders and delay are numbers of samples; a high sampling rate is then kept.
    fn counts_samples(&self) -> bool {
        false
    }

    /// Returns the names of the inputs other than the error.
    fn further_inputs(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Returns the method and the limits of the search.
    fn search(&self) -> &SearchOptions;

    /// Returns the name of the treatment of initial states.
    fn initial_state(&self) -> &'static str;

    /// Returns an estimator of the same kind with default options.
    fn with_defaults(&self) -> Self;

    /// Returns the name of the estimator as a printed setting.
    fn structure(&self) -> Setting {
        Setting::new("structure", OPERATOR)
    }

    /// Returns a setting that is printed although no option sets it, if there is one.
    fn fixed_setting(&self) -> Option<Setting> {
        None
    }

    /// Fits recordings that have been repaired and decimated. If the fit is made without means or level, they are
    /// removed from the recordings.
    ///
    /// # Errors
    /// [`AnalysisError`] if the fit fails.
    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<FittedModel<Self::Fit>, AnalysisError>;

    /// Stores the final verdict in a fit that contains a verdict.
    fn set_verdict(_fit: &mut Self::Fit, _verdict: &Verdict) {}
}

/// A fit before the findings on the recordings are added to its verdict.
#[derive(Debug, Clone)]
pub struct FittedModel<F> {
    /// The fit.
    pub fit: F,
    /// Verdict on the fit itself, including the findings of the second fit.
    pub verdict: Verdict,
    /// The describing function that accompanies the fit, if there is one.
    pub described: Option<Description>,
    /// Trend that was removed from e and u.
    pub removed_trend: Detrend,
    /// Settings of the estimator used in the fit.
    pub settings: Vec<Setting>,
    /// Values determined for settings that were left open.
    pub found: Vec<Setting>,
}

impl<E: BatchEstimator> Identification<E> {
    /// Sets an option by its name in the registry; returns false for an option of another estimator.
    ///
    /// # Errors
    /// [`AnalysisError`] if the text is not a valid value or the value is out of bounds.
    pub fn set(&mut self, name: &str, text: &str) -> Result<bool, AnalysisError> {
        let option = E::options_of_analysis()
            .into_iter()
            .find(|option| option.setting.name == name);
        option.map_or(Ok(false), |option| option.set(self, text).map(|()| true))
    }

    /// Returns the printed settings of the estimator at a sample time.
    pub(crate) fn settings(&self, sample_time: SampleTime) -> Vec<Setting> {
        let options = E::options_of_analysis();
        let own = options
            .iter()
            .filter_map(|option| option.formatted_value(self, sample_time));
        let own = own.map(|(name, words)| Setting::new(name, words));
        let structure = [self.estimator.structure()].into_iter();
        structure.chain(own).chain(self.estimator.fixed_setting()).collect()
    }
}

/// Returns the registry entry of each option.
fn registry_settings<E: 'static>(options: Vec<AnalysisOption<E>>) -> Vec<hoid_ident::settings::Setting> {
    options.into_iter().map(|option| option.setting).collect()
}
