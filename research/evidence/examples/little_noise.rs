//! Random operators of all default forms, simulated with little noise or none: identification of the form, the
//! parameters and the intersample behaviour of the error.
//!
//! ```sh
//! cargo xtask slow little-noise [PEOPLE] [SEED]
//! ```
//!
//! Each operator has a gain K from 0.1 to 10 (log-uniform), leads of 0.1 to 2 s, lags of 0.2 to 5 s, a neuromuscular
//! system with a natural frequency of 6 to 20 rad/s and a damping ratio of 0.1 to 0.8, and a delay of 0.1 to 0.4 s; the
//! records last 60 s and are sampled at 20 to 200 Hz. The error is a sum of twelve sinusoids of random phases from 0.2
//! to 15 rad/s and white noise; between samples it is held or, for every second person, varies linearly. The noise of u
//! is white, with a share of its power of 0, 1e-12, 1e-9, 1e-6 or 1e-3. The study counts correct forms and intersample
//! behaviours, and people whose response from 0.5 to 10 rad/s deviates by more than 1e-6 of the response and by more
//! than five standard errors.

#![allow(clippy::print_stdout)]

#[allow(dead_code)]
#[path = "../../../crates/hoid-ident/tests/common/simulated_operator.rs"]
mod simulated_operator;

use std::{env, error::Error, f64::consts::TAU};

use hoid_ident::family::{FamilyEstimator, Intersample};
use hoid_model::{
    Channel, Complex64, FamilyOperator, Form, Record, SampleTime,
    operator_family::{Coordinate, ZohFamilyOperator},
};
use simulated_operator::{Uniform, response_to};

const NOISE_SHARES: [f64; 5] = [0.0, 1e-12, 1e-9, 1e-6, 1e-3];

/// Frequencies at which a response is evaluated, rad/s.
const OMEGA_RAD_S: [f64; 5] = [0.5, 1.0, 2.0, 5.0, 10.0];

fn operator(form: Form, random: &mut Uniform) -> Result<FamilyOperator, Box<dyn Error>> {
    let of = |coordinate: &Coordinate| match coordinate {
        Coordinate::Gain => random.log_uniform(0.1, 10.0),
        Coordinate::Lead => random.log_uniform(0.1, 2.0),
        Coordinate::LagRate => 1.0 / random.log_uniform(0.2, 5.0),
        Coordinate::Linear => random.between(0.5, 1.5),
        Coordinate::Quadratic => random.between(0.05, 0.4),
        Coordinate::Droop => random.between(0.1, 0.6),
        Coordinate::LogOmega => random.between(6f64.ln(), 20f64.ln()),
        Coordinate::LogZeta => random.between(0.1f64.ln(), 0.8f64.ln()),
        Coordinate::Delay => random.between(0.1, 0.4),
    };
    let coordinates: Vec<f64> = form.coordinates(true).iter().map(of).collect();
    Ok(FamilyOperator::new(form, true, &coordinates)?)
}

/// Returns the discrete model for a held or a linear error.
fn discretise(
    operator: &FamilyOperator,
    course: Intersample,
    ts: SampleTime,
) -> Result<ZohFamilyOperator, Box<dyn Error>> {
    if course == Intersample::Zoh {
        return Ok(operator.zoh(ts)?);
    }
    let mut earlier = operator.coordinates().to_vec();
    let delay = earlier.len() - 1;
    earlier[delay] -= 0.5 * ts.s();
    let earlier = FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &earlier)?;
    Ok(earlier.interpolate(ts)?)
}

fn record(
    model: &ZohFamilyOperator,
    ts: SampleTime,
    share: f64,
    random: &mut Uniform,
) -> Result<Record, Box<dyn Error>> {
    let n = (60.0 / ts.s()) as usize;
    let lines: Vec<(f64, f64, f64)> = (0..12)
        .map(|i| {
            let omega = 0.2 * 75f64.powf(f64::from(i) / 11.0);
            (omega, 1.0 / (1.0 + 0.2 * omega), TAU * random.between(0.0, 1.0))
        })
        .collect();
    let e: Vec<f64> = (0..n)
        .map(|k| {
            let t = k as f64 * ts.s();
            let sines: f64 = lines.iter().map(|(w, a, p)| a * (w * t + p).sin()).sum();
            sines + 0.1 * random.normal()
        })
        .collect();
    let mut u = response_to(model, &e);
    let power = u.iter().map(|u| u * u).sum::<f64>() / n as f64;
    u.iter_mut()
        .for_each(|u| *u += (share * power).sqrt() * random.normal());
    Ok(Record::new(ts, Channel::new("e", "", e), Channel::new("u", "", u))?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let number = |i: usize, otherwise: u64| env::args().nth(i).map_or(Ok(otherwise), |text| text.parse());
    let forms_of_default = FamilyEstimator::default().forms;
    let (people, seed) = (number(1, 1000)?, number(2, 1)?);
    for share in NOISE_SHARES {
        let mut random = Uniform(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let (mut forms, mut courses, mut wrong, mut failed, mut outside) = (0, 0, 0, 0, 0);
        let each = (people / NOISE_SHARES.len() as u64).max(1);
        for k in 0..each {
            let form = forms_of_default[k as usize % forms_of_default.len()];
            let course = if (k / forms_of_default.len() as u64).is_multiple_of(2) {
                Intersample::Zoh
            } else {
                Intersample::Foh
            };
            let truth = operator(form, &mut random)?;
            let rate = [20.0, 50.0, 100.0, 200.0][(random.between(0.0, 1.0) * 4.0) as usize];
            let ts = SampleTime::new(1.0 / rate)?;
            let record = record(&discretise(&truth, course, ts)?, ts, share, &mut random)?;
            let what = format!(
                "share {share:e}, {course}, {rate} Hz, {form} {:.4?}",
                truth.coordinates()
            );
            let fit = match FamilyEstimator::default().fit(&[record]) {
                Ok(fit) => fit,
                Err(error) => {
                    println!("{what}: {error}");
                    failed += 1;
                    continue;
                }
            };
            if fit.course_is_known && fit.intersample != course {
                println!("{what}: {}", fit.intersample);
                wrong += 1;
            }
            courses += u64::from(fit.course_is_known && fit.intersample == course);
            let found = fit.operator(0);
            // A quadratic numerator with real zeros is a product of two leads.
            let zeros = [Form::QuadraticIntegral, Form::LeadDroop];
            if fit.form != form && !(zeros.contains(&fit.form) && zeros.contains(&form)) {
                let left = fit.noise_free.unwrap_or(f64::NAN);
                println!(
                    "{what}: {} {:.4?}, {left:.1e} left",
                    fit.form,
                    found.operator.coordinates()
                );
                continue;
            }
            forms += 1;
            // If the intersample behaviour is unknown, the delay is defined as for a held error.
            let known = fit.course_is_known || course == Intersample::Zoh;
            let late = if known { 0.0 } else { 0.5 * ts.s() };
            let off = OMEGA_RAD_S.map(|omega| {
                let expected = truth.response(omega) * Complex64::from_polar(1.0, omega * late);
                let at = found.operator.response_and_gradient(omega);
                let [[gain, _], [_, phase]] = found
                    .covariance
                    .as_ref()
                    .map_or([[0.0; 2]; 2], |c| at.relative_covariance(c));
                (at.value / expected - 1.0).norm() / (1e-6 + 5.0 * (gain + phase).sqrt())
            });
            let off = off.into_iter().fold(0.0, f64::max);
            if off > 1.0 {
                println!("{what}: off by {off:.1}: {:.6?}", found.operator.coordinates());
                outside += 1;
            }
        }
        println!(
            "share {share:e}: of {each} {forms} forms, {courses} courses and {wrong} wrong ones, {failed} without a result, \
             {outside} outside"
        );
    }
    Ok(())
}
