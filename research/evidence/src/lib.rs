//! Common parts of the studies of this crate. Each study is a file in `examples/`; the comment at its top describes its
//! results and arguments.
//!
//! | module | contents |
//! |---|---|
//! | [`task`] | the conditions of the thesis, and execution of runs on all cores |
//! | [`given_delay`] | methods with a given delay |
//! | [`oracle`] | upper bound on the information about a change, if the operators before and after it are known |
//! | [`pilots`] | the folder of recorded pilots |

#![allow(clippy::unwrap_used, clippy::print_stdout)]

pub mod given_delay;
pub mod oracle;
pub mod pilots;
pub mod task;
