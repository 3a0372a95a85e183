//! Fourier coefficients of the signals of a loop, and the selection of its exogenous channels.

use std::f64::consts::PI;

use hoid_model::{Complex64, Record};

use crate::{
    diagnostics::other_inputs::TARGET_CHANNELS,
    frequency::{COMMON_EXCITATIONS, spectrum::coefficients},
};

/// Names of channels that hold a disturbance at u.
const DISTURBANCE_CHANNELS: [&str; 3] = ["d", "f_d", "disturbance"];
/// Range of the tested frequencies, rad/s: the frequencies at which people move u.
const BAND_RAD_S: (f64, f64) = (0.3, 12.0);
/// Number of frequencies that is sufficient; further samples of a record and further records are not used.
pub(super) const MAX_FREQUENCIES: usize = 1000;

/// Names of the exogenous channels of the loop.
pub(super) struct ExogenousChannels {
    targets: Vec<String>,
    disturbances: Vec<String>,
}

impl ExogenousChannels {
    /// Selects the channels of all records that have the name of a target or a disturbance and vary in at least one
    /// record. An excitation with another name counts as both.
    pub(super) fn of(records: &[Record], excitation: Option<&str>) -> Self {
        let moves = |name: &&str| {
            let varies = |record: &Record| {
                let values = record.other_channel(name)?;
                Some(values.iter().any(|value| *value != values[0]))
            };
            records.iter().all(|r| varies(r).is_some()) && records.iter().any(|r| varies(r) == Some(true))
        };
        let either = COMMON_EXCITATIONS.into_iter().chain(excitation);
        let of = |known: &[&str], others: &[&str]| -> Vec<String> {
            let is_other = |name: &&str| !known.contains(name) && !others.contains(name);
            let mut names: Vec<&str> = known.iter().copied().chain(either.clone().filter(is_other)).collect();
            names.dedup();
            names.into_iter().filter(moves).map(str::to_owned).collect()
        };
        Self {
            targets: of(&TARGET_CHANNELS, &DISTURBANCE_CHANNELS),
            disturbances: of(&DISTURBANCE_CHANNELS, &TARGET_CHANNELS),
        }
    }

    /// True if neither a target nor a disturbance was recorded.
    pub(super) fn is_empty(&self) -> bool {
        self.targets.is_empty() && self.disturbances.is_empty()
    }
}

/// Fourier coefficients of one record in the band.
pub(super) struct Spectra {
    pub(super) omega: Vec<f64>,
    pub(super) e: Vec<Complex64>,
    pub(super) u: Vec<Complex64>,
    pub(super) targets: Vec<Vec<Complex64>>,
    pub(super) disturbances: Vec<Vec<Complex64>>,
    /// Frequency response of the hold of u.
    pub(super) hold: Vec<Complex64>,
}

impl Spectra {
    pub(super) fn of(record: &Record, exogenous: &ExogenousChannels) -> Option<Self> {
        let ts = record.sample_time().s();
        let most = (2.0 * PI * MAX_FREQUENCIES as f64 / (BAND_RAD_S.1 * ts)) as usize;
        let samples = record.len().min(most);
        let step = 2.0 * PI / (samples as f64 * ts);
        let highest = BAND_RAD_S.1.min(0.4 * PI / ts);
        let first = ((BAND_RAD_S.0 / step).ceil() as usize).max(2);
        let bins = first..=(highest / step).floor() as usize;
        let of = |values: &[f64]| -> Option<Vec<Complex64>> {
            let all = values[..samples]
                .iter()
                .all(|v| v.is_finite())
                .then(|| coefficients(&values[..samples]))?;
            all.get(bins.clone()).map(<[Complex64]>::to_vec)
        };
        let each = |names: &[String]| {
            names
                .iter()
                .map(|name| of(record.channel(name)?))
                .collect::<Option<Vec<_>>>()
        };
        let omega: Vec<f64> = bins.clone().map(|k| k as f64 * step).collect();
        let hold = |omega: &f64| {
            let half = 0.5 * omega * ts;
            Complex64::from_polar(half.sin() / half, -half)
        };
        Some(Self {
            e: of(record.input())?,
            u: of(record.output())?,
            targets: each(&exogenous.targets)?,
            disturbances: each(&exogenous.disturbances)?,
            hold: omega.iter().map(hold).collect(),
            omega,
        })
    }
}
