//! Errors of the design of an experiment.

use hoid_io::{IoError, ScenarioFileError};
use hoid_model::{Form, ModelError};

use hoid_study::StudyError;
use thiserror::Error;

use super::EntryPoint;

/// Reason why an experiment cannot be designed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A number is out of range.
    #[error("{quantity} is {found}, expected {expected}")]
    OutOfRange {
        /// Name of the quantity.
        quantity: &'static str,
        /// The value found.
        found: f64,
        /// The admissible values.
        expected: &'static str,
    },
    /// The loop has no crossover.
    #[error(
        "the loop gain does not cross 1 from above between 0.01 and 100 rad/s: change the gain of the person, or the units of the controlled element"
    )]
    NoCrossover,
    /// The lines do not determine the parameters of the person.
    #[error(
        "{lines} lines do not determine {coordinates} parameters, because each line gives two numbers: add lines, and spread them over the frequencies at which the person responds"
    )]
    NotIdentifiable {
        /// Number of lines.
        lines: usize,
        /// Number of parameters of the person.
        coordinates: usize,
    },
    /// The band has no room for the lines.
    #[error(
        "the band has room for only {found} of the {requested_lines} lines, which must be {spacing} multiples of the \
         fundamental apart and not harmonics of each other: give fewer lines (--lines), a wider band (--band), a \
         longer run (--length), or a smaller spacing (--spacing)"
    )]
    NoRoom {
        /// Number of lines requested.
        requested_lines: usize,
        /// Number of lines that fit into the band.
        found: usize,
        /// Smallest distance between two lines, in multiples of the fundamental.
        spacing: u32,
    },
    /// The requested quantity is not a quantity of the person.
    #[error("{name} is not a quantity of this person; expected one of {expected}")]
    NotThere {
        /// Name of the requested quantity.
        name: String,
        /// Names of the available quantities.
        expected: String,
    },
    /// The number given for a quantity cannot be read.
    #[error("{found:?} is not a {what}; write NAME=5% or NAME=0.05, such as tau_e=5%")]
    Unreadable {
        /// The expected text.
        what: &'static str,
        /// The text found.
        found: String,
    },
    /// The controlled element of the people is not known.
    #[error("the controlled element is not known from {people}: add it (--controlled-element), such as 90/(s(s+6))")]
    NoElement {
        /// Source of the people.
        people: String,
    },
    /// People have no typical response to a displayed target with this controlled element.
    #[error(
        "no typical response to a visible target is known for {element}: give a person with [feedforward] (--people scenario.toml), design the disturbance alone (--disturbance), or design for a compensatory display"
    )]
    NoFeedforward {
        /// The controlled element.
        element: String,
    },
    /// A forcing function for comparison lacks lines that the design has.
    #[error(
        "{name} has no lines for a {missing}; expected a scenario with lines for each forcing function of the design: [target], [disturbance], or both for a display that shows the target"
    )]
    OneForcing {
        /// Name of the forcing function.
        name: String,
        /// Point of entry at which lines are missing.
        missing: EntryPoint,
    },
    /// A form is given although the people already have a form.
    #[error("the form {form} was given, but {people} has its own; omit the form, or design for the population")]
    FormOfPeople {
        /// Source of the people.
        people: String,
        /// The form given.
        form: Form,
    },
    /// The form has no typical values.
    #[error(
        "no typical values are known for the form {form}: expected gain, lead, lead2, lag, lead-lag or lead2-lag, or a file with a person of that form"
    )]
    NoTypicalPerson {
        /// The form given.
        form: Form,
    },
    /// The typical person cannot control this element.
    #[error(
        "with {element}, no gain of the form {form} gives a stable loop with a phase margin of 15 deg and a crossover of .3 to 5 rad/s: choose another form, or give a person who can control it (a scenario or a fit)"
    )]
    NotControlled {
        /// The controlled element.
        element: String,
        /// Form of the operator.
        form: Form,
    },
    /// The source does not contain people.
    #[error(
        "{people_source} does not contain people to design for ({reason}); expected population, a scenario, a fit (identify --json), a directory that `hoid group DIR --out` wrote, or its population.json"
    )]
    NoPeople {
        /// Source of the people.
        people_source: String,
        /// The problem with the source.
        reason: String,
    },
    /// The given condition is not one of the group, or no condition is given although the group has several.
    #[error(
        "the group has several conditions, but the given condition is {found}: choose one of {expected} (--condition)"
    )]
    Condition {
        /// The condition given.
        found: String,
        /// The conditions of the group.
        expected: String,
    },
    /// The file does not provide the standard deviation, over people, of a difference.
    #[error(
        "{path} contains no spread of {name} between people ({reason}); expected a comparison that contains it (`hoid \
         compare --of {name} --json`), the result of a group with several conditions, a population.json, or a number, \
         such as 0.1"
    )]
    NoSpread {
        /// Path of the file.
        path: String,
        /// Name of the quantity.
        name: String,
        /// The problem with the file.
        reason: String,
    },
    /// The file does not provide the variation of people from run to run.
    #[error(
        "{path} contains no variation from run to run ({reason}); expected the directory of `hoid group` with three \
         or more runs per person and condition, or a number, such as 0.13"
    )]
    NoRunToRun {
        /// Path of the file.
        path: String,
        /// The problem with the file.
        reason: String,
    },
    /// The scenario is one of the thesis, which has no operator of the family.
    #[error("{path} is a scenario of the thesis; give one with the key form, such as form = \"lead\"")]
    OtherScenario {
        /// Path of the scenario.
        path: String,
    },
    /// The table contains no lines.
    #[error(
        "{path} contains no forcing function: its columns are {found}, expected omega_rad_s, amplitude and phase_rad"
    )]
    NoLines {
        /// Path of the table.
        path: String,
        /// Names of the columns found.
        found: String,
    },
    /// A file cannot be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] ScenarioFileError),
    /// The tables of a group cannot be read.
    #[error(transparent)]
    Study(Box<StudyError>),
    /// The operator or element is invalid, or the loop is unstable.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl DesignError {
    /// True if the error is in the request, not in the data.
    pub fn is_request_error(&self) -> bool {
        !matches!(
            self,
            Self::NoCrossover
                | Self::NotIdentifiable { .. }
                | Self::NotControlled { .. }
                | Self::NoPeople { .. }
                | Self::NoLines { .. }
                | Self::Io(_)
                | Self::Scenario(_)
                | Self::Study(_)
                | Self::Model(_)
        )
    }
}

impl From<StudyError> for DesignError {
    fn from(error: StudyError) -> Self {
        Self::Study(Box::new(error))
    }
}
