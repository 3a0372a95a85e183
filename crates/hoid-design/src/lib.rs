//! Design of experiments before data are collected, and comparison of conditions and people afterwards.
//!
//! | module | contents |
//! |---|---|
//! | [`compare`] | differences between conditions and between people, from estimates for each person |
//! | [`experiment`] | design of an experiment: forcing function, expected standard errors, number of people needed to find a difference |
//! | [`pool`](mod@pool) | estimates for each person, pooled with all people, and the population as a prior |

pub mod compare;
pub mod experiment;
pub mod pool;
