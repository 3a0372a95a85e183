//! Human-operator identification: estimates a model of how a person controls a machine from the tracking error e and
//! the control output u.
//!
//! A pilot, driver or surgeon closes a control loop. In a given task, people behave approximately like a linear
//! operator with a remnant,
//!
//! `u = K_e (T_L s + 1) e^(-tau_e s) omega_nm^2/(s^2 + 2 zeta_nm omega_nm s + omega_nm^2) e + n`,
//!
//! and hoid estimates its parameters with standard errors: in batch, by the prediction error method on a Box-Jenkins
//! model `u = (B/F) q^-nk e + (1/D) eps`, and recursively, sample by sample. Batch and recursive methods work on
//! recorded and on simulated runs.
//!
//! This crate re-exports the other crates. The prelude contains the items that most programs need. From a file to a
//! report (feature `report`):
//!
//! ```no_run
//! use hoid::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let records = [read("run1.csv")?];                       // columns t, e and u
//! let person = identify(&records)?;                         // as `hoid identify`: the operator of a person
//! println!("{person}");                                     // its verdict, and its parameters
//! let choice = identify_box_jenkins(&records)?;             // polynomials; delay and noise order by BIC
//! println!("{}", choice.fit.validate(&records[0])?);
//!
//! let options = TrackOptions::without_prior(Method::default(), records[0].sample_time());
//! let trace = track(&records[0], &options, 10)?;            // as `hoid track`: every tenth sample
//! println!("{trace}");
//!
//! let page = Report::of("Run 1", &records, &choice).to_html()?;
//! write_report("report".as_ref(), &page)?;
//! # Ok(())
//! # }
//! ```
//!
//! A simulated run with known true values:
//!
//! ```
//! use hoid::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let simulator = Simulator::new(&Scenario::condition(Condition::C1))?;
//! let record = simulator.run(RunSeed { seed: 1, ..RunSeed::default() }, false)?;
//!
//! // Options are typed. Two forms are compared, at the lines of the target and by prediction error.
//! let family = FamilyEstimator {
//!     forms: vec![Form::Gain, Form::Lead],
//!     excitation: Some("f_t".to_owned()),
//!     ..FamilyEstimator::default()
//! };
//! let person: FamilyFit = family.fit(std::slice::from_ref(&record))?;
//! assert_eq!(person.form, Form::Lead);
//!
//! let orders = Structure::BoxJenkins.operator_orders(29);
//! let fit = Estimator::new(Structure::BoxJenkins, orders).fit(&[record])?;
//! let omega = fit.operator()?.omega_nm_rad_s;
//! assert!((omega.value - 11.25).abs() < 4.0 * omega.standard_error.unwrap_or(0.0));
//! # Ok(())
//! # }
//! ```
//!
//! | feature | contents | default |
//! |---|---|---|
//! | none | [`model`], [`ident`], [`track`], [`sim`]: models, estimators and simulation | |
//! | `io` | [`io`]: files; [`analysis`]: analysis of recordings, with a verdict | yes |
//! | `study` | [`study`]: Monte Carlo studies and groups of runs | |
//! | `report` | [`report`]: figures and HTML pages; includes `study` | |
//! | `thesis` | [`thesis`]: reproduction of the thesis; includes `report` | |
//! | `pdf-png` | figures as PDF and PNG; includes `report` | |
//!
//! With `default-features = false` the code for reading files is not compiled.

#[cfg(feature = "io")]
pub use hoid_analysis as analysis;
pub use hoid_core as core;
#[cfg(feature = "study")]
pub use hoid_design as design;
pub use hoid_ident as ident;
#[cfg(feature = "io")]
pub use hoid_io as io;
pub use hoid_lanes as lanes;
pub use hoid_model as model;
pub use hoid_numerics as numerics;
#[cfg(feature = "report")]
pub use hoid_report as report;
pub use hoid_sim as sim;
#[cfg(feature = "study")]
pub use hoid_study as study;
#[cfg(feature = "survey")]
pub use hoid_survey as survey;
#[cfg(feature = "thesis")]
pub use hoid_thesis as thesis;
pub use hoid_track as track;

/// Items that most programs need, for reading, identification, validation, tracking, reports and simulation.
pub mod prelude {
    #[cfg(feature = "io")]
    pub use hoid_analysis::{Identification, IdentifiedModel, Recordings, identify};
    pub use hoid_ident::{
        Choice, Constraint, Estimator, Fit, GreyBox, IdentError, InitialState, OrderRanges, choose_orders,
        family::{FamilyEstimator, FamilyFit, OperatorPrior},
        identify_box_jenkins,
    };
    #[cfg(feature = "io")]
    pub use hoid_io::{ReadOptions, read, read_record, write_record};
    pub use hoid_model::{
        Channel, FamilyOperator, Form, OperatorParameters, Orders, PolynomialModel, Record, SampleTime, Structure,
        scenario::{Condition, Scenario},
        uncertainty::{Estimate, OperatorEstimate},
    };
    #[cfg(feature = "report")]
    pub use hoid_report::{Report, TrackReport, write_report};
    pub use hoid_sim::{RunSeed, Simulator};
    #[cfg(feature = "study")]
    pub use hoid_study::{Plan, RunOptions, run as run_study};
    pub use hoid_track::{Memory, Method, Sample, StartSource, Trace, TrackOptions, Tracker, track};
}

/// The Rust examples of the book; `python/tests/test_book.py` runs the other code blocks of the book.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../../../docs/src/methods/grey-box.md")]
    struct GreyBox;
    #[doc = include_str!("../../../docs/src/methods/instruments.md")]
    struct Instruments;
    #[doc = include_str!("../../../docs/src/methods/people.md")]
    struct People;
    #[doc = include_str!("../../../docs/src/methods/time-varying.md")]
    struct TimeVarying;
}
