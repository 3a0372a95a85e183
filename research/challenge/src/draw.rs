//! Seeds of a run, and the person who is drawn for it.
//!
//! Every run has a different person, so no method can know the parameters. The parameters are uniformly distributed
//! over the ranges of people (see [`hoid_sim::people`] for the sources), and the gain follows from a random crossover
//! frequency. A person is drawn again if the loop is unstable or poorly damped (`|1/(1 + Y P)|` above 3.5) before,
//! after or half-way through a change.

use std::{fmt, str::FromStr};

use hoid_model::{Complex64, ModelError, SampleTime, margins::closed_loop_is_stable};
use hoid_sim::{RunSeed, SimError};

use super::{
    case::{Case, DelayKnown, Form, Sampling},
    operator::{Operator, Plant},
};

/// Set of seeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seeds {
    /// Seeds for developing a method.
    Open,
    /// Seeds for evaluating a method, used once after its development.
    Sealed,
}

hoid_model::named_choice!(Seeds, "seeds of the challenge", 2, { Open => "open", Sealed => "sealed" });

impl Seeds {
    /// Returns the seed of all runs of the set.
    pub(super) fn seed(self) -> u64 {
        match self {
            Self::Open => 2_026_112_201,
            Self::Sealed => 7_305_118_846_190_275_513,
        }
    }
}

/// A run of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CaseRun {
    /// Set of seeds.
    pub seeds: Seeds,
    /// Number of the run.
    pub number: u64,
}

impl CaseRun {
    /// Returns a random stream of the run. The streams depend only on the name of the case, so cases can be added.
    pub(super) fn stream(self, case: &Case, tag: u64) -> RunSeed {
        // FNV-1a hash of the name.
        let name = case.name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        RunSeed {
            seed: self.seeds.seed(),
            cell: name.wrapping_add(tag),
            replication: self.number,
        }
    }
}

/// A part of the work, such as `2/7`: every seventh run, starting with the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Portion {
    index: usize,
    of: usize,
}

impl Portion {
    /// The whole work.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// True if item i belongs to the part.
    pub fn contains(self, i: usize) -> bool {
        i % self.of + 1 == self.index
    }
}

impl FromStr for Portion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let read = |(a, b): (&str, &str)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?));
        match text.split_once('/').and_then(read) {
            Some((index, of)) if (1..=of).contains(&index) => Ok(Self { index, of }),
            _ => Err(format!("part {text:?}: expected I/N with 1 <= I <= N, such as 2/7")),
        }
    }
}

impl fmt::Display for Portion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// Maximum number of draws for a run; if they do not suffice, no person can stabilise the case.
const MAX_DRAWS: usize = 2000;
const NUMBERS_PER_DRAW: usize = 10;
/// Largest permitted value of `|1/(1 + Y P)|`.
const MAX_SENSITIVITY: f64 = 3.5;
const PERSON_STREAM: u64 = 1;

/// Returns the person of a run; `attempt` is the number of earlier people who lost control in the simulation.
pub(super) fn draw_person(case: &Case, run: CaseRun, ts: SampleTime, attempt: usize) -> Result<Operator, SimError> {
    let numbers = run
        .stream(case, PERSON_STREAM)
        .uniform_numbers(NUMBERS_PER_DRAW * MAX_DRAWS);
    let mut left = attempt;
    for draw in numbers.chunks_exact(NUMBERS_PER_DRAW) {
        let Some(operator) = operator_from_draw(case, ts, draw)? else {
            continue;
        };
        if left == 0 {
            return Ok(operator);
        }
        left -= 1;
    }
    Err(SimError::NoAcceptablePerson {
        form: format!("{:?} of the case {}", case.form, case.name),
        plant: format!("{:?}", case.plant),
        draws: MAX_DRAWS,
    })
}

fn operator_from_draw(case: &Case, ts: SampleTime, draw: &[f64]) -> Result<Option<Operator>, SimError> {
    let between = |(low, high): (f64, f64), i: usize| low + (high - low) * draw[i];
    let (lead, delay, crossover) = match case.plant {
        Plant::Integrator => ((0.3, 0.7), (0.12, 0.22), (2.0, 4.0)),
        Plant::Unstable => ((0.3, 0.7), (0.1, 0.16), (2.5, 4.0)),
        // Each of the two leads is as long as the single lead for other second-order plants.
        Plant::Lagged if case.form == Form::Lead2Lag => ((0.5, 1.0), (0.14, 0.24), (1.2, 2.5)),
        Plant::Lagged => ((0.4, 0.9), (0.16, 0.28), (1.5, 2.8)),
        Plant::DoubleIntegrator => ((0.5, 1.5), (0.16, 0.3), (1.0, 2.2)),
    };
    let leads = match case.form {
        Form::Gain => 0,
        Form::Lead2Lag => 2,
        _ => 1,
    };
    let has_lag = matches!(case.form, Form::LeadLag | Form::Lead2Lag);
    let samples = between(delay, 1) / ts.s();
    let samples = match case.delay {
        DelayKnown::Whole => samples.round(),
        DelayKnown::Fraction => samples.floor() + 0.5,
        DelayKnown::No => samples,
    };
    let unit = Operator {
        gain: 1.0,
        lead_s: between(lead, 0),
        leads,
        lag_s: if has_lag { between((2.0, 8.0), 2) } else { 0.0 },
        omega_nm_rad_s: between((8.0, 14.0), 3),
        zeta_nm: between((0.15, 0.55), 4),
        third_s: if case.form == Form::ThirdOrder {
            between((0.05, 0.15), 5)
        } else {
            0.0
        },
        stick_rad_s: if case.form == Form::StickDynamics {
            between((20.0, 30.0), 6)
        } else {
            0.0
        },
        tau_e_s: samples * ts.s(),
    };
    let at = between(crossover, 7);
    let gain = 1.0 / (unit.response(at) * case.plant.response(at)).norm();
    let first = Operator { gain, ..unit };
    let mut states = vec![first];
    for shift in &case.operator_changes {
        let before = states[states.len() - 1];
        states.push(before.with_scaled_parameter(shift.parameter, shift.factor.sqrt()));
        states.push(before.with_scaled_parameter(shift.parameter, shift.factor));
    }
    // There are two holds; each adds half a sample of delay.
    let late = if case.sampling == Sampling::Held { ts.s() } else { 0.0 };
    for state in states {
        let state = Operator {
            tau_e_s: state.tau_e_s + late,
            ..state
        };
        if !is_stable_and_damped(&state, case.plant).map_err(SimError::Model)? {
            return Ok(None);
        }
    }
    Ok(Some(first))
}

/// True if the loop is stable and sufficiently damped.
fn is_stable_and_damped(operator: &Operator, plant: Plant) -> Result<bool, ModelError> {
    let sensitivity = |i: i32| {
        let omega = 0.1 * 10f64.powf(f64::from(i) / 40.0);
        let open_loop = operator.response(omega) * plant.response(omega);
        1.0 / (Complex64::from(1.0) + open_loop).norm()
    };
    if (0..=100).any(|i| sensitivity(i) > MAX_SENSITIVITY) {
        return Ok(false);
    }
    Ok(closed_loop_is_stable(&operator.open_loop(plant)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases;

    #[test]
    fn every_case_has_a_person_and_seeds_differ() {
        for case in cases() {
            let ts = SampleTime::new(1.0 / case.rate_hz).unwrap();
            let of = |seeds, number| {
                let person = draw_person(&case, CaseRun { seeds, number }, ts, 0);
                person.unwrap_or_else(|e| panic!("{}: {e}", case.name))
            };
            let (a, b) = (of(Seeds::Open, 0), of(Seeds::Open, 1));
            assert!(a != b && a != of(Seeds::Sealed, 0), "{}", case.name);
            assert_eq!(a, of(Seeds::Open, 0));
        }
    }

    #[test]
    fn portions_divide_the_work() {
        let parts: Vec<Portion> = ["1/3", "2/3", "3/3"].map(|t| t.parse().unwrap()).into();
        for i in 0..20 {
            assert_eq!(parts.iter().filter(|part| part.contains(i)).count(), 1);
        }
        for bad in ["0/3", "4/3", "x", "1"] {
            assert!(bad.parse::<Portion>().is_err());
        }
    }
}
