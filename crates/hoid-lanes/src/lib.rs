//! Several runs side by side in the lanes of vector registers.
//!
//! A recursion waits for its own last sample: alone, a run leaves most of a processor idle. Here each lane of a register holds a run of
//! its own. The registers are chosen when the program runs (AVX-512, AVX2, else the scalar ones; Neon on ARM), and the operations on each lane
//! are those of the run alone, in their order and without contraction: the bits do not depend on the registers, nor on what runs beside.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Path`], [`SideBySide`] | the choice of the registers, and what runs in them |
//! | [`Four`], [`by_fours`] | the partial sums of one record, four in one register or two |
//! | [`track_many`] | recursive least squares and the prediction-error method over many runs |

mod fours;
mod path;
mod track;
mod wide;

pub use fours::{ByFours, Four, by_fours};
pub use path::{Path, SideBySide, alone};
pub use track::{Estimates, LanesError, Run, Task, track_many};
