//! Effect of a fault in a recording on a result, and whether the result reports the fault. One fault is inserted into
//! each of many virtual runs with a known operator. The runs are passed to the program `hoid` as files, and its results
//! are assessed.
//!
//! A result is *wrong* if a parameter that is reported as determined differs by more than [`judge::WRONG_LIMIT_ERRORS`]
//! of its standard errors from the true value. It is *flagged* if the verdict is not "trustworthy", if a fault is
//! reported at its place (within [`judge::MAX_REPORT_DISTANCE_S`]), or if the program rejects the record. A wrong
//! result must always be flagged; a flag on a correct result is useless.
//!
//! Some methods, such as `rls` with its own noise model, also give wrong estimates on clean runs; the clean runs are
//! therefore a row of the same table.
//!
//! | file | contents |
//! |---|---|
//! | `table` | a recording as the columns of a file |
//! | `kinds` | the faults: kinds, sizes, places, and the order of the cases |
//! | `inject` | insertion of each fault into a recording |
//! | `bases` | the runs without faults, and their true values |
//! | `judge` | assessment of a result by comparison with the true values |
//! | `program` | runs of the program on a case |
//! | `summary` | shares over cases, as tables |

pub mod bases;
pub mod inject;
pub mod judge;
pub mod kinds;
pub mod program;
pub mod summary;
pub mod table;
