//! Settings for reading the files of a group: the keys of `[read]`.

use std::collections::BTreeMap;

use hoid_io::SparseTreatment;
use hoid_model::{FaultHandling, UnknownName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings for reading files, as in `hoid identify`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReadSettings {
    /// Column of the input, or a difference of columns such as `r-y`.
    pub input: String,
    /// Column of the output.
    pub output: String,
    /// Time column, with its unit, such as `clock:ms`. Default: t, or another common name for time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Trial to read from each file, such as `trial=3`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trial: Option<String>,
    /// Sampling frequency, Hz. Default: from the time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling_hz: Option<f64>,
    /// Start of the span that is read, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// End of the span that is read, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
    /// Whether unevenly spaced samples are interpolated.
    pub resample: bool,
    /// Whether missing values are bridged.
    pub fill: bool,
    /// Columns logged at their own times, such as `{ u = "hold" }`: hold, linear or drop.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub sparse: BTreeMap<String, String>,
    /// Trend removed from e and u: none, mean or linear.
    pub detrend: Detrending,
    /// Treatment of faults of the recordings: bridge, report or keep. If a fault is too long to be bridged, the
    /// operator of a person is fitted to all parts without the fault, and single runs are analysed on the longest such
    /// part.
    pub faults: FaultTreatment,
}

impl ReadSettings {
    /// Returns the columns logged at their own times, with their treatment.
    pub(super) fn sparse_columns(&self) -> Result<BTreeMap<String, SparseTreatment>, String> {
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
    /// Short faults are bridged; a run with long faults is reduced to its longest part without them.
    #[default]
    Bridge,
    /// Faults are reported but not repaired.
    Report,
    /// Faults are not searched for.
    Keep,
}

impl FaultTreatment {
    /// Returns the corresponding option of the repair.
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
    /// No trend is removed.
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
