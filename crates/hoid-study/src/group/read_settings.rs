//! Settings for reading the files of a group: the keys of `[read]`.

use std::collections::BTreeMap;

use hoid_io::Sparse;
use hoid_model::{FaultHandling, UnknownName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings for reading files, as in `hoid identify`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReadSettings {
    /// Column of the input, or a difference such as `r-y`.
    pub input: String,
    /// Column of the output.
    pub output: String,
    /// Column of the time and its unit, such as `clock:ms`. Default: t, or a common name of a time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// The trial of each file that is read, such as `trial=3`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trial: Option<String>,
    /// Sampling frequency, Hz. Default: that of the column t.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling_hz: Option<f64>,
    /// Start of the span that counts, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// End of the span that counts, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
    /// Interpolate an uneven t.
    pub resample: bool,
    /// Bridge missing values.
    pub fill: bool,
    /// Columns logged at their own instants, such as `{ u = "hold" }`: hold, linear or drop.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub sparse: BTreeMap<String, String>,
    /// Trend removed from e and u: none, mean or linear.
    pub detrend: Detrending,
    /// Faults of the recordings: bridge, report or keep. If a fault is too long to be bridged, the operator of a person
    /// is fitted to all parts without it, and single runs are analysed on the longest part.
    pub faults: FaultTreatment,
}

impl ReadSettings {
    /// The columns that are sparse.
    pub(super) fn sparse(&self) -> Result<BTreeMap<String, Sparse>, String> {
        let of = |(name, how): (&String, &String)| match how.parse() {
            Ok(how) => Ok((name.clone(), how)),
            Err(error @ UnknownName { .. }) => Err(format!("sparse of {name}: {error}")),
        };
        self.sparse.iter().map(of).collect()
    }
}

/// Treatment of faults of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FaultTreatment {
    /// Short faults are bridged; of a run with long faults, the longest part without them is used.
    #[default]
    Bridge,
    /// Faults are reported.
    Report,
    /// Faults are not searched for.
    Keep,
}

impl FaultTreatment {
    /// The same as an option of the repair.
    pub(super) fn handling(self) -> FaultHandling {
        match self {
            Self::Bridge => FaultHandling::Bridge,
            Self::Report => FaultHandling::Report,
            Self::Keep => FaultHandling::Keep,
        }
    }
}

/// Trend removed from e and u.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Detrending {
    /// Nothing.
    #[default]
    None,
    /// The mean.
    Mean,
    /// A straight line.
    Linear,
}

impl Default for ReadSettings {
    fn default() -> Self {
        Self {
            input: "e".to_owned(),
            output: "u".to_owned(),
            time: None,
            trial: None,
            sampling_hz: None,
            from_s: None,
            to_s: None,
            resample: false,
            fill: false,
            sparse: BTreeMap::new(),
            detrend: Detrending::None,
            faults: FaultTreatment::Bridge,
        }
    }
}
