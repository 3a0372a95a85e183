//! Analysis of recorded runs of several subjects: from a directory of files to a group result.
//!
//! | module | contents |
//! |---|---|
//! | [`Manifest`] | assignment of files to subjects and runs, and how each run is processed |
//! | [`ReadSettings`], [`PreparationSettings`], [`AnalysisSettings`], [`ConditionSettings`] | its tables: how runs are read, prepared and analysed, and the prior knowledge of a condition |
//! | [`ConditionElement`] | controlled elements of conditions as one text |
//! | [`inspect`], [`commented`] | a manifest completed by what the files state, with the evidence |
//! | [`Pattern`] | subject, condition and run from names of files |
//! | [`run_group`] | the analysis in a directory, part by part |
//! | `reading` | runs from files, and the processing of them; one of them: [`RecordedRun`] |
//! | `analysis` | analysis of the runs of a person in a condition (`block`) and of single runs: their `windows`, orders (`run_orders`) and rows (`run_rows`) |
//! | `family_fits`, [`Person`], [`PersonChannel`] | the operator of a person in a condition, its responses to further inputs, and its row in the table of people (`parameter_columns`) |
//! | [`RunEstimates`] | estimates of each run, read back from the tables |
//! | [`GroupSummary`] | failures, people, and the verdict on the whole group |
//! | `traces` | its recursive estimates as rows |
//! | `responses` | frequency responses of the fits |
//! | [`VirtualExperiment`] | the same from simulated subjects, with the defects of recorded data ([`SamplingDefect`]) |
//! | [`PeopleExperiment`] | the same from persons drawn over the family of operators |
//! | `virtual_files` | the files of either |
//! | `frequency` | describing functions by subject and condition, and how far the fits are from them |
//! | `settling` | how fast the recursions follow a change at a known instant, and how noisy they are |
//! | `averages` | means over the runs, chosen delays, averages of traces |
//! | `join` | the tables of the group from those of its runs |
//!
//! Each run is stored as a part on disk, like a block of a study, and so are the joint results of all runs of a person
//! in a condition, which are computed first. A stopped group can therefore continue, and only the estimates and
//! responses of a run remain in memory; traces are averaged for one person in one condition at a time.

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
pub use inspection::{Evidence, commented, inspect};
pub use manifest::{MANIFEST, Manifest, RunEntry};
pub use pattern::{FileNameParts, Pattern};
pub use person::{FormEvidence, Person, PersonStatus};
pub use person_channel::PersonChannel;
pub use preparation_settings::{NumberOrText, PreparationSettings};
pub use read_settings::{Detrending, FaultTreatment, ReadSettings};
pub use reading::RecordedRun;
pub use run::{has_results, run_group};
pub use run_estimates::RunEstimates;
pub use sampling_defects::SamplingDefect;
pub use summary::{GroupSummary, RunFailure};
pub use virtual_people::{PeopleExperiment, simulate_people};
pub use virtual_subjects::{VirtualExperiment, simulate_group};
