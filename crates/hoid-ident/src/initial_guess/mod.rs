//! Where a search starts if no start is given: the poles decide.
//!
//! | module | contents |
//! |---|---|
//! | `guesses` | the starts of a criterion, from the proposals of the others |
//! | `continuation` | poles of the averaged record |
//! | `pole_grid`, `arx_poles` | poles in the range of human operators; poles by linear least squares |
//! | `shared_poles` | models whose A is next to a noise model or next to F |
//! | `instrument_chain` | instrumental variables, and C and D of the residual |
//! | `broad` | starts from all over the region of stability, for records with many minima |
//! | `c_drawn_inside` | starts for a search that ended on the unit circle |

pub mod arx_poles;
pub mod broad;
pub mod c_drawn_inside;
pub mod continuation;
pub mod guesses;
pub mod instrument_chain;
pub mod pole_grid;
pub mod shared_poles;
