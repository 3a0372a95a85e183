//! The level of recorded data: one constant of u a record, estimated with the fit.

use hoid::ident::level::may_have_level;
use hoid::model::{Detrend, Record, uncertainty::Estimate};

use crate::{args::IdentifyArgs, commands::reading::Account};

/// True for recorded data as they were read: not where `--detrend` has taken the level out, and not with
/// `--faults keep`, which leaves data as they are.
pub fn is_estimated(args: &IdentifyArgs, with_input: bool, records: &[Record]) -> bool {
    with_input && args.faults.looks() && args.read.detrend == Detrend::None && may_have_level(records)
}

/// The level of each record as it was read, by its number, into its account.
pub fn into_accounts(accounts: &mut [Account], as_read: &[Record], of: impl Fn(usize, &Record) -> Option<Estimate>) {
    for (k, (account, record)) in accounts.iter_mut().zip(as_read).enumerate() {
        account.level = of(k, record);
    }
}

/// What the settings say of it.
pub fn setting() -> (String, String) {
    ("level".to_owned(), "one constant of u a record, estimated".to_owned())
}
