//! Searches from several starts, driven from outside: what they need of the criterion is given to
//! them, so that the searches of several records can run side by side.
//!
//! | module | contents |
//! |---|---|
//! | `start` | a start of a search, and which of its polynomials are still to be found |
//! | `searches` | the searches from the best starts, and the lowest minimum |
//! | `linearisation_client` | what is driven: one theta after the other, and the linearisation there |

mod linearisation_client;
mod searches;
mod start;

pub(crate) use linearisation_client::LinearisationClient;
pub(crate) use searches::MultiStart;
pub(crate) use start::Start;
