//! Before and after an experiment: what its data will report, and whether conditions and people
//! differ.
//!
//! | module | contents |
//! |---|---|
//! | [`compare`] | differences between conditions and people, from the estimates of each person |
//! | [`experiment`] | standard errors of an experiment before it is done |
//! | [`pool`](mod@pool) | each person from all of them, and the population as a prior |

pub mod compare;
pub mod experiment;
pub mod pool;
