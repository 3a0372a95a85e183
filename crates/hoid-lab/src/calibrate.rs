//! Calibration of the latency that the page and its events add to an identified delay.
//!
//! A simulated operator replaces the person: it runs in the page in real time, with the displayed error as input and
//! pointer events as output. Its gain, neuromuscular system and delay tau are known. The delay identified by
//! `hoid identify` minus tau is the latency of the page, its frames and its events, which is part of every delay
//! identified on this computer. The latency does not include the screen (from the frame buffer to the light) or the
//! device (from the hand to the event), which can be measured only with a sensor.

use std::path::Path;

use hoid_ident::family::{FamilyEstimator, OperatorPrior};
use hoid_model::{Form, Record, SampleTime, operator_family::Coordinate, zoh_system::ZohSystem};
use hoid_numerics::statistics::standard_deviation;
use hoid_sim::RunSeed;
use serde::{Deserialize, Serialize};

use crate::{
    LabError,
    config::{Condition, Config, Signal},
    plant::Plant,
    session::LoggedRun,
    task::{TICK_S, Task},
    utc,
    wire::SimulatedOperator,
};

/// Parameters of the simulated operator: gain, natural frequency in rad/s, damping, delay in ticks.
const GAIN: f64 = 0.75;
const OMEGA_RAD_S: f64 = 14.0;
const ZETA: f64 = 0.5;
const DELAY_TICKS: usize = 150;
/// Standard deviation of the remnant, and time constant of its filter in s.
const REMNANT_SD: f64 = 0.05;
const REMNANT_TIME_CONSTANT_S: f64 = 0.1;
/// Prior spread of the neuromuscular parameters, which are known except for the effect of the hold.
const NEUROMUSCULAR_PRIOR_SPREAD: f64 = 0.01;

/// Result of a calibration, stored in `calibration.toml` of the experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Time of the calibration in UTC.
    pub utc: String,
    /// Latency of the page, its frames and its events, s.
    pub latency_s: f64,
    /// Standard error of the latency, s.
    pub latency_se_s: f64,
    /// Standard deviation of the time from an event to the tick at which it takes effect, ms.
    pub input_jitter_ms: f64,
    /// Standard deviation of the time between frames, ms.
    pub frame_jitter_ms: f64,
}

impl Calibration {
    /// Returns the names and values of the results as text for the page.
    pub fn rows(&self) -> Vec<(String, String)> {
        let ms = 1e3;
        vec![
            (
                "Latency of page, frames and events".to_owned(),
                format!("{:.1} ± {:.1} ms", ms * self.latency_s, ms * self.latency_se_s),
            ),
            (
                "Jitter of the input".to_owned(),
                format!("{:.2} ms", self.input_jitter_ms),
            ),
            (
                "Jitter of the frames".to_owned(),
                format!("{:.2} ms", self.frame_jitter_ms),
            ),
        ]
    }
}

#[derive(Default, Serialize, Deserialize)]
struct SavedCalibrations {
    #[serde(default)]
    calibration: Vec<Calibration>,
}

/// Returns the configuration of a calibration: one run of 40 s.
pub fn config() -> Config {
    Config {
        name: "Calibration".to_owned(),
        consent: "A simulated operator tracks for 45 s in place of a person. Keep this window in front and leave the \
mouse alone."
            .to_owned(),
        condition: vec![Condition {
            name: "calibration".to_owned(),
            text: "A simulated operator tracks. Leave the mouse alone.".to_owned(),
            target: Some(Signal::default()),
            measurement_s: 40.0,
            run_in_s: 5.0,
            ..Condition::default()
        }],
        ..Config::default()
    }
}

/// Returns the simulated operator, and its remnant at each tick of a run.
///
/// # Errors
/// [`LabError::Model`].
pub fn operator(task: &Task, seed: u64) -> Result<(SimulatedOperator, Vec<f64>), LabError> {
    let square = OMEGA_RAD_S * OMEGA_RAD_S;
    let tick = SampleTime::new(TICK_S)?;
    let system = ZohSystem::new(&[GAIN * square], &[1.0, 2.0 * ZETA * OMEGA_RAD_S, square], 0.0, tick)?;
    let plant = Plant {
        a: system.transition_matrix().to_vec(),
        b: system.input_vector().to_vec(),
        c: system.output_row().to_vec(),
        d: system.direct_feedthrough(),
    };
    let white = RunSeed {
        seed,
        cell: 0,
        replication: 1,
    }
    .white_noise(task.ticks);
    // First-order remnant with standard deviation sigma: n <- a n + sqrt(1 - a^2) sigma w.
    let a = (-TICK_S / REMNANT_TIME_CONSTANT_S).exp();
    let (drive, mut n) = (REMNANT_SD * (1.0 - a * a).sqrt(), 0.0);
    let noise = white.iter().map(|w| {
        n = a * n + drive * w;
        n
    });
    Ok((
        SimulatedOperator {
            plant,
            delay: DELAY_TICKS,
        },
        noise.collect(),
    ))
}

/// Evaluates the run of a calibration and stores the result in the folder of the experiment.
///
/// # Errors
/// [`LabError::Ident`] if the run cannot be identified; errors of reading or writing files.
pub fn evaluate(out: &Path, record: &Record, logged: &LoggedRun) -> Result<Calibration, LabError> {
    let measured = record.span(0.0, record.time_s(record.len()))?;
    let estimator = FamilyEstimator {
        forms: vec![Form::Gain],
        prior: format!(
            "omega_nm={OMEGA_RAD_S}:{NEUROMUSCULAR_PRIOR_SPREAD},zeta_nm={ZETA}:{NEUROMUSCULAR_PRIOR_SPREAD}"
        )
        .parse::<OperatorPrior>()?,
        run_to_run: 0.0,
        ..FamilyEstimator::default()
    };
    let fit = estimator.fit(&[measured])?;
    let delay = fit.coordinate(0, Coordinate::Delay);
    let (value, error) = delay.map_or((f64::NAN, f64::NAN), |d| {
        (d.value, d.standard_error.unwrap_or(f64::NAN))
    });
    let waits: Vec<f64> = logged.events.iter().map(|event| event.tick - event.stamp_ms).collect();
    let frames: Vec<f64> = logged
        .frames
        .iter()
        .zip(logged.frames.iter().skip(1))
        .map(|(last, next)| next.drawn_ms - last.drawn_ms)
        .collect();
    let found = Calibration {
        utc: utc::now(),
        latency_s: value - DELAY_TICKS as f64 * TICK_S,
        latency_se_s: error,
        input_jitter_ms: standard_deviation(&waits),
        frame_jitter_ms: standard_deviation(&frames),
    };
    let path = out.join("calibration.toml");
    let mut kept: SavedCalibrations = match hoid_io::read_settings(&path) {
        Ok(text) => toml::from_str(&text).map_err(|error| LabError::damaged_file(&path, error.message()))?,
        Err(_) => SavedCalibrations::default(),
    };
    kept.calibration.push(found.clone());
    let text = toml::to_string(&kept).map_err(|error| LabError::damaged_file(&path, error.to_string()))?;
    hoid_io::write_atomically(&path, |file| file.write_all(text.as_bytes()))?;
    Ok(found)
}
