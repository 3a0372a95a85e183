//! The level of recorded data: one constant of u a record, estimated with the fit.

use hoid_ident::level;
use hoid_model::{Detrend, FaultHandling, Record, uncertainty::Estimate};

use crate::{
    recordings::{Account, Recordings},
    settings::Setting,
};

/// True for recordings that a level is estimated of: not where the means have been taken out in reading, and
/// not where the data are kept as they are.
pub fn may_have_level(recordings: &Recordings, with_input: bool, handling: FaultHandling) -> bool {
    let detrended = recordings
        .source
        .as_ref()
        .is_some_and(|source| source.reading.preparation.detrend != Detrend::None);
    with_input && handling != FaultHandling::Keep && !detrended && level::may_have_level(&recordings.records)
}

/// The level of each record as it was read, by its number, into its account.
pub fn levels_into(accounts: &mut [Account], as_read: &[Record], of: impl Fn(usize, &Record) -> Option<Estimate>) {
    for (k, (account, record)) in accounts.iter_mut().zip(as_read).enumerate() {
        account.level = of(k, record);
    }
}

impl Setting {
    /// What the settings say of an estimated level.
    pub fn level() -> Self {
        Self::new("level", "one constant of u a record, estimated")
    }
}
