//! Estimation of a describing function and its verdict from recordings, which are repaired, decimated and cut to whole
//! periods.
//!
//! For a periodic signal the offset of a channel is a phase shift. Shifting rows would cost the last whole period, so
//! the offset is removed by correcting the ratio at each line ([`without_offsets`]). Decimation shifts the input to
//! account for its longer hold; this shift is corrected in the same way, since a ratio of Fourier coefficients of
//! samples involves no hold.
//!
//! [`without_offsets`]: crate::without_offsets

use std::collections::BTreeMap;

use hoid_ident::{
    MarginEstimates,
    frequency::{Description, RecordDescriptionOptions, describe_runs},
};
use hoid_io::Offset;
use hoid_model::{Decimation, FaultHandling};

use crate::{
    AnalysisError,
    answers::{description_answers, judged},
    offset::output_delay_samples,
    quality::SystemKind,
    reading::Reading,
    recordings::Recordings,
    settings::Setting,
};

/// Options for the estimation of a describing function from recordings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DescribingFunctionOptions {
    /// Excitation, lines, period, controlled element and span. The offset given here, in samples of the recordings, is
    /// added to the offsets of the channels.
    pub options: RecordDescriptionOptions,
    /// Offsets that were not removed in reading, with the names of their channels as keys.
    pub offsets: BTreeMap<String, Offset>,
    /// Treatment of faults of the recordings.
    pub faults: FaultHandling,
    /// Decimation of recordings at a high sampling rate.
    pub rate: Decimation,
}

/// A describing function with its recordings and settings.
#[derive(Debug, Clone)]
pub struct DescribingFunctionResult {
    /// The describing function; its verdict includes the findings on the recordings.
    pub found: Description,
    /// The recordings used for the estimation.
    pub data: Recordings,
    /// The settings used.
    pub settings: Vec<Setting>,
}

impl DescribingFunctionResult {
    /// Returns the crossover and margins with the controlled element; `None` if the controlled element is unknown.
    pub fn margins(&self) -> Option<&MarginEstimates> {
        self.found.margins.as_ref().map(|margins| &margins.estimates)
    }
}

impl DescribingFunctionOptions {
    /// Repairs and decimates the recordings, estimates their describing function and forms the verdict.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no result, for example because there are no lines, there is no whole period, or a
    /// channel does not exist.
    pub fn run(&self, recordings: Recordings) -> Result<DescribingFunctionResult, AnalysisError> {
        let read = recordings.repaired(self.faults, SystemKind::Person)?;
        let first = read.records.first().ok_or(AnalysisError::NoRecordings)?;
        let late = self.options.offset_samples + output_delay_samples(first, &self.offsets)?;
        let late_s = late * first.sample_time().s();
        let data = read.at_rate(self.rate, false)?;
        let options = RecordDescriptionOptions {
            offset_samples: (late_s + data.input_lead_s()) / data.records[0].sample_time().s(),
            ..self.options.clone()
        };
        let mut found = describe_runs(&data.records, &options)?;
        let (element, channel) = (options.controlled_element.as_ref(), options.excitation.as_deref());
        let margins = found.margins.as_ref().map(|margins| &margins.estimates);
        let verdict = data.with_findings(found.verdict);
        let verdict = verdict.append(data.loop_findings(element, channel, &[]));
        found.verdict = judged(verdict, &description_answers(margins));
        let settings = self.settings(&data, late, &found);
        Ok(DescribingFunctionResult { found, data, settings })
    }

    fn settings(&self, data: &Recordings, delay_samples: f64, found: &Description) -> Vec<Setting> {
        let reading = data.source.as_ref().map(|source| &source.reading);
        let mut list = match reading {
            Some(reading) => reading.settings(self.rate),
            None => {
                vec![Setting::new("decimate", self.rate.to_string()).with_given(self.rate != Decimation::default())]
            }
        };
        if delay_samples != 0.0 {
            let words = format!("{delay_samples} samples, corrected as a phase shift");
            list.push(Setting::new("offset of the output", words).with_given(true));
        }
        let is_default = self.faults == FaultHandling::default();
        list.push(Setting::new("faults", self.faults.to_string()).with_given(!is_default));
        list.extend(
            reading
                .and_then(Reading::masked_rows_setting)
                .map(|masked| masked.with_given(true)),
        );
        let given = self.options.lines_rad_s.is_some();
        let lines = match (given, &found.channel) {
            (true, None) => "given".to_owned(),
            (true, Some(channel)) => format!("given, in {channel}"),
            (false, channel) => format!("found in {}", channel.as_deref().unwrap_or("nothing")),
        };
        let average = match &found.channel {
            Some(channel) => format!("cross spectra with {channel}"),
            None => "ratios of u and e".to_owned(),
        };
        list.extend([
            Setting::new("lines", lines).with_given(given),
            Setting::new("average", average),
            Setting::new("delay removed between lines", format!("{:.3} s", found.delay_s)),
        ]);
        let element = self.options.controlled_element.as_ref();
        list.extend(element.map(|element| Setting::new("controlled element", element.to_string()).with_given(true)));
        list
    }
}
