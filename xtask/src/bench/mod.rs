//! `cargo xtask bench`: our tasks and those of the peers in one session, and the growth of cost.
//!
//! Ours are the example `tasks` of the crate `hoid`, the peers the scripts in
//! `crates/hoid/benches/peers`. Both print one line of JSON a task ([`lines`]). They take turns,
//! and of the medians of the rounds the smallest counts, so that what else the machine does falls
//! on both. The tables go between the markers of `research/notes/speed-peers.md` ([`crate::page`]).

mod growth;
mod instructions;
mod lines;
mod options;
mod run;
mod table;

pub use run::bench;
