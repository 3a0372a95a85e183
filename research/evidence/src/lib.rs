//! Common parts of the studies of this crate. A study is a file in `examples/`, whose head
//! describes its results and arguments.
//!
//! | module | contents |
//! |---|---|
//! | [`task`] | the conditions of the thesis, and runs on all cores |
//! | [`told`] | methods that are given the delay |
//! | [`oracle`] | what is known at most of a change: both persons are known |
//! | [`pilots`] | the folder of recorded pilots |

#![allow(clippy::unwrap_used, clippy::print_stdout)]

pub mod oracle;
pub mod pilots;
pub mod task;
pub mod told;
