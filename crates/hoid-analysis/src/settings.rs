//! The settings that were used, as they are printed: the values that the numerics received.

use hoid_ident::SearchOptions;
use hoid_io::QualityIssueKind;
use hoid_model::{ContinuousTransferFunction, Decimation, FaultHandling};

use crate::{reading::Reading, recordings::Recordings};

/// A setting and its value in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// What it is called.
    pub name: String,
    /// The value that was used.
    pub value: String,
}

impl Setting {
    /// A setting.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
        }
    }
}

impl Reading {
    /// How records are read, defaults included.
    pub fn settings(&self, decimation: Decimation) -> Vec<Setting> {
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
        let repair = options.repair;
        if repair.resample || repair.fill {
            list.push(Setting::new(
                "repair",
                format!("resample {}, fill {}", repair.resample, repair.fill),
            ));
        }
        list
    }

    /// What was left out.
    fn masked(&self) -> Option<Setting> {
        let kinds: Vec<&str> = self.mask.iter().map(|kind: &QualityIssueKind| kind.name()).collect();
        (!kinds.is_empty()).then(|| {
            Setting::new(
                "masked",
                format!("{}, stretches of {} s or more", kinds.join(", "), self.shortest_s),
            )
        })
    }
}

/// The settings that every kind of fit shares, defaults included.
pub(crate) fn shared_settings(
    recordings: &Recordings,
    initial_state: &str,
    decimation: Decimation,
    handling: FaultHandling,
    search: &SearchOptions,
    element: Option<&ContinuousTransferFunction>,
) -> Vec<Setting> {
    let mut list = vec![Setting::new("initial state", initial_state)];
    let reading = recordings.source.as_ref().map(|source| &source.reading);
    match reading {
        Some(reading) => list.extend(reading.settings(decimation)),
        None => list.push(Setting::new("decimate", decimation.to_string())),
    }
    list.push(Setting::new("faults", handling.to_string()));
    list.extend(reading.and_then(Reading::masked));
    list.extend([
        Setting::new(
            "search",
            format!("{}, relative tolerance {:e}", search.method, search.tolerance),
        ),
        Setting::new("largest number of steps", search.max_iterations.to_string()),
    ]);
    list.extend(element.map(|element| Setting::new("controlled element", element.to_string())));
    list
}
