//! What is identified from recordings: an estimator, what is taken out of the data for it, and what its fit
//! alone says of itself.
//!
//! | file | the estimator |
//! |---|---|
//! | `operator` | the operator of a person, its form by evidence |
//! | `remnant` | an operator with a gain and a lead, and its remnant of order m |
//! | `sigmoid` | an operator whose gains change once |
//! | `polynomials` | a polynomial structure, its orders given or searched; prediction error or instruments |

mod operator;
mod polynomials;
mod remnant;
mod sigmoid;

use std::{collections::BTreeMap, ops::RangeInclusive};

use hoid_ident::{Constraint, SearchOptions, frequency::Description};
use hoid_model::{Detrend, SampleTime, Verdict};

pub use polynomials::{PolynomialFit, Polynomials};
pub(crate) use remnant::ORDERS as REMNANT_ORDERS;

use crate::{
    AnalysisError, answers::Answers, identification::Identification, quality::Of, recordings::Recordings,
    settings::Setting,
};

/// A batch estimator as [`Identification`] runs it.
pub trait BatchEstimator: Sized {
    /// Its result.
    type Fit: Answers;
    /// Whose records it judges: of a person, who answers an error within a second, one without a response is told.
    const OF: Of = Of::Person;

    /// Whether orders and delay are numbers of samples, so that a high rate is kept.
    fn counts_samples(&self) -> bool {
        false
    }

    /// Method and limits of its search.
    fn search(&self) -> &SearchOptions;

    /// What it says of initial states.
    fn initial_state(&self) -> &'static str;

    /// The same estimator with its defaults.
    fn by_default(&self) -> Self;

    /// Its own settings as they are printed, at a sample time.
    fn settings(&self, sample_time: SampleTime) -> Vec<Setting>;

    /// Fits recordings that have been repaired and are at their rate; takes out of them what it fits without.
    ///
    /// # Errors
    /// [`AnalysisError`] where there is no fit.
    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<Fitted<Self::Fit>, AnalysisError>;

    /// The verdict of all that is known, for a fit that carries it.
    fn judged(_fit: &mut Self::Fit, _verdict: &Verdict) {}
}

/// A fit, and what is known of it before the recordings are asked.
#[derive(Debug, Clone)]
pub struct Fitted<F> {
    /// The fit.
    pub fit: F,
    /// What it says of itself, and what a second opinion says.
    pub verdict: Verdict,
    /// The describing function that stands beside it.
    pub described: Option<Description>,
    /// What was taken out of e and u for it.
    pub taken_out: Detrend,
    /// The estimator as it was used.
    pub used: Vec<Setting>,
    /// What was found of what was left open.
    pub found: Vec<Setting>,
}

/// A range as users write it.
fn range(r: &RangeInclusive<usize>) -> String {
    if r.start() == r.end() {
        r.start().to_string()
    } else {
        format!("{}..{}", r.start(), r.end())
    }
}

/// A range of the delay.
fn delay((low, high): (f64, f64)) -> Setting {
    Setting::new("delay in s", format!("{low}..{high}"))
}

/// `name=value, name=value`.
fn named<'a>(values: impl IntoIterator<Item = (&'a String, f64)>) -> String {
    let all: Vec<String> = values
        .into_iter()
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    all.join(", ")
}

/// What was fixed and bounded.
fn constraints(all: &BTreeMap<String, Constraint>) -> Vec<Setting> {
    let end = |v: f64| if v.is_finite() { v.to_string() } else { String::new() };
    let fixed = |c: &Constraint| match c {
        Constraint::Fixed(value) => Some(*value),
        Constraint::Between(..) => None,
    };
    let held = named(all.iter().filter_map(|(name, c)| Some((name, fixed(c)?))));
    let bounds: Vec<String> = all
        .iter()
        .filter(|(_, c)| fixed(c).is_none())
        .map(|(name, c)| {
            let (low, high) = c.limits();
            format!("{name}={}..{}", end(low), end(high))
        })
        .collect();
    let rows = [("fixed", held), ("bounds", bounds.join(", "))];
    rows.into_iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(name, text)| Setting::new(name, text))
        .collect()
}
