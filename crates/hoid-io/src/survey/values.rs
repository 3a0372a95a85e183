//! Statistics of a column: missing values, range, course over time, quantisation and saturation.

use crate::data_quality::{Levels, saturation_limits};

/// Number of characters of a sketch.
const SKETCH_CHARS: usize = 32;
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Statistics of a column, in the unit of the column.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueSurvey {
    /// Number of values that are missing, text or not finite.
    pub missing: usize,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Root mean square deviation from the mean.
    pub deviation: f64,
    /// True if all values are equal.
    pub constant: bool,
    /// Step of a quantised column; `None` if the column is not quantised.
    pub quantum: Option<f64>,
    /// Number of rows in which a saturated column has its smallest value.
    pub saturated_low: usize,
    /// Number of rows in which a saturated column has its largest value.
    pub saturated_high: usize,
    /// Course of the values over time, in block characters.
    pub sketch: String,
}

/// Returns the statistics of a column; `None` if no value is finite.
pub(super) fn survey_values(all: &[f64]) -> Option<ValueSurvey> {
    let finite: Vec<f64> = all.iter().copied().filter(|value| value.is_finite()).collect();
    let (min, max) = finite.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), v| {
        (min.min(*v), max.max(*v))
    });
    if finite.is_empty() {
        return None;
    }
    let n = finite.len() as f64;
    // The values are divided by their number before summation to avoid overflow.
    let mean = if min == max {
        min
    } else {
        finite.iter().map(|v| v / n).sum::<f64>()
    };
    let deviation = (finite.iter().map(|v| (v - mean).powi(2) / n).sum::<f64>()).sqrt();
    let constant = min == max;
    let levels = Levels::of(all);
    let found = saturation_limits(all, &levels);
    let at_rail = |upper: bool| {
        let rail = found.iter().find(|rail| rail.is_upper == upper);
        rail.map_or(0, |rail| rail.row_count())
    };
    let (low, high) = (at_rail(false), at_rail(true));
    Some(ValueSurvey {
        missing: all.len().saturating_sub(finite.len()),
        min,
        max,
        mean,
        deviation,
        constant,
        quantum: levels.quantum().map(|(step, _)| step),
        saturated_low: low,
        saturated_high: high,
        sketch: block_plot(all, min, max),
    })
}

/// Draws the mean of each of several equally long parts as a bar; a part without finite values is blank.
#[expect(
    clippy::indexing_slicing,
    clippy::arithmetic_side_effects,
    reason = "the number of a part is at most 32, and its ends are at most the number of values"
)]
fn block_plot(all: &[f64], min: f64, max: f64) -> String {
    let parts = SKETCH_CHARS.min(all.len());
    let bar = |part: usize| {
        let values = &all[part * all.len() / parts..(part + 1) * all.len() / parts];
        let (sum, count) = values
            .iter()
            .filter(|value| value.is_finite())
            .fold((0.0, 0_usize), |(sum, count), value| {
                (sum + (value / max.abs().max(min.abs()).max(1e-300)), count + 1)
            });
        if count == 0 {
            return ' ';
        }
        let scale = max.abs().max(min.abs()).max(1e-300);
        let (low, high) = (min / scale, max / scale);
        let height = if high > low {
            (sum / count as f64 - low) / (high - low)
        } else {
            0.5
        };
        BARS[((height * BARS.len() as f64) as usize).min(BARS.len() - 1)]
    };
    (0..parts).map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_column_faults_are_reported() {
        let sine: Vec<f64> = (0..400).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let found = survey_values(&sine).unwrap();
        assert_eq!(
            (found.constant, found.quantum, found.saturated_low, found.saturated_high),
            (false, None, 0, 0)
        );
        assert_eq!(found.sketch.chars().count(), SKETCH_CHARS);
        assert!(found.sketch.contains('█') && found.sketch.contains('▁'));
        let coarse: Vec<f64> = sine.iter().map(|v| (20.0 * v).round() / 20.0).collect();
        assert!((survey_values(&coarse).unwrap().quantum.unwrap() - 0.05).abs() < 1e-12);
        let clipped: Vec<f64> = sine.iter().map(|v| v.min(0.8)).collect();
        let found = survey_values(&clipped).unwrap();
        assert_eq!(found.saturated_low, 0);
        assert_eq!(found.saturated_high, clipped.iter().filter(|v| **v == 0.8).count());
        let constant = survey_values(&[2.0; 10]).unwrap();
        assert!(constant.constant && constant.deviation == 0.0);
        let missing = survey_values(&[1.0, f64::NAN, 3.0, f64::INFINITY]).unwrap();
        assert_eq!(
            (missing.missing, missing.mean, missing.sketch.as_str()),
            (2, 2.0, "▁ █ ")
        );
        assert_eq!(survey_values(&[f64::NAN]), None);
        assert!(survey_values(&[f64::MAX, f64::MIN]).is_some_and(|found| found.mean == 0.0));
    }
}
