//! Preparation of the runs of a group: the keys of `[prepare]`, which the keys of `[conditions.NAME.prepare]` override.
//!
//! ```toml
//! [prepare]
//! scale = { stick = "12.5:deg", e = "rad:deg" }   # as hoid identify --scale
//! offset = { stick = 1 }                          # samples, or "0.0167s"
//! decimate = 2                                    # or "auto", "off", or rate_hz = 50.0
//! run_in_s = 5.0
//! drop_repeated = true
//!
//! [conditions.so.prepare]
//! offset = { stick = 0 }
//! ```
//!
//! If no rate is specified, recordings at more than 200 Hz are decimated to about 100 Hz ([`hoid_model::resampling`]),
//! and `offset_samples` of a condition counts recorded samples. If a factor or a frequency is given, `offset_samples`
//! counts samples at the new rate.

use std::collections::BTreeMap;

use hoid_io::{IoError, NewRate, Offset, Preparation, Scaling};
use hoid_model::Decimation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Preparation of the runs before they are analysed. A condition uses the settings of the group for steps that it does
/// not specify; a step specified in neither is not applied.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PreparationSettings {
    /// Scaling of each channel: a factor, a factor and a unit, or two units.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub scale: BTreeMap<String, NumberOrText>,
    /// Recording delay of each channel: in samples, or in s as text such as "0.0167s".
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub offset: BTreeMap<String, NumberOrText>,
    /// Decimation factor M: every M-th sample is kept after a low-pass filter; "off" or 1 keeps the rate. Default:
    /// "auto", which for rates above 200 Hz selects the M whose new rate is nearest to 100 Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimate: Option<NumberOrText>,
    /// New sampling frequency, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Time dropped at the start of each run, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run_in_s: Option<f64>,
    /// Whether duplicated rows are dropped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drop_repeated: Option<bool>,
}

/// A number or a text, as on the command line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum NumberOrText {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

impl NumberOrText {
    fn text(&self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Text(text) => text.clone(),
        }
    }
}

impl PreparationSettings {
    /// True if no step is specified.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the settings of the rate, `decimate` and `rate_hz`. They are two keys for one quantity, so a condition
    /// that gives either of them replaces both settings of the group.
    fn rate_settings<'a>(&'a self, condition: Option<&'a Self>) -> (Option<&'a NumberOrText>, Option<f64>) {
        let of = condition.unwrap_or(self);
        let named = of.decimate.is_some() || of.rate_hz.is_some();
        let of = if named { of } else { self };
        (of.decimate.as_ref(), of.rate_hz)
    }

    /// Returns the decimation that depends on the sampling frequency of the recording; `Off` if the rate is specified.
    ///
    /// # Errors
    /// The invalid key, and the reason.
    pub fn rate_decimation(&self, condition: Option<&Self>) -> Result<Decimation, String> {
        let (decimate, rate_hz) = self.rate_settings(condition);
        Ok(match parse_decimation(decimate)? {
            Decimation::Auto if rate_hz.is_none() => Decimation::Auto,
            _ => Decimation::Off,
        })
    }

    /// Returns the preparation of the runs of a condition: the settings of the condition, and the settings of the group
    /// for keys that the condition does not give.
    ///
    /// # Errors
    /// The invalid key, and the reason.
    pub fn preparation(&self, condition: Option<&Self>) -> Result<Preparation, String> {
        let of = condition.unwrap_or(self);
        let (decimate, rate_hz) = self.rate_settings(condition);
        let rate = match (parse_decimation(decimate)?, rate_hz) {
            (_, Some(_)) if decimate.is_some() => {
                return Err("decimate and rate_hz both set the rate: remove one".to_owned());
            }
            (Decimation::By(factor), None) => NewRate::Decimated(factor),
            (_, Some(hz)) if hz > 0.0 && hz.is_finite() => NewRate::Hz(hz),
            (_, Some(hz)) => return Err(format!("rate_hz is {hz}, expected a positive number")),
            (Decimation::Auto | Decimation::Off, None) => NewRate::Kept,
        };
        let run_in_s = of.run_in_s.or(self.run_in_s).unwrap_or(0.0);
        if !(run_in_s >= 0.0 && run_in_s.is_finite()) {
            return Err(format!("run_in_s is {run_in_s}, expected a time of 0 s or more"));
        }
        Ok(Preparation {
            scale: parse_by_channel(&self.scale, &of.scale, |text| text.parse::<Scaling>())?,
            offset: parse_by_channel(&self.offset, &of.offset, |text| text.parse::<Offset>())?,
            rate,
            run_in_s,
            drop_repeated: of.drop_repeated.or(self.drop_repeated).unwrap_or(false),
            ..Preparation::default()
        })
    }
}

/// Parses a decimation factor, "auto" or "off"; `Auto` if nothing is specified.
fn parse_decimation(typed: Option<&NumberOrText>) -> Result<Decimation, String> {
    let Some(typed) = typed else {
        return Ok(Decimation::Auto);
    };
    let text = typed.text();
    text.parse()
        .map_err(|_| format!("decimate is {text}, expected \"auto\", \"off\", or an integer factor of 1 or more"))
}

/// Parses the settings by channel; settings of the condition override settings of the group.
fn parse_by_channel<T>(
    group: &BTreeMap<String, NumberOrText>,
    condition: &BTreeMap<String, NumberOrText>,
    parse: impl Fn(&str) -> Result<T, IoError>,
) -> Result<BTreeMap<String, T>, String> {
    group
        .iter()
        .filter(|(name, _)| !condition.contains_key(*name))
        .chain(condition)
        .map(|(name, value)| match parse(&value.text()) {
            Ok(value) => Ok((name.clone(), value)),
            Err(error) => Err(format!("{name}: {error}")),
        })
        .collect()
}
