//! Automatic starts of a search, based mainly on candidates for the poles.
//!
//! | module | contents |
//! |---|---|
//! | `guesses` | starts for a criterion, from the candidates of the other modules |
//! | `continuation` | poles of the averaged records |
//! | `pole_grid`, `arx_poles` | poles in the range of human operators; poles by linear least squares |
//! | `shared_poles` | models with A and a noise model, or with A and F |
//! | `instrument_chain` | instrumental variables, and C and D from the residual |
//! | `broad_starts` | starts from the whole region of stability, for records with many minima |
//! | `c_drawn_inside` | starts for a search that ended with C on the unit circle |

pub mod arx_poles;
pub mod broad_starts;
pub mod c_drawn_inside;
pub mod continuation;
pub mod guesses;
pub mod instrument_chain;
pub mod pole_grid;
pub mod shared_poles;
