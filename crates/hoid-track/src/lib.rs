//! Recursive estimates: sample by sample, over a record or live.
//!
//! People change while they control. A recursion corrects the estimate at every sample by the prediction error,
//!
//! `theta(t) = theta(t-1) + P(t) psi(t) eps(t)`,
//!
//! and forgets the past, so it can follow changes (L. Ljung, *System Identification*, 1999, chapter 11). The methods
//! differ in psi, in the parameters theta, and in their prior for the changes in the person.
//!
//! ```
//! use hoid_model::scenario::{Condition, Scenario};
//! use hoid_sim::{RunSeed, Simulator};
//! use hoid_track::{Method, TrackOptions, track};
//!
//! let simulator = Simulator::new(&Scenario::condition(Condition::C4))?;
//! let record = simulator.run(RunSeed::default(), false)?;
//! let options = TrackOptions::default_for(Method::rpem(), 29).with(&[("memory_of", "b=4s")])?;
//! let trace = track(&record, &options, 100)?;
//!
//! // The task changes at 40.96 s, and K_e_dot rises from .036 to .084 s.
//! let last = trace.operator(trace.len() - 1)?;
//! assert!((last.k_e_dot.value - 0.084).abs() < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | `methods`, `method` | [`Method`]: the recursive methods, and their self-description |
//! | [`building`] | components of a method, for methods in other crates |
//! | `options`, `shared_options`, `memory`, `forgetting` | [`TrackOptions`]: the options of a recursion |
//! | `further_input` | [`TrackedInput`]: a second input of the person, with its response |
//! | `person_prior` | [`PersonPrior`]: prior knowledge of a person before the first sample |
//! | `request`, `plan` | [`TrackRequest`]: the request; [`TrackPlan`]: orders that are still open, searched on the start span |
//! | `setup`, `start`, `start_noise`, `gain` | components of a recursion: structure, start, forgetting |
//! | `kernel`, `recursion` | RLS and RPEM of the real-time kernel; the interface of every recursion |
//! | `predictor`, `history`, `reported` | signals and reports for methods that do not use the kernel |
//! | `response` | [`Response`]: gain and phase of an estimate at a frequency |
//! | `open_loop` | [`OpenLoop`]: crossover and phase margin of an estimate with the controlled element |
//! | `tracker`, `outcome`, `saved` | [`Tracker`]: estimate that takes one sample at a time; its state as numbers, to continue elsewhere |
//! | `live`, `stage` | [`Live`]: estimate from a stream, which is decimated if its rate is high; [`Stage`]: its warm-up, then its tracker |
//! | `guard` | exclusion of samples and spans that cannot come from tracking |
//! | `stationary` | handling of stationary signals in a recursion without a guard |
//! | `idle` | idle samples recorded before a run started |
//! | `over_record`, `two_sided` | [`track()`]: estimate over a record; two-sided estimate of a recorded run |
//! | `trace`, `columns`, `summary`, `as_text` | [`Trace`]: the estimate at every sample, as columns and as text |
//! | `diagnostics` | reliability of a trace and of a single estimate: [`Trace::verdict`] |
//! | `determined` | parameters that the data determine |
//! | `delay_bank` | tracking of a delay in whole samples, with any recursion |
//! | `validation` | prediction of another run by a trace; choice of the initial covariance by this measure |
//! | `change` | [`Change`]: a declared change in a person |
//!
//! **A recursion starts from the available knowledge.** For methods with a start fit this is by default the batch fit
//! of the first third of a record, with the covariance of that fit. Until the end of that span only the filters are
//! updated and the estimate is kept constant, so no sample counts twice and the error bars are valid. With the start of
//! the thesis, `P_0 = 0.1 I` (eq. 38, 5.41, 5.55), the estimate is updated from the first sample on.
//!
//! **Faulty samples** never reach the filters. A value is faulty if it is not a finite number or is larger than
//! [`TrackOptions::largest`]. A faulty error e is replaced by the last good value and a faulty output u by the one-step
//! prediction, and the estimate stays constant at that sample. These samples are counted. With a guard (option `guard`;
//! on by default for `adaptive`), outliers and spans that cannot come from tracking do not change the estimate either.

pub mod building;
mod change;
mod columns;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod delay_bank;
mod determined;
mod diagnostics;
mod display;
mod forgetting;
mod further_input;
mod gain;
mod guard;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod history;
mod idle;
mod kernel;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod live;
mod memory;
mod method;
mod methods;
mod open_loop;
mod options;
mod outcome;
mod over_record;
mod person_prior;
mod plan;
mod predictor;
mod recursion;
mod reported;
mod request;
mod response;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod saved;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod seal;
mod setup;
mod shared_options;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod stage;
mod start;
mod start_noise;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod stationary;
mod summary;
mod trace;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod tracker;
mod two_sided;
mod validation;

pub use change::{Change, ErrorThreshold};
pub use columns::{Columns, operator_parameter};
pub use determined::Determination;
pub use forgetting::ForgettingRule;
pub use further_input::{FURTHER_RESPONSES_RAD_S, FurtherOperator, RequestedInput, TrackedInput};
pub use guard::{GuardAction, GuardChannel, GuardChoice, GuardEvent, GuardKind, GuardOptions, TrackFault};
pub use idle::{default_start_span, idle_head};
pub use live::{ChooseOrders, DEFAULT_WARM_UP_S, Live};
pub use memory::{CommonMemory, Memory, MemoryOptions};
pub use method::RecursiveMethod;
pub use methods::{AdaptiveOptions, Method, RlsOptions, RpemOptions};
pub use open_loop::{NoCrossover, OpenLoop};
pub use options::TrackOptions;
pub use outcome::{Counts, Outcome};
pub use over_record::{track, track_from};
pub use person_prior::PersonPrior;
pub use plan::{TrackPlan, search_ranges};
pub use recursion::Sample;
pub use request::{RequestedStart, TrackRequest};
pub use response::Response;
pub use seal::{sealed, unsealed};
pub use setup::StartSource;
pub use shared_options::{BoundOptions, DelayOptions, GainOptions, StabilityOptions, WindupGuard};
pub use stage::{ChooseOptions, LiveOutcome, Stage, WarmUp};
pub use trace::{OPERATOR_COLUMNS, Trace};
pub use tracker::Tracker;
pub use validation::{CANDIDATE_COVARIANCES, CovarianceChoice, CovarianceUpdates, choose_covariance, track_validated};

/// Regressors of the recursions and choice of the polynomials that are kept stable, both from the kernel.
pub use hoid_core::{predictor::Regressor, recursion::StablePolynomials};
