//! Design of experiments before the data, and comparison of conditions and people after them.
//!
//! | module | contents |
//! |---|---|
//! | [`compare`] | differences between conditions and between people, from the estimates of each person |
//! | [`experiment`] | an experiment before it is done: forcing function, standard errors, people for a difference |
//! | [`pool`](mod@pool) | estimates of each person from all people, and the population as a prior |

pub mod compare;
pub mod experiment;
pub mod pool;
