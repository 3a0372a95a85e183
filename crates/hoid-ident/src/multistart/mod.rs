//! Searches from several starts by reverse communication: the caller evaluates the criterion, so the searches for
//! several records can run in parallel lanes.
//!
//! | module | contents |
//! |---|---|
//! | `start` | a start of a search, with its unknown polynomials |
//! | `searches` | searches from the best starts, and the lowest minimum |
//! | `linearisation_client` | interface of a search: it requests one linearisation after another |

mod linearisation_client;
mod searches;
mod start;

pub(crate) use linearisation_client::LinearisationClient;
pub(crate) use searches::MultiStart;
pub(crate) use start::Start;
