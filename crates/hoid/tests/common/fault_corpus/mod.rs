//! What does a fault of a recording do to a result, and does the result report it? Virtual runs
//! whose operator is known get one fault each, are given to the program `hoid` as files, and what
//! comes back is judged.
//!
//! A result is *wrong* where a parameter that is reported as determined lies more than
//! [`judge::WRONG`] of its standard errors from the truth. It is *flagged* where the verdict is not
//! "trustworthy", where a fault is reported at its place (within [`judge::NEAR_S`]), or where the
//! program refuses the record. What must not be is a result that is wrong and not flagged; what is
//! useless is a flag on a result that is right.
//!
//! Methods that estimate wrongly on clean runs too, as `rls` with its own noise model, do so here:
//! the clean runs are a row of the same table.
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
