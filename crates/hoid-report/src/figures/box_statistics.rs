//! Statistics of a box plot.
//!
//! A box extends from the first to the third quartile, with a line at the median. The whiskers end at the most extreme
//! values within 1.5 interquartile ranges of the box; values beyond are drawn as points (Tukey, *Exploratory Data
//! Analysis*, 1977).

use hoid_numerics::statistics::{quantile, sorted_finite_values};

use super::style;

/// Maximum length of whiskers, in interquartile ranges.
const WHISKER_LENGTH: f64 = 1.5;

/// Box plot statistics of a sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BoxStatistics {
    /// Number of values; if it is zero, a cross is drawn instead of the box.
    pub count: usize,
    /// The smallest value within 1.5 interquartile ranges of the box.
    pub lower_whisker: f64,
    /// First quartile.
    pub lower_quartile: f64,
    /// Median, which is the second quartile.
    pub median: f64,
    /// Third quartile.
    pub upper_quartile: f64,
    /// The largest value within 1.5 interquartile ranges of the box.
    pub upper_whisker: f64,
    /// The values beyond the whiskers.
    pub outliers: Vec<f64>,
}

impl BoxStatistics {
    /// Computes the statistics of the finite values; quartiles are interpolated linearly between ranks.
    pub fn of(values: &[f64]) -> Self {
        let values = sorted_finite_values(values.iter().copied());
        let quartile = |q| quantile(&values, q).unwrap_or_default();
        let (lower, upper) = (quartile(0.25), quartile(0.75));
        let reach = WHISKER_LENGTH * (upper - lower);
        let within = |v: &f64| (lower - reach..=upper + reach).contains(v);
        let inside: Vec<f64> = values.iter().copied().filter(within).collect();
        Self {
            count: values.len(),
            // An interpolated quartile may lie beyond the most extreme value within the limit.
            lower_whisker: inside.first().copied().unwrap_or_default().min(lower),
            lower_quartile: lower,
            median: quartile(0.5),
            upper_quartile: upper,
            upper_whisker: inside.last().copied().unwrap_or_default().max(upper),
            outliers: values.into_iter().filter(|v| !within(v)).collect(),
        }
    }

    /// Lower whisker, quartiles, upper whisker.
    pub(super) fn marks(&self) -> [f64; 5] {
        [
            self.lower_whisker,
            self.lower_quartile,
            self.median,
            self.upper_quartile,
            self.upper_whisker,
        ]
    }

    /// True if there is a box to draw.
    pub(super) fn is_drawable(&self) -> bool {
        self.count > 0 && self.marks().iter().all(|v| style::is_drawable(*v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_follow_tukey() {
        let mut values: Vec<f64> = (1..=11).map(f64::from).collect();
        values.extend([100.0, -50.0, f64::NAN]);
        let found = BoxStatistics::of(&values);
        // The quartiles of 13 values, at ranks 4, 7 and 10, are 3, 6 and 9; whiskers extend by at most 9 to either
        // side.
        assert_eq!(found.marks(), [1.0, 3.0, 6.0, 9.0, 11.0]);
        assert_eq!((found.count, found.outliers), (13, vec![-50.0, 100.0]));
        assert_eq!(BoxStatistics::of(&[2.0]).marks(), [2.0; 5]);
        assert_eq!(BoxStatistics::of(&[f64::NAN]), BoxStatistics::default());
    }
}
