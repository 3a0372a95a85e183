//! Analysis of recorded runs of several subjects: from a directory of files to a group result.
//!
//! | module | contents |
//! |---|---|
//! | [`Manifest`] | assignment of files to subjects and runs, and settings for processing the runs |
//! | [`ReadSettings`], [`PreparationSettings`], [`AnalysisSettings`], [`ConditionSettings`] | tables of the manifest: settings for reading, preparing and analysing the runs, and known properties of a condition |
//! | [`ConditionElement`] | controlled elements of conditions in text form |
//! | [`inspect`], [`with_comments`] | manifest completed from the contents of the files, with the evidence |
//! | [`Pattern`] | subject, condition and run from file names |
//! | [`run_group`] | analysis of a group in a directory, part by part |
//! | `reading` | reading and preparation of runs; a single run: [`RecordedRun`] |
//! | `analysis` | analysis of the runs of a person in a condition (`block`) and of single runs: windows (`windows`), orders (`run_orders`) and table rows (`run_rows`) |
//! | `family_fits`, [`Person`], [`PersonChannel`] | the operator of a person in a condition, its responses to further inputs, and its row in the table of people (`parameter_columns`) |
//! | [`RunEstimates`] | estimates of each run, read back from the tables |
//! | [`GroupSummary`] | failures, people, and the verdict on the group as a whole |
//! | `traces` | recursive estimates as table rows |
//! | `responses` | frequency responses of the fits |
//! | [`VirtualExperiment`] | a group of simulated subjects, with the defects of recorded data ([`SamplingDefect`]) |
//! | [`PeopleExperiment`] | a group of virtual people drawn from the family of operators |
//! | `virtual_files` | files of both kinds of virtual experiment |
//! | `frequency` | describing functions by subject and condition, and distances of the fits from them |
//! | `settling` | settling times of the recursions after a change at a known time, and their noise |
//! | `averages` | means over the runs, chosen delays, averaged traces |
//! | `join` | joining of the parts into the tables of the group |
//!
//! The results of each run are stored as a part on disk, like a block of a study. The joint results of all runs of a
//! person in a condition are also stored as a part; they are computed first. The analysis of a group can therefore be
//! stopped and continued. Only the estimates and responses of the runs remain in memory; traces are averaged for one
//! person in one condition at a time.

mod analysis;
mod analysis_settings;
mod averages;
mod block;
mod condition_element;
mod condition_settings;
mod family_fits;
mod frequency;
mod inspection;
mod join;
mod manifest;
mod manifest_names;
mod parameter_columns;
mod pattern;
mod person;
mod person_channel;
mod preparation_settings;
mod read_settings;
mod reading;
mod responses;
mod run;
mod run_estimates;
mod run_orders;
mod run_rows;
mod sampling_defects;
mod settling;
mod summary;
mod tables;
mod traces;
mod virtual_files;
mod virtual_people;
mod virtual_subjects;
mod windows;

pub use analysis_settings::AnalysisSettings;
pub use condition_element::ConditionElement;
pub use condition_settings::ConditionSettings;
pub use inspection::{Evidence, inspect, with_comments};
pub use manifest::{MANIFEST_FILE, Manifest, RunEntry};
pub use pattern::{FileNameParts, Pattern};
pub use person::{FormEvidence, Person, PersonStatus};
pub use person_channel::PersonChannel;
pub use preparation_settings::{NumberOrText, PreparationSettings};
pub use read_settings::{Detrending, FaultTreatment, ReadSettings};
pub use reading::RecordedRun;
pub use run::{has_results, run_group};
pub use run_estimates::RunEstimates;
pub use sampling_defects::SamplingDefect;
pub use summary::{GroupSummary, RunFailure, RunFault};
pub use virtual_people::{PeopleExperiment, simulate_people};
pub use virtual_subjects::{VirtualExperiment, simulate_group};
