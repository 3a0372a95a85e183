//! Do the error bars of operators of people hold? Virtual people, whose true operator is known, are
//! drawn over the family, recorded and fitted; how often an interval of 95 % holds the true value is
//! counted.
//!
//! Person i of a study is drawn with the i-th combination of controlled element, number of runs,
//! sample rate, spread between runs and kind of remnant, so that 360 people hold each once; all else
//! is random ([`hoid::sim::people`]). The truth of a person is their own operator, not those of
//! their runs, and crossover and margin are those of the sampled loop (`loop_measures`: the hold of
//! the error lies in the loop).
//!
//! A share k/n has the standard error `sqrt(p (1 - p)/n)`; p is taken as `(k + 2)/(n + 4)`, so that
//! n of n has one too (A. Agresti and B. A. Coull, *American Statistician* 52 (1998) 119-126).
//!
//! | file | contents |
//! |---|---|
//! | `people` | who is drawn, and their runs |
//! | `fits` | the fits of a person, and what each found of each quantity |
//! | `tables` | shares over fits |

pub mod fits;
pub mod people;
pub mod tables;
