//! A tracking experiment in the browser, identified online and verified afterwards.
//!
//! The page computes the controlled element at 1 ms from tables that are made here, logs every input event, tick and
//! frame, and sends them in batches. Here they are appended to the folder of the session, passed to the tracker, and
//! recomputed to the last bit after the run.
//!
//! | module | contents |
//! |---|---|
//! | [`config`] | [`Config`]: the experiment, `lab.toml` |
//! | [`course`] | [`Course`](course::Course): the controlled element at each time |
//! | [`order`] | the order of the runs, by Latin squares |
//! | [`task`] | [`Task`](task::Task): a run as tables, and its recomputation |
//! | [`plant`] | the arithmetic of a tick, twin of the page's |
//! | [`session`] | the folder: files that are appended to, files written at once, resumption of a session |
//! | [`verify`] | [`check`](verify::check): verified, or unverified and why |
//! | [`record`] | a run as a record for all commands of hoid |
//! | [`live`], [`lag`] | the estimate while the run continues, the lag of the person besides |
//! | [`wire`] | messages between page and server |
//! | [`lab`] | [`Lab`]: the experiment as its pages see it |
//! | [`server`] | [`Server`]: HTTP and sockets on 127.0.0.1 |
//! | `experiment`, `export`, `replay`, `reports` | files next to the sessions; archives; replay of runs; pages |
//! | [`calibrate`] | the delay added by the loop of page and events |

// Numbers of a page or a file are never an index, a length or a summand before they are checked.
#![cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]

pub mod calibrate;
pub mod config;
pub mod course;
mod error;
mod experiment;
mod export;
pub mod lab;
pub mod lag;
pub mod live;
pub mod order;
pub mod plant;
pub mod record;
mod replay;
mod reports;
pub mod server;
pub mod session;
pub mod task;
mod utc;
pub mod verify;
pub mod wire;

pub use config::Config;
pub use error::LabError;
pub use lab::{Lab, Mode};
pub use server::Server;
