//! Accepted input. The texts here are the help pages; each option states its default and unit.
//!
//! | module | options of |
//! |---|---|
//! | `cli` | the program: its commands |
//! | `simulate` | `hoid demo`, `hoid simulate`, `hoid margins` |
//! | `identify` | `hoid identify` |
//! | `describe` | `hoid describe` |
//! | `recursion`, `settings`, `udp` | `hoid track`, `hoid stream`; the options of the methods, from the registry |
//! | `reading` | all commands that read records |
//! | `examination` | what `hoid info` and `hoid group init` look for in files |
//! | `convert` | `hoid convert`, `hoid info` |
//! | `fmu` | `hoid fmu` |
//! | `figure` | figures as files |
//! | `output_options` | how results are shown |
//! | `lab` | `hoid lab` |
//! | `shell` | `hoid completions`, `hoid man` |
//! | `help` | all commands: contents of `-h`, headings, examples |
//! | `compare`, `design` | `hoid compare`, `hoid design` |
//! | `group`, `study` | `hoid group`, `hoid simulate-group`; `hoid study`, `hoid reproduce` |

mod choices;
mod cli;
mod compare;
mod convert;
mod describe;
mod design;
mod examination;
mod figure;
mod fmu;
mod group;
mod help;
mod identify;
mod lab;
mod output_options;
mod parse;
mod reading;
mod recursion;
mod settings;
mod shell;
mod simulate;
mod study;
mod udp;

pub use cli::{Cli, Command};
pub use compare::CompareArgs;
pub use convert::{ConvertArgs, InfoArgs};
pub use describe::DescribeArgs;
pub use design::DesignArgs;
pub use fmu::{FmuArgs, OperatorChoice};
pub use group::{GroupArgs, GroupCommand, GroupInitArgs, GroupRunArgs, SimulateGroupArgs};
pub use help::command;
pub use identify::IdentifyArgs;
pub use lab::LabArgs;
pub use output_options::ShowArgs;
pub use parse::parse_span;
pub use reading::{MaskArgs, ReadArgs};
pub use recursion::{RecursionArgs, StreamArgs, TrackArgs};
#[cfg(test)]
pub use settings::with_settings;
pub use settings::{as_text, flag, methods_with};
pub use shell::{CompletionsArgs, ManArgs};
pub use simulate::{DemoArgs, MarginsArgs, ScenarioChoice, SimulateArgs, StateName};
pub use study::{ReproduceArgs, StudyCommand, StudyMergeArgs, StudyRunArgs};
pub use udp::UdpAddresses;
