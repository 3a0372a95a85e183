//! The level of recorded data: a constant of u in each record, estimated with the fit.

use hoid_ident::{IdentError, level};
use hoid_model::{Detrend, FaultHandling, Record, uncertainty::Estimate};

use crate::{
    AnalysisError,
    recordings::{Account, Recordings},
    settings::Setting,
};

/// True if the level of the recordings may be estimated. It is not estimated for a model without an input, if the means
/// were removed in reading, or if the data are used unchanged.
pub(crate) fn may_have_level(recordings: &Recordings, with_input: bool, handling: FaultHandling) -> bool {
    with_input
        && handling != FaultHandling::Keep
        && !recordings.were_detrended()
        && level::may_have_level(&recordings.records)
}

/// Writes the level of each record as read into its account; `of` receives the index of the record and the record.
pub(crate) fn write_levels(
    accounts: &mut [Account],
    as_read: &[Record],
    of: impl Fn(usize, &Record) -> Option<Estimate>,
) {
    for (k, (account, record)) in accounts.iter_mut().zip(as_read).enumerate() {
        account.level = of(k, record);
    }
}

/// The level of the records, for a time-invariant model that is fitted after the level has been removed.
pub(crate) struct Level {
    /// The records including their level; `None` if the level was not removed.
    records_with_level: Option<Vec<Record>>,
    /// Part of the level of each record that was removed in addition to its mean.
    separate_means: Vec<f64>,
}

impl Level {
    /// Removes the level from the data if they may have one.
    pub(crate) fn remove(data: &mut Recordings, with_input: bool, handling: FaultHandling) -> Self {
        let as_read = may_have_level(data, with_input, handling).then(|| {
            let without = level::without_level(&data.records);
            std::mem::replace(&mut data.records, without)
        });
        Self {
            records_with_level: as_read,
            separate_means: Vec::new(),
        }
    }

    /// True if the level is still in the records.
    pub(crate) fn is_kept(&self) -> bool {
        self.records_with_level.is_none()
    }

    /// Returns the trend that was removed.
    pub(crate) fn detrend(&self) -> Detrend {
        if self.is_kept() { Detrend::None } else { Detrend::Mean }
    }

    /// Removes the remaining level, which a fit with the level as an unknown has estimated in addition to the means.
    pub(crate) fn remove_remaining_level(
        &mut self,
        data: &mut Recordings,
        of: impl Fn(&Record) -> Result<Option<f64>, IdentError>,
    ) -> Result<(), AnalysisError> {
        for record in data.records.iter_mut().filter(|_| self.records_with_level.is_some()) {
            let left = of(record)?.unwrap_or(0.0);
            self.separate_means.push(left);
            let mut is_output = false;
            *record = record.clone().map_signals(|values| {
                let by = if is_output { left } else { 0.0 };
                values.iter_mut().for_each(|v| *v -= by);
                is_output = true;
            })?;
        }
        Ok(())
    }

    /// Writes the level into the accounts, and returns a setting that reports it.
    pub(crate) fn report(
        &self,
        data: &mut Recordings,
        of: impl Fn(usize, &Record) -> Option<Estimate>,
    ) -> Option<Setting> {
        write_levels(&mut data.accounts, self.records_with_level.as_ref()?, |k, record| {
            let separate_mean = self.separate_means.get(k).copied().unwrap_or(0.0);
            of(k, record).map(|level| Estimate {
                value: level.value + separate_mean,
                ..level
            })
        });
        Some(Setting::level())
    }
}

impl Recordings {
    /// True if a trend was removed in reading.
    pub(crate) fn were_detrended(&self) -> bool {
        let source = self.source.as_ref();
        source.is_some_and(|source| source.reading.preparation.detrend != Detrend::None)
    }
}

impl Setting {
    /// Returns the setting that reports an estimated level.
    pub(crate) fn level() -> Self {
        Self::new("level", "one constant in u per record, estimated")
    }
}
