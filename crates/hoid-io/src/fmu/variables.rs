//! The variables of an FMU.

/// Names of the variables that indicate for each parameter of the operator whether the data determine it, in the order
/// of the parameters.
pub const DETERMINED_VARIABLES: [&str; 6] = [
    "K_e_determined",
    "T_L_determined",
    "K_e_dot_determined",
    "omega_nm_determined",
    "zeta_nm_determined",
    "tau_e_determined",
];

/// Kind of an FMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmuKind {
    /// Identifies an operator from e and u.
    Tracker,
    /// Controls the machine like the operator of a scenario.
    Operator,
}

hoid_model::named_choice!(FmuKind, "kind of FMU", 2, {
    Tracker => "tracker",
    Operator => "operator",
});

/// Role of an FMU variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Set before the start.
    Parameter,
    /// Set at every sample.
    Input,
    /// Reported at every sample.
    Output,
}

/// Type and start value of a variable; for an output, the value before the first sample.
#[derive(Debug, Clone, PartialEq)]
pub enum FmuStart {
    /// A number.
    Real(f64),
    /// An integer or a choice.
    Integer(i32),
    /// A Boolean value.
    Boolean(bool),
    /// A text.
    Text(String),
}

/// An FMU variable; its value reference is its position in the list.
#[derive(Debug, Clone, PartialEq)]
pub struct FmuVariable {
    /// Name of the variable.
    pub name: &'static str,
    /// Unit of the variable; empty if it has none.
    pub unit: &'static str,
    /// Role of the variable.
    pub role: Role,
    /// Type and start value.
    pub start: FmuStart,
    /// One-line description.
    pub help: &'static str,
}

fn variable(role: Role, name: &'static str, unit: &'static str, start: FmuStart, help: &'static str) -> FmuVariable {
    FmuVariable {
        name,
        unit,
        role,
        start,
        help,
    }
}

impl FmuKind {
    /// Returns the variables in the order of their value references: parameters, inputs, outputs.
    pub fn variables(self) -> Vec<FmuVariable> {
        match self {
            Self::Tracker => tracker_variables(),
            Self::Operator => operator_variables(),
        }
    }
}

fn tracker_variables() -> Vec<FmuVariable> {
    use FmuStart::{Boolean, Integer, Real, Text};
    let parameter = |name, unit, start, help| variable(Role::Parameter, name, unit, start, help);
    let input = |name, help| variable(Role::Input, name, "", Real(0.0), help);
    let output = |name, unit, start, help| variable(Role::Output, name, unit, start, help);
    let text = |text: &str| Text(text.to_owned());
    let mut all = vec![
        parameter(
            "sample_time",
            "s",
            Real(0.01),
            "sample time; steps may be shorter, but not longer",
        ),
        parameter("method", "", text("adaptive"), "recursive method, as for hoid track"),
        parameter(
            "prior",
            "",
            text("population"),
            "population, none, NAME=CENTRE:SPREAD pairs, or the file of a fit",
        ),
        parameter(
            "controlled_element",
            "",
            text(""),
            "the controlled element, such as 90/(s(s+6)); empty if there is none",
        ),
        parameter(
            "options",
            "",
            text(""),
            "further options in JSON, with the keywords of pyhoid.Tracker",
        ),
        parameter("with_excitation", "", Boolean(false), "true if f_t is connected"),
        input("e", "tracking error"),
        input("u", "control output of the person"),
        input("f_t", "excitation: target or disturbance"),
    ];
    for [(name, unit, help), (error, _, error_help)] in [
        [("K_e", "", "gain"), ("K_e_se", "", "standard error of K_e")],
        [("T_L", "s", "lead time"), ("T_L_se", "s", "standard error of T_L")],
        [
            ("K_e_dot", "s", "gain on the error rate"),
            ("K_e_dot_se", "s", "standard error of K_e_dot"),
        ],
        [
            ("omega_nm", "rad/s", "natural frequency of the neuromuscular system"),
            ("omega_nm_se", "rad/s", "standard error of omega_nm"),
        ],
        [
            ("zeta_nm", "", "damping ratio of the neuromuscular system"),
            ("zeta_nm_se", "", "standard error of zeta_nm"),
        ],
        [("tau_e", "s", "delay"), ("tau_e_se", "s", "standard error of tau_e")],
        [
            (
                "crossover_rad_s",
                "rad/s",
                "crossover frequency with the controlled element",
            ),
            ("crossover_rad_s_se", "rad/s", "standard error of crossover_rad_s"),
        ],
        [
            ("phase_margin_deg", "deg", "phase margin with the controlled element"),
            ("phase_margin_deg_se", "deg", "standard error of phase_margin_deg"),
        ],
    ] {
        all.push(output(name, unit, Real(f64::NAN), help));
        all.push(output(error, unit, Real(f64::NAN), error_help));
    }
    for name in DETERMINED_VARIABLES {
        all.push(output(
            name,
            "",
            Boolean(false),
            "true if the data determine this quantity",
        ));
    }
    all.extend([
        output("innovation", "", Real(f64::NAN), "a-priori innovation"),
        output(
            "change_log_odds",
            "",
            Real(f64::NAN),
            "log odds of a change in the last few seconds",
        ),
        output(
            "change_t",
            "s",
            Real(f64::NAN),
            "time of the last declared change in the person",
        ),
        output("changes", "", Integer(0), "number of declared changes"),
        output("level", "", Integer(2), "0 trustworthy, 1 doubtful, 2 not determined"),
        output("ready", "", Boolean(false), "true once there is an estimate"),
        output("samples", "", Integer(0), "samples taken"),
        output("skipped", "", Integer(0), "number of samples with a fault in e or u"),
        output("held", "", Integer(0), "number of samples that the guard held back"),
        output(
            "restarts",
            "",
            Integer(0),
            "number of times the guard restarted the estimate",
        ),
    ]);
    all
}

fn operator_variables() -> Vec<FmuVariable> {
    use FmuStart::{Integer, Real};
    vec![
        variable(Role::Parameter, "seed", "", Integer(0), "seed of the remnant"),
        variable(
            Role::Parameter,
            "replication",
            "",
            Integer(0),
            "number of the run with this seed",
        ),
        variable(Role::Input, "e", "deg", Real(0.0), "tracking error"),
        variable(Role::Output, "u", "deg", Real(0.0), "control output"),
        variable(Role::Output, "n", "deg", Real(0.0), "remnant in u"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_ordered_by_role() {
        for kind in FmuKind::ALL {
            let all = kind.variables();
            let roles: Vec<u8> = all.iter().map(|v| v.role as u8).collect();
            assert!(roles.is_sorted(), "{kind}");
            for (i, variable) in all.iter().enumerate() {
                assert!(
                    all[..i].iter().all(|other| other.name != variable.name),
                    "{}",
                    variable.name
                );
                assert!(!variable.help.is_empty());
            }
        }
    }
}
