//! The analysis from recordings to a result and its verdict, implemented once for all callers.
//!
//! An estimator assumes that each sample is correct, and its error bars are valid only for its model. The reliability
//! of a result also depends on faults of the recording and their treatment, on a second fit without suspicious samples,
//! and on whether a person could have controlled the loop. These rules are implemented only here; the command line, the
//! analysis of groups and Python only parse options and show results.
//!
//! ```text
//! files -- Reading --> Recordings -- Identification { options }.run --> IdentifiedModel { fit, verdict, data, settings }
//! ```
//!
//! | step of [`Identification::run`] | rules |
//! |---|---|
//! | a file is examined before any option is chosen | `examination` |
//! | files are read (before `run` is called) | `files`, `reading`; the data and the account of their processing are in `recordings` |
//! | runs that were given twice are rejected | `duplicate_runs` |
//! | faults are searched for and repaired, the quality of the channels is assessed | `repair`, `quality` |
//! | a high sampling rate is reduced | `rate` |
//! | the describing function is estimated, if the excitation was recorded | `description`, `offset` |
//! | the model is fitted and checked by a second fit; the loop and the settings are added | `estimators`: one file per estimator |
//! | the findings on the recordings are added | `identified`, `recordings` |
//! | each answer is assessed, and the verdict on the requested answers is formed | `answers` |
//! | polynomials with several inputs | `several_inputs` |
//! | the operators of several axes, and their coupling | `axes` |
//! | a describing function is estimated from recordings and assessed | `describing` |
//! | a recursion processes a recording, and its trace is assessed | `tracking` |
//! | the level of u; the settings common to all estimators | `level`, `settings` |
//!
//! Options are set as fields, or as text by their names: `options`. [`registry`] lists all options.
//!
//! ```
//! use hoid_analysis::{Identification, Recordings};
//! use hoid_model::scenario::{Condition, Scenario};
//! use hoid_sim::{RunSeed, Simulator};
//!
//! let simulator = Simulator::new(&Scenario::condition(Condition::C1))?;
//! let record = simulator.run(RunSeed::default(), false)?;
//! let found = Identification::default().run(Recordings::from_records([record]))?;
//! let tau = found.fit.operator(0).parameters.iter().find(|p| p.name == "tau_e");
//! assert!(tau.is_some_and(|tau| (tau.value - 0.28).abs() < 0.02));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod answers;
mod axes;
mod describing;
mod description;
mod duplicate_runs;
mod error;
mod estimators;
mod examination;
mod fault_findings;
mod files;
mod identification;
mod identified;
pub mod json;
mod level;
mod names;
mod offset;
mod options;
mod prior;
mod quality;
mod rate;
mod reading;
mod recordings;
pub mod registry;
mod repair;
mod request;
mod settings;
mod several_inputs;
mod tracking;

pub use answers::{AnswerStatus, Answers};
pub use axes::{Axis, AxisPair, Coupling, axes, axes_json, check_axes};
pub use describing::{DescribingFunctionOptions, DescribingFunctionResult};
pub use description::Excitation;
pub use error::AnalysisError;
pub use estimators::{BatchEstimator, FittedModel, PolynomialFit, Polynomials};
pub use examination::{
    Advice, ExaminationOptions, FileExamination, Lag, OtherColumns, Periods, RecordSummary, Role, Roles, shell_command,
};
pub use fault_findings::FoundFault;
pub use identification::Identification;
pub use identified::{IdentifiedModel, ValidationResult, identify};
pub use offset::{output_delay_samples, without_offsets};
pub use prior::parse_prior;
pub use quality::SystemKind;
pub use rate::kept_rate_message;
pub use reading::Reading;
pub use recordings::{Account, Recordings};
pub use request::{Request, ResolvedRequest};
pub use settings::Setting;
pub use several_inputs::{SeveralInputsResult, parse_roles, several_inputs};
pub use tracking::{
    Tracking, TrackingResult, recursion_options_error, relative_errors, settings_of_recursion, two_inputs,
};
