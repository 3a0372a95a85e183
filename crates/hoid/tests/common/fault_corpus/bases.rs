//! The runs without faults, and their true values.
//!
//! Each case has a run of condition C1 and one of C2 of the thesis, and a virtual person with one to three runs. The
//! number of the case determines the form, the remnant, the plant and the rate, and whether the disturbance was
//! recorded. People who change (C3 to C6) are omitted, because their true values are not constant.

use hoid::{
    model::{FamilyOperator, Form},
    prelude::*,
    sim::{
        SimError,
        people::{Person, Plant, Population, RemnantKind, Task},
    },
};

use super::table::Table;

/// True values by name.
pub type Truth = Vec<(String, f64)>;

/// Kind of operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OperatorKind {
    C1,
    C2,
    Person,
}

impl OperatorKind {
    pub const ALL: [Self; 3] = [Self::C1, Self::C2, Self::Person];

    pub fn name(self) -> &'static str {
        match self {
            Self::C1 => "C1",
            Self::C2 => "C2",
            Self::Person => "person",
        }
    }
}

/// Runs of one operator, and one run of another operator for the fault that requires it.
#[derive(Debug, Clone)]
pub struct Base {
    pub who: OperatorKind,
    /// Kind of run: `C1`, or `person, pulsed`.
    pub label: String,
    pub form: Form,
    pub runs: Vec<Table>,
    pub truth: Truth,
    pub second: Table,
    pub second_truth: Truth,
}

impl Base {
    /// Returns the index of the run into which the fault is inserted.
    pub fn faulty_run_index(&self) -> usize {
        self.runs.len() / 2
    }
}

/// Returns the runs of a case.
///
/// # Errors
/// The errors of the simulation.
pub fn base(who: OperatorKind, seed: u64, case: u64) -> Result<Base, SimError> {
    match who {
        OperatorKind::C1 | OperatorKind::C2 => thesis_base(who, seed, case),
        OperatorKind::Person => person_base(seed, case),
    }
}

fn thesis_base(who: OperatorKind, seed: u64, case: u64) -> Result<Base, SimError> {
    let run = |condition: Condition, replication: u64| -> Result<(Table, Truth), SimError> {
        let scenario = Scenario::condition(condition);
        let streams = RunSeed {
            seed,
            cell: case,
            replication,
        };
        let record = Simulator::new(&scenario)?.run(streams, false)?;
        let own = scenario.initial.operator;
        let truth = [
            ("K_e", own.k_e),
            ("T_L", own.t_l_s),
            ("K_e_dot", own.k_e * own.t_l_s),
            ("omega_nm", own.omega_nm_rad_s),
            ("zeta_nm", own.zeta_nm),
            ("tau_e", own.tau_e_s),
        ];
        let truth = truth.map(|(name, value)| (name.to_owned(), value)).to_vec();
        Ok((Table::of(&record, false), truth))
    };
    let (first, other) = match who {
        OperatorKind::C2 => (Condition::C2, Condition::C1),
        _ => (Condition::C1, Condition::C2),
    };
    let (table, truth) = run(first, 1)?;
    let (second, second_truth) = run(other, 2)?;
    Ok(Base {
        who,
        label: who.name().to_owned(),
        form: Form::Lead,
        runs: vec![table],
        truth,
        second,
        second_truth,
    })
}

fn person_base(seed: u64, case: u64) -> Result<Base, SimError> {
    // A tenth of the corpus, which consists of every tenth case, must also have all kinds of people.
    let i = (case + case / 10) as usize;
    let task = Task {
        sample_time: SampleTime::new([1.0 / 60.0, 0.01][i / 2 % 2])?,
        ..Task::default()
    };
    let kind = RemnantKind::ALL[i % 5];
    // Every second person has a lead, which trackers and polynomials can represent; with an integrator as the plant,
    // people have no lead.
    let lead = i.is_multiple_of(2);
    let plant = if lead {
        Plant::ALL[1 + i / 2 % 2]
    } else {
        Plant::ALL[i % 3]
    };
    let form = lead.then_some(Form::Lead);
    let draw =
        |form: Option<Form>, number: u64| Person::draw(&Population::default(), &task, plant, form, kind, seed, number);
    let person = draw(form, case)?;
    let form = person.state.operator.form();
    let other = draw(Some(form), case + 1_000_000)?;
    let with_disturbance = (i / 4).is_multiple_of(2);
    let runs = (0..=i as u64 / 2 % 3)
        .map(|run| Ok(Table::of(&person.run(run)?.record, with_disturbance)))
        .collect::<Result<Vec<_>, SimError>>()?;
    Ok(Base {
        who: OperatorKind::Person,
        label: format!("person, {kind}"),
        form,
        runs,
        truth: true_parameters(&person.state.operator),
        second: Table::of(&other.run(0)?.record, with_disturbance),
        second_truth: true_parameters(&other.state.operator),
    })
}

fn true_parameters(operator: &FamilyOperator) -> Truth {
    let all = operator.named_parameters().into_iter();
    // An infinite T_I has no standard error.
    all.filter(|p| p.value.is_finite())
        .map(|p| (p.name.to_owned(), p.value))
        .collect()
}
