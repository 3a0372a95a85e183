//! The level of recorded data: one constant of u a record, estimated with the fit.

use hoid_ident::level;
use hoid_model::{Detrend, FaultHandling, Record, uncertainty::Estimate};

use crate::{
    recordings::{Account, Recordings},
    settings::Setting,
};

/// True for recordings that a level is estimated of: not where the means have been taken out in reading, and
/// not where the data are kept as they are.
pub(crate) fn may_have_level(recordings: &Recordings, with_input: bool, handling: FaultHandling) -> bool {
    with_input
        && handling != FaultHandling::Keep
        && !recordings.were_detrended()
        && level::may_have_level(&recordings.records)
}

/// The level of each record as it was read, by its number, into its account.
pub(crate) fn levels_into(
    accounts: &mut [Account],
    as_read: &[Record],
    of: impl Fn(usize, &Record) -> Option<Estimate>,
) {
    for (k, (account, record)) in accounts.iter_mut().zip(as_read).enumerate() {
        account.level = of(k, record);
    }
}

/// The level of records for a model that does not change, which is fitted without it.
pub(crate) struct Level {
    /// The records with it, where it was taken out.
    as_read: Option<Vec<Record>>,
}

impl Level {
    /// Takes it out where there may be one.
    pub(crate) fn taken_out(data: &mut Recordings, with_input: bool, handling: FaultHandling) -> Self {
        let as_read = may_have_level(data, with_input, handling).then(|| {
            let without = level::without_level(&data.records);
            std::mem::replace(&mut data.records, without)
        });
        Self { as_read }
    }

    /// Whether it is still in the records.
    pub(crate) fn is_kept(&self) -> bool {
        self.as_read.is_none()
    }

    /// What was taken out.
    pub(crate) fn detrend(&self) -> Detrend {
        if self.is_kept() { Detrend::None } else { Detrend::Mean }
    }

    /// Writes it into the accounts, and says so.
    pub(crate) fn told(
        &self,
        data: &mut Recordings,
        of: impl Fn(usize, &Record) -> Option<Estimate>,
    ) -> Option<Setting> {
        levels_into(&mut data.accounts, self.as_read.as_ref()?, of);
        Some(Setting::level())
    }
}

impl Recordings {
    /// Whether a trend was taken out in reading.
    pub(crate) fn were_detrended(&self) -> bool {
        let source = self.source.as_ref();
        source.is_some_and(|source| source.reading.preparation.detrend != Detrend::None)
    }
}

impl Setting {
    /// What the settings say of an estimated level.
    pub(crate) fn level() -> Self {
        Self::new("level", "one constant of u a record, estimated")
    }
}
