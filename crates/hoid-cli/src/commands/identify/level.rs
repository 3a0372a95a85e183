//! The level of recorded data: one constant of u a record, estimated with the fit.

use hoid_ident::Fit;
use hoid_model::{Detrend, Record};

use crate::{args::IdentifyArgs, commands::reading::Account};

/// The channel of true gains that simulated runs carry: they have no level.
const TRUTH: &str = "K_e";

/// True for recorded data as they were read: not where `--detrend` has taken the level out, not with
/// `--faults keep`, which leaves data as they are, and not where e or u never moves, which the fit
/// refuses with the value as it was read.
pub fn is_estimated(args: &IdentifyArgs, with_input: bool, records: &[Record]) -> bool {
    let simulated = records.iter().any(|record| record.channel(TRUTH).is_some());
    let moves = |x: &[f64]| x.iter().any(|v| *v != x[0]);
    let alive = records
        .iter()
        .all(|record| moves(record.input()) && moves(record.output()));
    with_input && !simulated && alive && args.faults.looks() && args.read.detrend == Detrend::None
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
