//! Before and after an experiment: what its data will say, and whether conditions and people differ.
//!
//! | module | what it holds |
//! |---|---|
//! | [`compare`] | differences between conditions and people, from the estimates of each person |

pub mod compare;
