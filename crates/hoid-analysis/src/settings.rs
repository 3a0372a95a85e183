//! Settings used in an analysis, as printed: the values that the computations received.

use hoid_io::QualityIssueKind;
use hoid_model::Decimation;
use serde::{Deserialize, Serialize};

use crate::reading::Reading;

/// A setting and its value as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// Name of the setting.
    pub name: String,
    /// The value in use.
    pub value: String,
    /// True if the value differs from the default and was therefore given by the user.
    #[serde(rename = "given")]
    pub is_given: bool,
}

impl Setting {
    /// Creates a setting that is marked as a default.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
            is_given: false,
        }
    }

    /// Sets whether the user gave the value.
    #[must_use]
    pub fn with_given(self, given: bool) -> Self {
        Self {
            is_given: given,
            ..self
        }
    }

    /// Marks as given the settings whose values differ from the defaults.
    pub fn mark_non_defaults(all: Vec<Self>, by_default: &[Self]) -> Vec<Self> {
        let is_default = |one: &Self| {
            by_default
                .iter()
                .any(|default| (&default.name, &default.value) == (&one.name, &one.value))
        };
        all.into_iter()
            .map(|one| {
                let given = one.is_given || !is_default(&one);
                one.with_given(given)
            })
            .collect()
    }
}

impl Reading {
    /// Returns the options with which records are read, including defaults.
    pub fn settings(&self, decimation: Decimation) -> Vec<Setting> {
        Setting::mark_non_defaults(self.rows(decimation), &Self::default().rows(Decimation::default()))
    }

    fn rows(&self, decimation: Decimation) -> Vec<Setting> {
        let options = &self.options;
        let or_all = |bound: Option<f64>, all: &str| bound.map_or(all.to_owned(), |v| v.to_string());
        let of_time = || {
            let time = options.time.as_ref();
            time.map_or("column t".to_owned(), |time| format!("column {time}"))
        };
        let sampling = options.sampling_hz.map_or_else(of_time, |fs| format!("{fs} Hz"));
        let (from, to) = options.span_s;
        let mut list: Vec<Setting> = Vec::new();
        list.extend(
            options
                .input
                .as_ref()
                .map(|input| Setting::new("input", input.to_string())),
        );
        list.extend([
            Setting::new("output", options.output.to_string()),
            Setting::new("sampling", sampling),
            Setting::new(
                "span in s",
                format!("{} to {}", or_all(from, "start"), or_all(to, "end")),
            ),
            Setting::new("detrend", self.preparation.detrend.to_string()),
            Setting::new("decimate", decimation.to_string()),
        ]);
        if !options.sparse.is_empty() {
            let each: Vec<String> = options
                .sparse
                .iter()
                .map(|(name, how)| format!("{name} {how}"))
                .collect();
            list.push(Setting::new("sparse", each.join(", ")));
        }
        let repair = options.repair;
        if repair.resample || repair.fill {
            list.push(Setting::new(
                "repair",
                format!("resample {}, fill {}", repair.resample, repair.fill),
            ));
        }
        list
    }

    /// Returns the setting for masked rows, if any are masked.
    pub(crate) fn masked_rows_setting(&self) -> Option<Setting> {
        let kinds: Vec<&str> = self.mask.iter().map(|kind: &QualityIssueKind| kind.name()).collect();
        (!kinds.is_empty()).then(|| {
            Setting::new(
                "masked",
                format!("{}, stretches of {} s or more", kinds.join(", "), self.shortest_s),
            )
        })
    }
}
