//! Tracking experiments in the browser, with online identification and subsequent verification.
//!
//! The page simulates the controlled element in steps of 1 ms from tables computed by this crate. It logs every input
//! event, tick and frame, and sends them in batches. This crate appends the batches to the folder of the session,
//! passes them to the tracker, and after the run recomputes every tick bit for bit.
//!
//! | module | contents |
//! |---|---|
//! | [`config`] | [`Config`]: the experiment, `lab.toml` |
//! | [`task_definition`] | [`TaskDefinition`](task_definition::TaskDefinition): the controlled element as a function of time |
//! | [`order`] | the order of the runs, from Latin squares |
//! | [`task`] | [`Task`](task::Task): the tables of a run, and its recomputation |
//! | [`plant`] | the arithmetic of a tick, identical to that of the page |
//! | [`session`] | the folder of a session: appended files, files written as a whole, resumption |
//! | [`verify`] | [`check`](verify::check): verification of a run, with the reasons if it is unverified |
//! | [`record`] | conversion of a run to a record for all commands of hoid |
//! | [`live`], [`lag`] | the live estimate during a run; the estimate of the lag of the person |
//! | [`wire`] | messages between the page and the server |
//! | [`lab`] | [`Lab`]: the experiment as its pages interact with it |
//! | [`server`] | [`Server`]: HTTP and sockets on 127.0.0.1 |
//! | `experiment`, `export`, `replay`, `reports` | files outside the sessions; archives; replay of runs; result pages |
//! | [`calibrate`] | the delay that the page, its frames and its events add to the loop |

// Numbers from a page or a file are checked before they are used as an index, a length or a summand.
#![cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]

pub mod calibrate;
pub mod config;
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
pub mod task_definition;
mod utc;
pub mod verify;
pub mod wire;

pub use config::Config;
pub use error::LabError;
pub use lab::{Lab, Mode};
pub use server::Server;
