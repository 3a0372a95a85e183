//! The people that are drawn, and their runs.

use hoid::{
    model::{FamilyOperator, FamilyState},
    prelude::*,
    sim::{
        FamilySimulator, SimError,
        people::{Person, Plant, Population, RemnantKind, Task},
    },
};

/// Spread of parameters between the runs of a person: standard deviation of the logarithm.
pub const RUN_TO_RUN_SPREAD: f64 = 0.06;
const RUN_COUNTS: [usize; 4] = [1, 2, 5, 10];
/// Largest number of draws of the gain of a run before its loop counts as unstable.
const MAX_DRAWS: usize = 50;

/// Parameters that differ between the runs of a person.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// Only the remnant differs.
    None,
    /// The gain differs.
    Gain,
    /// All parameters differ independently.
    All,
}

impl Spread {
    pub const ALL: [Self; 3] = [Self::None, Self::Gain, Self::All];

    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Gain => "gain 6 %",
            Self::All => "all 6 %",
        }
    }
}

/// The conditions of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    pub plant: Plant,
    pub kind: RemnantKind,
    pub rate_hz: u32,
    pub runs: usize,
    pub spread: Spread,
}

impl Cell {
    /// Returns the conditions of the person with this number. All 360 combinations occur in turn, since 5 and 72 have
    /// no common divisor.
    pub fn of(person: u64) -> Self {
        let i = person as usize;
        Self {
            plant: Plant::ALL[i % 3],
            runs: RUN_COUNTS[i / 3 % 4],
            rate_hz: [60, 100][i / 12 % 2],
            spread: Spread::ALL[i / 24 % 3],
            kind: RemnantKind::ALL[i % 5],
        }
    }
}

/// Returns the person with this number, and their runs.
///
/// # Errors
/// As [`Person::draw`] and [`Person::run`].
pub fn simulate_person(seed: u64, number: u64) -> Result<(Cell, Person, Vec<Record>), SimError> {
    let cell = Cell::of(number);
    let task = Task {
        sample_time: SampleTime::new(1.0 / f64::from(cell.rate_hz))?,
        spread_between_runs: if cell.spread == Spread::All {
            RUN_TO_RUN_SPREAD
        } else {
            0.0
        },
        ..Task::default()
    };
    let person = Person::draw(&Population::default(), &task, cell.plant, None, cell.kind, seed, number)?;
    let run = |run: u64| match cell.spread {
        Spread::Gain => run_with_gain(&person, run),
        Spread::None | Spread::All => Ok(person.run(run)?.record),
    };
    let records = (0..cell.runs as u64).map(run).collect::<Result<_, _>>()?;
    Ok((cell, person, records))
}

/// Simulates a run whose gain is the gain of the person multiplied by `exp(b z)`.
fn run_with_gain(person: &Person, run: u64) -> Result<Record, SimError> {
    let streams = person.run_seed(run);
    // The seed differs from the seed of the rest of the run.
    let deviates = RunSeed {
        seed: !streams.seed,
        ..streams
    }
    .white_noise(MAX_DRAWS);
    let mut refusal = None;
    for z in deviates {
        let operator = &person.state.operator;
        let mut coordinates = operator.coordinates().to_vec();
        coordinates[0] *= (RUN_TO_RUN_SPREAD * z).exp();
        let state = FamilyState {
            operator: FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &coordinates)?,
            ..person.state.clone()
        };
        let mut scenario = person.scenario().clone();
        scenario.initial = state.clone();
        scenario.last = state;
        match FamilySimulator::new(&scenario).and_then(|simulator| simulator.run(streams, false)) {
            Ok(record) => return Ok(record),
            Err(error) => refusal = Some(error),
        }
    }
    Err(refusal.unwrap_or(SimError::NoAcceptablePerson {
        form: person.state.operator.form().to_string(),
        plant: person.plant.to_string(),
        draws: MAX_DRAWS,
    }))
}
