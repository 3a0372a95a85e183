//! Excitation of the loop of a case: target or disturbance, the resulting rms of u and e, and the time course of the
//! remnant's strength.

use std::f64::consts::TAU;

use hoid_model::{
    Complex64,
    family_scenario::MultiSine,
    forcing::{ForcingFunction, Sinusoid},
};
use hoid_sim::SimError;

use super::{
    case::{Case, Course, Forcing},
    draw::CaseRun,
    operator::{Operator, Plant},
};

const PHASE_STREAM: u64 = 3;

/// The time course of the remnant's strength.
pub(super) struct RemnantStrength {
    course: Course,
    sizes: [f64; 2],
    phase: f64,
    forgets: f64,
    square: f64,
}

/// Period of [`Course::Wander`], and length of two spans of [`Course::Steps`], s.
const PERIOD_S: f64 = 30.0;

impl RemnantStrength {
    pub fn new(case: &Case, sizes: [f64; 2], number: f64, ts: f64) -> Self {
        Self {
            course: case.course,
            sizes,
            phase: number,
            forgets: 1.0 - (-ts).exp(),
            square: sizes[0] * sizes[0],
        }
    }

    pub fn of(&self, t_s: f64, error: f64) -> f64 {
        let place = t_s / PERIOD_S + self.phase;
        match self.course {
            Course::Wander(part) => 1.0 + part * (TAU * place).sin(),
            Course::Steps(factor) if place.rem_euclid(1.0) >= 0.5 => factor,
            Course::Error => (error.abs() / self.sizes[1]).min(4.0),
            Course::Control => (self.square.sqrt() / self.sizes[0]).clamp(0.2, 4.0),
            _ => 1.0,
        }
    }

    /// Updates the running mean square of u, which has a time constant of 1 s.
    pub fn follow(&mut self, u: f64) {
        self.square += self.forgets * (u * u - self.square);
    }
}

/// Returns the target or the disturbance of a run, with unit rms.
pub(super) fn forcing(case: &Case, run: CaseRun) -> Result<ForcingFunction, SimError> {
    let lines: Vec<Sinusoid> = match case.forcing {
        Forcing::McRuer => MCRUER_RAD_S
            .iter()
            .map(|omega| Sinusoid {
                amplitude_deg: if *omega < MCRUER_SHELF_RAD_S { 1.0 } else { 0.1 },
                omega_rad_s: *omega,
                phase_rad: 0.0,
            })
            .collect(),
        Forcing::Disturbance | Forcing::Target => {
            // Loops with second-order plants are slower.
            let largest = if matches!(case.plant, Plant::Integrator | Plant::Unstable) {
                31
            } else {
                23
            };
            let sum = MultiSine {
                largest,
                ..MultiSine::default()
            };
            sum.excitation()?.function.sinusoids().to_vec()
        }
    };
    let rms = lines.iter().map(|l| l.amplitude_deg.powi(2) / 2.0).sum::<f64>().sqrt();
    let phases = run.stream(case, PHASE_STREAM).uniform_numbers(lines.len());
    let with = |(line, phase): (&Sinusoid, f64)| Sinusoid {
        amplitude_deg: line.amplitude_deg / rms,
        phase_rad: TAU * phase,
        ..*line
    };
    Ok(ForcingFunction::new(lines.iter().zip(phases).map(with).collect())?)
}

const MCRUER_RAD_S: [f64; 10] = [0.157, 0.262, 0.393, 0.602, 0.969, 1.49, 2.54, 4.03, 7.57, 13.8];
const MCRUER_SHELF_RAD_S: f64 = 3.0;

/// Returns the rms of u and e without remnant.
pub(super) fn rms_without_remnant(operator: &Operator, case: &Case, lines: &ForcingFunction) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for line in lines.sinusoids() {
        let (y, p) = (
            operator.response(line.omega_rad_s),
            case.plant.response(line.omega_rad_s),
        );
        let sensitivity = Complex64::from(1.0) / (Complex64::from(1.0) + y * p);
        let of_e = sensitivity
            * if case.forcing == Forcing::Disturbance {
                -p
            } else {
                Complex64::from(1.0)
            };
        for (sum, response) in squares.iter_mut().zip([of_e * y, of_e]) {
            *sum += (line.amplitude_deg * response.norm()).powi(2) / 2.0;
        }
    }
    squares.map(f64::sqrt)
}
