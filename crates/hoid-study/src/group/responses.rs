//! Frequency responses of the fits to whole runs on one frequency grid, and their medians over the runs.
//!
//! The grid is `omega = 10^(k/32)` rad/s from 0.1 to 40 rad/s, up to half the sampling frequency. With 32 points per
//! decade, linear interpolation of the phase of a 0.5 s delay is within 0.01 rad at 10 rad/s. A response is from e to u
//! with the alignment of the manifest, `H e^{j omega Ts offset}`, as for the describing function. Phases are unwrapped
//! from the lowest frequency.

use std::collections::BTreeMap;

use hoid_ident::frequency::Crossover;
use hoid_io::{OutputTable, TableSchema};
use hoid_model::{Complex64, ContinuousTransferFunction};

use super::tables::{numbers, real_columns, schema, text_columns, texts};
use crate::{columns::Rows, statistics::Statistics};

/// Subject, condition, estimator.
pub(super) type Key = [String; 3];

const KEY_COLUMNS: [&str; 3] = ["subject", "condition", "estimator"];

/// Returns the grid frequencies below half the sampling frequency, rad/s.
pub(super) fn grid_frequencies(sample_time_s: f64) -> Vec<f64> {
    (-32..=51)
        .map(|k| 10f64.powf(f64::from(k) / 32.0))
        .filter(|omega| omega * sample_time_s < std::f64::consts::PI)
        .collect()
}

/// Returns the columns of the table of responses of single runs.
pub(super) fn responses_schema() -> TableSchema {
    schema(
        text_columns(&["subject", "condition", "run", "estimator"]).chain(real_columns(&[
            "omega_rad_s",
            "magnitude_db",
            "phase_deg",
        ])),
    )
}

/// Returns the phases in deg, each on the branch nearest to the phase at the previous frequency.
pub(super) fn unwrapped_phases_deg(response: &[Complex64]) -> Vec<f64> {
    let mut turn = 0.0;
    let mut last: Option<Complex64> = None;
    response
        .iter()
        .map(|h| {
            turn += last.map_or(h.arg(), |before| (h / before).arg());
            last = Some(*h);
            turn.to_degrees()
        })
        .collect()
}

/// Responses of all runs, by subject, condition and estimator.
#[derive(Debug, Clone, Default)]
pub(super) struct ResponseAverages(BTreeMap<Key, BTreeMap<u64, [Vec<f64>; 2]>>);

/// Median response of an estimator over the runs of a subject and condition.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct MedianResponse {
    pub omega_rad_s: Vec<f64>,
    pub magnitude_db: Vec<f64>,
    pub phase_deg: Vec<f64>,
}

impl MedianResponse {
    /// Interpolates the gain in dB and the phase linearly over log omega; `None` outside the grid.
    pub fn at(&self, omega_rad_s: f64) -> Option<Complex64> {
        let [decibel, degrees] = self.decibel_and_degrees(omega_rad_s)?;
        Some(Complex64::from_polar(10f64.powf(decibel / 20.0), degrees.to_radians()))
    }

    /// Returns the interpolated gain in dB and the interpolated phase in deg; `None` outside the grid.
    pub fn decibel_and_degrees(&self, omega_rad_s: f64) -> Option<[f64; 2]> {
        let k = self.omega_rad_s.partition_point(|omega| *omega <= omega_rad_s);
        let (low, high) = (k.checked_sub(1)?, k);
        let (from, to) = (*self.omega_rad_s.get(low)?, *self.omega_rad_s.get(high)?);
        let part = (omega_rad_s / from).ln() / (to / from).ln();
        let between = |values: &[f64]| values[low] + part * (values[high] - values[low]);
        Some([between(&self.magnitude_db), between(&self.phase_deg)])
    }
}

impl MedianResponse {
    /// Returns the lowest crossover with a controlled element.
    pub fn crossover(&self, element: &ContinuousTransferFunction) -> Option<Crossover> {
        let open_loop: Vec<Complex64> = self
            .omega_rad_s
            .iter()
            .filter_map(|omega| self.at(*omega).map(|h| h * element.response(*omega)))
            .collect();
        Crossover::of(&self.omega_rad_s[..open_loop.len()], &open_loop, 0.0)
    }
}

impl ResponseAverages {
    /// Adds the responses of a run.
    pub fn add(&mut self, responses: &OutputTable) {
        let keys = KEY_COLUMNS.map(|name| texts(responses, name));
        let [omega, magnitude, phase] =
            ["omega_rad_s", "magnitude_db", "phase_deg"].map(|name| numbers(responses, name));
        for row in 0..omega.len() {
            if magnitude[row].is_finite() && phase[row].is_finite() {
                let of_key = self.0.entry(keys.map(|column| column[row].clone())).or_default();
                let [magnitudes, phases] = of_key.entry(omega[row].to_bits()).or_default();
                magnitudes.push(magnitude[row]);
                phases.push(phase[row]);
            }
        }
    }

    /// Returns the estimators of a subject and condition with their median responses.
    pub fn medians(&self, subject: &str, condition: &str) -> Vec<(&str, MedianResponse)> {
        let of_cell = self
            .0
            .iter()
            .filter(|(key, _)| key[0] == subject && key[1] == condition);
        of_cell
            .map(|(key, at)| {
                let median = |which: usize| at.values().map(|both| Statistics::of(&both[which]).median).collect();
                let response = MedianResponse {
                    omega_rad_s: at.keys().map(|bits| f64::from_bits(*bits)).collect(),
                    magnitude_db: median(0),
                    phase_deg: median(1),
                };
                (key[2].as_str(), response)
            })
            .collect()
    }

    /// Returns the table of the medians and quartiles over the runs at each frequency.
    pub fn table(&self) -> OutputTable {
        const STATISTIC_COLUMNS: [&str; 3] = ["lower_quartile", "median", "upper_quartile"];
        let columns: Vec<String> = ["magnitude_db", "phase_deg"]
            .iter()
            .flat_map(|name| STATISTIC_COLUMNS.map(|figure| format!("{name}_{figure}")))
            .collect();
        let mut rows = Rows::new(&schema(
            text_columns(&KEY_COLUMNS)
                .chain(real_columns(&["runs", "omega_rad_s"]))
                .chain(real_columns(&columns)),
        ));
        for (key, at) in &self.0 {
            for (bits, both) in at {
                rows.start_row();
                for (name, text) in KEY_COLUMNS.iter().zip(key) {
                    rows.set_text(name, text);
                }
                rows.set_real("runs", both[0].len() as f64);
                rows.set_real("omega_rad_s", f64::from_bits(*bits));
                let figures = both.each_ref().map(|values| {
                    let s = Statistics::of(values);
                    [s.lower_quartile, s.median, s.upper_quartile]
                });
                for (name, value) in columns.iter().zip(figures.iter().flatten()) {
                    rows.set_real(name, *value);
                }
            }
        }
        rows.into_table(Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_unwrapped_and_medians_interpolated() {
        // A delay of half a second has a phase of 20 rad at 40 rad/s.
        let omega = grid_frequencies(0.01);
        assert_eq!((omega.len(), grid_frequencies(0.1).len()), (84, 80));
        let response: Vec<Complex64> = omega.iter().map(|w| Complex64::from_polar(2.0, -0.5 * w)).collect();
        let phase = unwrapped_phases_deg(&response);
        for (w, p) in omega.iter().zip(&phase) {
            assert!((p + (0.5 * w).to_degrees()).abs() < 1e-9, "{w}: {p}");
        }
        let median = MedianResponse {
            magnitude_db: vec![20.0 * 2f64.log10(); omega.len()],
            phase_deg: phase,
            omega_rad_s: omega,
        };
        let found = median.at(9.7).unwrap();
        assert!((found - Complex64::from_polar(2.0, -0.5 * 9.7)).norm() < 0.02);
        assert!(median.at(0.05).is_none() && median.at(45.0).is_none());
    }
}
