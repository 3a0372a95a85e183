//! Compares the errors that a design predicts with the scatter of simulated experiments.
//!
//! Each experiment is the scenario that the design writes, simulated run by run. The responses are fitted to the
//! Fourier coefficients at its lines, `U = B E + F X + N`, by the Gauss-Newton method with the weights `1/S_n`. The
//! covariance of this estimate is the inverse of the information of the lines. The relative standard error of a
//! standard deviation over n experiments is `1/sqrt(2 n)`.

use hoid_design::experiment::{DesignOptions, DesignRequest, EntryPoint, ExperimentDesign, Remnant};
use hoid_io::{AnyScenario, parse_any_scenario};
use hoid_model::{
    Complex64, FamilyOperator, FamilyScenario, FamilyState, Form, Record,
    family_scenario::{Display, Feedforward},
    operator_family::Coordinate,
};
use hoid_sim::{FamilySimulator, RunSeed};
use nalgebra::{DMatrix, DVector};

/// A design whose predicted errors are checked.
pub struct Case {
    pub name: &'static str,
    pub element: &'static str,
    /// Form of the operator; if `None`, that of the population.
    pub form: Option<Form>,
    pub enters: EntryPoint,
    pub display: Display,
    /// Share of the remnant and its time constant.
    pub remnant: (f64, f64),
    pub length_s: f64,
    pub lines: usize,
    pub runs: usize,
}

/// One run of 81.92 s with a target; the display shows only the error.
const TARGET_CASE: Case = Case {
    name: "",
    element: "4/s",
    form: None,
    enters: EntryPoint::Target,
    display: Display::Compensatory,
    remnant: (0.2, 0.06),
    length_s: 81.92,
    lines: 10,
    runs: 1,
};

/// Target and disturbance, other elements, forms, remnants, lengths and numbers of runs.
pub const CASES: [Case; 12] = [
    Case {
        name: "integrator, target",
        ..TARGET_CASE
    },
    Case {
        name: "lag and integrator, target, four runs",
        element: "4/(s(s+1))",
        runs: 4,
        ..TARGET_CASE
    },
    Case {
        name: "two integrators, target, four runs",
        element: "1/s^2",
        remnant: (0.1, 0.06),
        runs: 4,
        ..TARGET_CASE
    },
    Case {
        name: "gain with a lag, target, two runs",
        element: "3/(2s+1)",
        runs: 2,
        ..TARGET_CASE
    },
    Case {
        name: "integrator, disturbance, four runs",
        element: "1/s",
        enters: EntryPoint::Disturbance,
        remnant: (0.1, 0.06),
        runs: 4,
        ..TARGET_CASE
    },
    Case {
        name: "lag and integrator, disturbance, eight runs",
        element: "1/(s(s+1))",
        enters: EntryPoint::Disturbance,
        runs: 8,
        ..TARGET_CASE
    },
    Case {
        name: "elements of the text, lead-lag, eight runs",
        element: "90/(s(s+6))",
        form: Some(Form::LeadLag),
        remnant: (0.1, 0.06),
        runs: 8,
        ..TARGET_CASE
    },
    Case {
        name: "gain, lag, disturbance, four runs",
        element: "2",
        enters: EntryPoint::Disturbance,
        remnant: (0.1, 0.06),
        runs: 4,
        ..TARGET_CASE
    },
    Case {
        name: "integrator, half remnant of low frequency, eight short runs",
        element: "1/s",
        remnant: (0.5, 0.3),
        length_s: 40.96,
        lines: 8,
        runs: 8,
        ..TARGET_CASE
    },
    Case {
        name: "lag and integrator, white remnant, long run",
        element: "90/(s(s+6))",
        remnant: (0.3, 0.0),
        length_s: 163.84,
        lines: 14,
        ..TARGET_CASE
    },
    Case {
        name: "pursuit, integrator, two runs",
        display: Display::Pursuit,
        remnant: (0.1, 0.06),
        runs: 2,
        ..TARGET_CASE
    },
    Case {
        name: "preview, lag and integrator, four runs",
        element: "90/(s(s+6))",
        display: Display::Preview,
        remnant: (0.1, 0.06),
        runs: 4,
        ..TARGET_CASE
    },
];

/// A quantity with its predicted error, and the ratio of the standard deviation over the experiments to the predicted
/// error.
pub struct CheckedQuantity {
    pub name: &'static str,
    pub value: f64,
    pub predicted: f64,
    pub ratio: f64,
    /// Number of experiments with an estimate.
    pub experiments: usize,
    /// Mean deviation from the true value, as a multiple of the predicted error.
    pub off: f64,
}

/// The two responses of a person.
#[derive(Clone)]
pub struct Responses {
    pub feedback: FamilyOperator,
    pub target: Option<FamilyOperator>,
}

/// Coefficients of the two inputs and of u at a line.
struct Coefficients {
    omega: f64,
    error: Complex64,
    target: Complex64,
    control: Complex64,
}

impl Case {
    pub fn design(&self) -> ExperimentDesign {
        let request = DesignRequest {
            controlled_element: Some(self.element.parse().unwrap()),
            form: self.form,
            enters: self.enters,
            display: self.display,
            remnant: Remnant {
                share: self.remnant.0,
                time_constant_s: self.remnant.1,
                order: 1,
            },
            designing: DesignOptions {
                period_s: self.length_s,
                lines: self.lines,
                ..DesignOptions::default()
            },
            runs: Some(self.runs),
            ..DesignRequest::default()
        };
        request.run().unwrap()
    }

    /// Returns the scatter of the estimates at the lines over the given number of experiments.
    pub fn check_errors(&self, experiments: u64, seed: u64) -> Vec<CheckedQuantity> {
        self.check_errors_with(experiments, seed, |truth, records, design, scenario| {
            let preview_s = scenario.feedforward.as_ref().map_or(0.0, |seen| seen.preview_s);
            let lines = records
                .iter()
                .flat_map(|record| coefficients(record, design, preview_s));
            Some(fit_lines(truth, &lines.collect::<Vec<_>>(), self.remnant.1))
        })
    }

    /// Returns the scatter of the estimates that a method gives for the runs of each experiment; experiments without a
    /// result or a crossover are omitted.
    pub fn check_errors_with(
        &self,
        experiments: u64,
        seed: u64,
        estimate: impl Fn(&Responses, &[Record], &ExperimentDesign, &FamilyScenario) -> Option<Responses>,
    ) -> Vec<CheckedQuantity> {
        let design = self.design();
        let scenario = scenario(&design);
        let simulator = FamilySimulator::new(&scenario).unwrap();
        let truth = Responses {
            feedback: scenario.initial.operator.clone(),
            target: scenario.feedforward.as_ref().map(|seen| seen.operator.clone()),
        };
        let names = design.expected.names();
        let mut all = vec![Vec::new(); names.len()];
        for experiment in 0..experiments {
            let record = |replication| {
                let run = RunSeed {
                    seed,
                    cell: experiment,
                    replication,
                };
                simulator.run(run, false).unwrap()
            };
            let records: Vec<Record> = (0..self.runs as u64).map(record).collect();
            let Some(found) = estimate(&truth, &records, &design, &scenario) else {
                continue;
            };
            let Some(found) = names
                .iter()
                .map(|name| quantity_value(&found, &scenario, name))
                .collect::<Option<Vec<_>>>()
            else {
                continue;
            };
            for (values, found) in all.iter_mut().zip(found) {
                values.push(found);
            }
        }
        let of = |(name, values): (&&'static str, &Vec<f64>)| {
            let expected = design.expected.estimate(name).unwrap();
            let predicted = expected.standard_error.unwrap();
            CheckedQuantity {
                name,
                value: expected.value,
                predicted,
                ratio: hoid_numerics::statistics::sample_variance(values).sqrt() / predicted,
                experiments: values.len(),
                off: (hoid_numerics::statistics::mean(values) - expected.value) / predicted,
            }
        };
        names.iter().zip(&all).map(of).collect()
    }
}

/// Returns the scenario that the design writes.
pub fn scenario(design: &ExperimentDesign) -> FamilyScenario {
    let name = "scenario.toml";
    match parse_any_scenario(&design.scenario(), name, name).unwrap() {
        AnyScenario::Family(scenario) => *scenario,
        AnyScenario::Reference(_) => panic!("no scenario of the family"),
    }
}

fn coefficients(record: &Record, design: &ExperimentDesign, preview_s: f64) -> Vec<Coefficients> {
    let ts = record.sample_time().s();
    let target = record.channel("f_t");
    let at = |omega: f64| {
        let of = |values: &[f64]| {
            // The angle advances by the same turn in each sample.
            let turn = Complex64::from_polar(1.0, -omega * ts);
            let mut angle = Complex64::new(2.0 / values.len() as f64, 0.0);
            let mut sum = Complex64::default();
            for v in values {
                sum += angle * v;
                angle *= turn;
            }
            sum
        };
        Coefficients {
            omega,
            error: of(record.input()),
            target: target.map_or_else(Complex64::default, of) * Complex64::from_polar(1.0, omega * preview_s),
            control: of(record.output()),
        }
    };
    design.lines.iter().map(|l| at(l.line.omega_rad_s)).collect()
}

/// Positions of the coordinates of the response to the target, and the number of all coordinates. The neuromuscular
/// coordinates are those of the response to the error.
fn places(truth: &Responses) -> (Vec<usize>, usize) {
    let known = truth.feedback.form().coordinates(truth.feedback.has_neuromuscular());
    let mut count = known.len();
    let mut own = Vec::new();
    if let Some(target) = &truth.target {
        for coordinate in target.form().coordinates(target.has_neuromuscular()) {
            match coordinate {
                Coordinate::LogOmega | Coordinate::LogZeta => {
                    own.push(known.iter().position(|c| *c == coordinate).unwrap());
                }
                _ => {
                    own.push(count);
                    count += 1;
                }
            }
        }
    }
    (own, count)
}

fn fit_lines(truth: &Responses, lines: &[Coefficients], time_constant_s: f64) -> Responses {
    let (own, n) = places(truth);
    let mut found = truth.clone();
    for _ in 0..8 {
        let (mut information, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for line in lines {
            let of_error = found.feedback.response_and_gradient(line.omega);
            let mut residual = line.control - of_error.value * line.error;
            let mut gradient = vec![Complex64::default(); n];
            for (g, d) in gradient.iter_mut().zip(&of_error.gradient) {
                *g = d * line.error;
            }
            if let Some(target) = &found.target {
                let of_target = target.response_and_gradient(line.omega);
                residual -= of_target.value * line.target;
                for (index, d) in own.iter().zip(&of_target.gradient) {
                    gradient[*index] += d * line.target;
                }
            }
            let weight = 1.0 + (time_constant_s * line.omega).powi(2);
            for a in 0..n {
                right[a] += weight * (gradient[a].conj() * residual).re;
                for b in 0..n {
                    information[(a, b)] += weight * (gradient[a].conj() * gradient[b]).re;
                }
            }
        }
        let step = information.cholesky().unwrap().solve(&right);
        let moved = |operator: &FamilyOperator, places: &mut dyn Iterator<Item = usize>| {
            let x: Vec<f64> = operator
                .coordinates()
                .iter()
                .zip(places)
                .map(|(x, k)| x + step[k])
                .collect();
            FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &x).unwrap()
        };
        let feedback = moved(&found.feedback, &mut (0..n));
        let target = found
            .target
            .as_ref()
            .map(|target| moved(target, &mut own.iter().copied()));
        found = Responses { feedback, target };
    }
    found
}

/// Returns the quantity with this name in a design; `None` if the loop has no crossover.
fn quantity_value(found: &Responses, scenario: &FamilyScenario, name: &str) -> Option<f64> {
    let state = || FamilyState {
        operator: found.feedback.clone(),
        ..scenario.initial.clone()
    };
    let of = |operator: &FamilyOperator, name: &str| {
        let named = operator.named_parameters();
        named.iter().find(|p| p.name == name).map(|p| p.value)
    };
    match name {
        "crossover" => state().margins().ok()?.crossover_rad_s,
        "phase_margin" => state().margins().ok()?.phase_margin_deg,
        name => of(&found.feedback, name).or_else(|| {
            let (target, seen) = (found.target.as_ref()?, scenario.feedforward.as_ref()?);
            Some(target_quantity_value(target, seen, name.strip_suffix("_f")?))
        }),
    }
}

fn target_quantity_value(target: &FamilyOperator, seen: &Feedforward, name: &str) -> f64 {
    let named = target.named_parameters();
    let find = |wanted: &str| named.iter().find(|p| p.name == wanted).map(|p| p.value);
    match name {
        "tau" => target.tau_e_s() - seen.preview_s,
        "K" => find("K_d").or_else(|| find("K")).unwrap(),
        name => find(name).unwrap(),
    }
}
