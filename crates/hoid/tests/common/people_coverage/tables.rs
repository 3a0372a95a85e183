//! Shares over fits.

use super::fits::{Outcome, Quantity};

/// The quantities in the order of the tables.
pub const QUANTITIES: [&str; 13] = [
    "K",
    "K_over_T_I",
    "K_e",
    "K_e_dot",
    "T_L",
    "T_I",
    "omega_nm",
    "zeta_nm",
    "tau_e",
    "crossover",
    "crossover (1.96)",
    "phase margin",
    "phase margin (1.96)",
];

/// A share k of n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Proportion {
    pub of: usize,
    pub all: usize,
}

impl Proportion {
    /// Counts the share of true answers.
    pub fn count(answers: impl IntoIterator<Item = bool>) -> Self {
        answers.into_iter().fold(Self::default(), |share, yes| Self {
            of: share.of + usize::from(yes),
            all: share.all + 1,
        })
    }

    /// Returns the share in percent.
    pub fn percent(self) -> f64 {
        100.0 * self.of as f64 / self.all as f64
    }

    /// Returns the standard error in percent.
    pub fn standard_error_percent(self) -> f64 {
        let n = self.all as f64 + 4.0;
        let p = (self.of as f64 + 2.0) / n;
        100.0 * (p * (1.0 - p) / n).sqrt()
    }

    /// Formats the share for a table: share, standard error, number.
    pub fn text(self) -> String {
        if self.all == 0 {
            return "–".to_owned();
        }
        format!(
            "{:.1} ± {:.1} ({})",
            self.percent(),
            self.standard_error_percent(),
            self.all
        )
    }
}

/// Returns the median; `None` for no values.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = values.into_iter().filter(|x| !x.is_nan()).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// Returns all values of one quantity.
pub fn values_of_quantity<'a>(outcomes: &[&'a Outcome], name: &str) -> Vec<&'a Quantity> {
    outcomes
        .iter()
        .filter_map(|o| o.found.as_ref().ok())
        .filter_map(|f| f.quantities.iter().find(|q| q.name == name))
        .collect()
}

/// Returns the share of intervals that contain the true value, over quantities that are reported as determined.
pub fn coverage(quantities: &[&Quantity]) -> Proportion {
    let determined = quantities.iter().filter(|q| q.determined);
    Proportion::count(determined.map(|q| q.contains_truth().unwrap_or(false)))
}
