//! The describing function that accompanies a fit: at the lines of the excitation, over whole periods.

use hoid_ident::{
    IdentError,
    frequency::{Description, RecordDescriptionOptions, describe_runs},
};
use hoid_io::Step;
use hoid_model::{Detrend, FaultHandling};

use crate::{
    AnalysisError,
    offset::{output_delay_samples, without_offsets},
    recordings::Recordings,
    repair::repair_records,
};

/// Channel with the recorded disturbance or target.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Excitation {
    /// The first of the channels with a common name whose power is concentrated in lines.
    #[default]
    Found,
    /// No channel: no describing function is computed.
    Nothing,
    /// The named channel, which one of the recordings must have; if it has no lines, the result reports this.
    Named(String),
    /// The named channel of the recordings that have it.
    IfRecorded(String),
}

impl Excitation {
    /// Interprets the text of the user: a channel or `none`; without text the channel is found automatically.
    pub fn from_text(text: Option<&str>) -> Self {
        match text {
            None => Self::Found,
            Some("none") => Self::Nothing,
            Some(name) => Self::Named(name.to_owned()),
        }
    }

    /// Returns the named channel, if there is one.
    pub fn channel_name(&self) -> Option<&str> {
        match self {
            Self::Named(name) | Self::IfRecorded(name) => Some(name),
            Self::Found | Self::Nothing => None,
        }
    }
}

impl Recordings {
    /// Computes the describing function of the recordings. If rows were cut for an offset, the periods are no longer
    /// complete, and the recordings are read again without the offset: for a periodic signal the offset is a phase
    /// shift, which is corrected at the lines. Returns `None` if no excitation is requested.
    ///
    /// # Errors
    /// [`AnalysisError`] if there are no lines, or if the files cannot be read again.
    pub fn describe(
        &self,
        excitation: &Excitation,
        period_s: Option<f64>,
        handling: FaultHandling,
    ) -> Result<Option<Description>, AnalysisError> {
        if *excitation == Excitation::Nothing {
            return Ok(None);
        }
        let options = |offset_samples| RecordDescriptionOptions {
            excitation: excitation.channel_name().map(str::to_owned),
            period_s,
            offset_samples,
            // Detrending, if requested, has already been applied in reading.
            detrend: Detrend::None,
            ..RecordDescriptionOptions::default()
        };
        let steps = || self.accounts.iter().flat_map(|account| &account.steps);
        let is_cut = |step: &Step| matches!(step, Step::Offset { cut_samples, .. } if *cut_samples != (0, 0));
        let moved = self
            .source
            .as_ref()
            .filter(|_| steps().any(is_cut))
            .map(|source| (source, without_offsets(&source.reading)));
        let Some((source, (reading, offsets))) = moved.filter(|(_, (_, offsets))| !offsets.is_empty()) else {
            return Ok(Some(describe_runs(&self.records, &options(0.0))?));
        };
        let again = reading.read_files(&source.paths, |_, _| ())?;
        let again = repair_records(again.records, handling)?;
        let late = again.first().map_or(Ok(0.0), |r| output_delay_samples(r, &offsets))?;
        let ts_s = again.first().map_or(1.0, |r| r.sample_time().s());
        // The records that were read again are decimated to the sampling rate of the fit.
        let used_s = self.records.first().map_or(ts_s, |r| r.sample_time().s());
        let factor = (used_s / ts_s).round().max(1.0) as usize;
        let unmoved = again
            .into_iter()
            .map(|r| r.decimated(factor).map(|found| found.0))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Some(describe_runs(&unmoved, &options(late * ts_s / used_s))?))
    }
}

/// Returns the describing function for a fit that also uses the lines. Missing lines are an error only if the user gave
/// their channel or their period.
pub(crate) fn line_describing_function(
    described: &Result<Option<Description>, AnalysisError>,
    excitation: &Excitation,
    period_s: Option<f64>,
) -> Option<Result<hoid_ident::frequency::DescribingFunction, IdentError>> {
    match described {
        Ok(found) => found.as_ref().map(|found| Ok(found.function.clone())),
        Err(AnalysisError::Ident(error)) if excitation.channel_name().is_some() || period_s.is_some() => {
            Some(Err(error.clone()))
        }
        Err(_) => None,
    }
}
