//! The level of recorded data: one constant of u a record, estimated with the fit.

use hoid_ident::Fit;
use hoid_model::{Detrend, Record};

use crate::{args::IdentifyArgs, commands::reading::Account};

/// The channel of true gains that simulated runs carry: they have no level.
const TRUTH: &str = "K_e";

/// True for recorded data as they were read: not where `--detrend` has taken the level out, and not
/// with `--faults keep`, which leaves data as they are.
pub fn is_estimated(args: &IdentifyArgs, with_input: bool, records: &[Record]) -> bool {
    let simulated = records.iter().any(|record| record.channel(TRUTH).is_some());
    with_input && !simulated && args.faults.looks() && args.read.detrend == Detrend::None
}

/// The records without the means of e and u.
pub fn without(records: &[Record]) -> Vec<Record> {
    records.iter().map(|r| r.clone().detrended(Detrend::Mean)).collect()
}

/// The level of each record as it was read, into its account.
pub fn into_accounts<'f>(accounts: &mut [Account], as_read: &[Record], fit: impl Fn(usize) -> &'f Fit) {
    for (k, (account, record)) in accounts.iter_mut().zip(as_read).enumerate() {
        account.level = fit(k).level(record);
    }
}
