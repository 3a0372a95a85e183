//! Errors of the design of an experiment.

use hoid_io::{IoError, ScenarioFileError};
use hoid_model::{Form, ModelError};

use hoid_study::StudyError;
use thiserror::Error;

use super::Enters;

/// Errors of the design of an experiment.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A number out of range.
    #[error("{quantity} is {found}, expected {expected}")]
    OutOfRange {
        /// Name of the quantity.
        quantity: &'static str,
        /// The value found.
        found: f64,
        /// The admissible values.
        expected: &'static str,
    },
    /// A loop without a crossover.
    #[error(
        "the gain of the loop does not fall through one between 0.01 and 100 rad/s: give the person another gain, or other units of the element"
    )]
    NoCrossover,
    /// Lines that do not determine the parameters of the person.
    #[error(
        "{lines} lines do not determine {coordinates} parameters: add lines, each of which gives two numbers, and spread them over the frequencies at which the person works"
    )]
    NotIdentifiable {
        /// Number of lines.
        lines: usize,
        /// Number of parameters of the person.
        coordinates: usize,
    },
    /// A band without room for the lines.
    #[error(
        "the band has room for only {found} of the {asked} lines, which must be {spacing} multiples of the fundamental \
         apart and no harmonics of each other: give fewer lines (--lines), a wider band (--band), a longer run \
         (--length), or a smaller spacing (--spacing)"
    )]
    NoRoom {
        /// Number of lines that were asked for.
        asked: usize,
        /// Number of lines that were found.
        found: usize,
        /// The distance.
        spacing: u32,
    },
    /// A requested quantity that is not a parameter of the person.
    #[error("{name} is not a quantity of this person; expected one of {expected}")]
    NotThere {
        /// Name of the requested quantity.
        name: String,
        /// The available quantities.
        expected: String,
    },
    /// A quantity with a number that cannot be read.
    #[error("{found:?} is not a {what}; write NAME=5% or NAME=0.05, such as tau_e=5%")]
    Unreadable {
        /// The value expected.
        what: &'static str,
        /// The text found.
        found: String,
    },
    /// People whose controlled element is not known.
    #[error("the controlled element is not known from {people}: add it (--controlled-element), such as 90/(s(s+6))")]
    NoElement {
        /// Source of the people.
        people: String,
    },
    /// A form of the response to the target that no typical person has.
    #[error(
        "with {element} people have no typical response to a target that they see: give a person with [feedforward] (--people scenario.toml), design the disturbance alone (--disturbance), or for a compensatory display"
    )]
    NoFeedforward {
        /// The controlled element.
        element: String,
    },
    /// A forcing function without lines that the design has.
    #[error(
        "{name} has no lines of a {missing}; expected a scenario with those of each forcing function of the design: [target], [disturbance], or both for a display that shows the target"
    )]
    OneForcing {
        /// The forcing function.
        name: String,
        /// The lines that it lacks.
        missing: Enters,
    },
    /// A form that is given together with people who have their own.
    #[error("the form {form} was given, but {people} has its own; leave the form out, or design for the population")]
    FormOfPeople {
        /// Source of the people.
        people: String,
        /// The form.
        form: Form,
    },
    /// A form without typical values.
    #[error(
        "people have no typical values of the form {form}: expected gain, lead, lead2, lag, lead-lag or lead2-lag, or a person of that form from a file"
    )]
    NoTypicalPerson {
        /// The form.
        form: Form,
    },
    /// An element that the population does not control.
    #[error(
        "with {element} no gain of the form {form} makes a stable loop with a phase margin of 15 deg and a crossover of .3 to 5 rad/s: give another form, or a person who controls it (a scenario or a fit)"
    )]
    NotControlled {
        /// The controlled element.
        element: String,
        /// The form.
        form: Form,
    },
    /// A source without people.
    #[error(
        "{place} holds no people to design for ({reason}); expected population, a scenario, a fit (identify --json), a directory that `hoid group DIR --out` wrote, or its population.json"
    )]
    NoPeople {
        /// The source.
        place: String,
        /// The problem.
        reason: String,
    },
    /// No condition, or an unknown one, of a group with several.
    #[error("the group has several conditions, and the given one is {found}: choose one (--condition) of {expected}")]
    Condition {
        /// The given condition.
        found: String,
        /// The conditions of the group.
        expected: String,
    },
    /// A file without the spread of a difference between people.
    #[error(
        "{path} has no spread between people of {name} ({reason}); expected a comparison with it (`hoid compare --of \
         {name} --json`), the result of a group with several conditions, a population.json, or a number, such as 0.1"
    )]
    NoSpread {
        /// The file.
        path: String,
        /// The quantity.
        name: String,
        /// The problem.
        reason: String,
    },
    /// A scenario of the thesis, which has no operator of the family.
    #[error("{path} is a scenario of the thesis; write one with the key form, such as form = \"lead\"")]
    OtherScenario {
        /// The file.
        path: String,
    },
    /// A table without lines.
    #[error("{path} holds no forcing function: its columns are {found}, expected omega_rad_s, amplitude and phase_rad")]
    NoLines {
        /// The file.
        path: String,
        /// The columns found.
        found: String,
    },
    /// A file that cannot be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A scenario that cannot be read.
    #[error(transparent)]
    Scenario(#[from] ScenarioFileError),
    /// The tables of a group that cannot be read.
    #[error(transparent)]
    Study(Box<StudyError>),
    /// An invalid operator or element, or an unstable loop.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl DesignError {
    /// True if the request is wrong, and not the data.
    pub fn is_of_request(&self) -> bool {
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
