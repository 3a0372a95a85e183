//! Coverage of the error bars of operators of people. Virtual people, whose true operator is known, are drawn from the
//! family, recorded and fitted; the share of 95 % intervals that contain the true value is counted.
//!
//! Person i of a study is drawn with the i-th combination of controlled element, number of runs, sampling rate, spread
//! between runs and kind of remnant, so 360 people have every combination once; all other properties are random
//! ([`hoid::sim::people`]). The true values are those of the operator of the person and not of single runs. The
//! crossover and the margin refer to the sampled loop (`loop_measures`), which contains the hold of the error.
//!
//! A share k/n has the standard error `sqrt(p (1 - p)/n)`; p is estimated by `(k + 2)/(n + 4)`, so the standard error
//! is not zero for k = n (A. Agresti and B. A. Coull, *American Statistician* 52 (1998) 119-126).
//!
//! | file | contents |
//! |---|---|
//! | `people` | the people that are drawn, and their runs |
//! | `fits` | the fits of a person, and their results for each quantity |
//! | `tables` | shares over fits |

pub mod fits;
pub mod people;
pub mod tables;
