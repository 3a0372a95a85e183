//! Effect of a fault of a recording on a result, and whether the result reports it. Virtual runs with a known operator
//! get one fault each and are passed to the program `hoid` as files; its results are judged.
//!
//! A result is *wrong* if a parameter that is reported as determined differs by more than
//! [`judge::WRONG`] of its standard errors from the true value. It is *flagged* if the verdict is not "trustworthy",
//! if a fault is reported at its place (within [`judge::NEAR_S`]), or if the program refuses the record. A result that
//! is wrong and not flagged must not occur; a flag on a correct result is useless.
//!
//! Methods that estimate wrongly on clean runs too, such as `rls` with its own noise model, do so here as well: the
//! clean runs are a row of the same table.
//!
//! | file | contents |
//! |---|---|
//! | `table` | a recording as the columns of a file |
//! | `kinds` | the faults: kinds, sizes, places, and the cases in their order |
//! | `inject` | how each comes into a recording |
//! | `bases` | the runs without faults, and their truth |
//! | `judge` | what a result is worth, against the truth |
//! | `program` | the program, run on a case |
//! | `summary` | shares over cases, as tables |

pub mod bases;
pub mod inject;
pub mod judge;
pub mod kinds;
pub mod program;
pub mod summary;
pub mod table;
