//! `cargo xtask bench`: speed of hoid and its peers in the same session, and growth of the cost.
//!
//! The tasks of hoid are in the example `tasks` of the crate `hoid`; the peers are the scripts in
//! `crates/hoid/benches/peers`. Each prints one line of JSON per task ([`lines`]). They run in turn, and the smallest
//! of the medians of the rounds is used, so other load on the machine affects all of them. The tables are written
//! between the markers of `research/notes/speed-peers.md` ([`crate::page`]).

mod growth;
mod instructions;
mod lines;
mod options;
mod run;
mod table;

pub use run::bench;
