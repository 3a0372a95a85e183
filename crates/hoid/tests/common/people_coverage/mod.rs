//! Coverage of the error bars of operators of people. Virtual people, whose true operator is known, are drawn from the
//! family, recorded and fitted; the share of 95 % intervals that contain the true value is counted.
//!
//! Person i of a study is drawn with the i-th combination of controlled element, number of runs, sample rate, spread
//! between runs and kind of remnant, so that 360 people have each once; everything else is random
//! ([`hoid::sim::people`]). The true values of a person are those of their own operator, not those of their runs, and
//! crossover and margin are those of the sampled loop (`loop_measures`: the hold of the error is in the loop).
//!
//! A share k/n has the standard error `sqrt(p (1 - p)/n)`; p is estimated by `(k + 2)/(n + 4)`, so that n of n has one
//! too (A. Agresti and B. A. Coull, *American Statistician* 52 (1998) 119-126).
//!
//! | file | contents |
//! |---|---|
//! | `people` | who is drawn, and their runs |
//! | `fits` | the fits of a person, and what each found of each quantity |
//! | `tables` | shares over fits |

pub mod fits;
pub mod people;
pub mod tables;
