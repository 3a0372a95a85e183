//! Coverage of the interval of tau_e, for errors with a hold between samples and for errors sampled from a continuous
//! signal.
//!
//! ```sh
//! cargo xtask slow intersample-coverage [PEOPLE] [SEED]
//! ```
//!
//! Each person has a gain of 1 to 3, a lead of 0.2 to 1 s, a neuromuscular system with a natural frequency of 8 to 14
//! rad/s and a damping ratio of 0.2 to 0.5, and a delay of 0.15 to 0.35 s. The error is a sum of twelve sinusoids from
//! 0.3 to 12 rad/s over 60 s; the noise of u is an autoregression with a time constant of 0.1 s and a tenth of the
//! power. Held errors pass through the exact model at their rate; continuous errors are simulated at 2000 Hz, and every
//! k-th sample is recorded. Rates above 200 Hz are decimated to 100 Hz, as by `hoid identify`. A share of 95 % of n
//! people has a standard error of `sqrt(.95 .05/n)`. The interval of one run uses Student's quantile for its blocks,
//! 2.36 standard errors; the third share is for intervals of 1.96 standard errors.

#![allow(clippy::print_stdout)]

#[allow(dead_code)]
#[path = "../../../crates/hoid-ident/tests/common/simulated_operator.rs"]
mod simulated_operator;

use std::{env, error::Error, f64::consts::TAU};

use hoid_ident::family::FamilyEstimator;
use hoid_model::{Channel, FamilyOperator, Form, Record, SampleTime};
use simulated_operator::{Uniform, response_to};

const RATES_HZ: [usize; 6] = [20, 50, 100, 200, 500, 1000];
const FINE_HZ: usize = 2000;
const LENGTH_S: usize = 60;
/// Run-in before the record, s.
const RUN_IN_S: usize = 5;

/// Returns the record of a person at this rate, and the lead of its input.
fn record(
    operator: &FamilyOperator,
    (rate_hz, is_held): (usize, bool),
    random: &mut Uniform,
) -> Result<(Record, f64), Box<dyn Error>> {
    let lines: Vec<(f64, f64)> = (0..12)
        .map(|i| (0.3 * 40f64.powf(f64::from(i) / 11.0), TAU * random.between(0.0, 1.0)))
        .collect();
    let made_hz = if is_held { rate_hz } else { FINE_HZ };
    let ts = SampleTime::new(1.0 / made_hz as f64)?;
    let e: Vec<f64> = (0..(RUN_IN_S + LENGTH_S) * made_hz)
        .map(|k| {
            lines
                .iter()
                .map(|(w, p)| (w * k as f64 * ts.s() + p).sin() / (1.0 + 0.2 * w))
                .sum()
        })
        .collect();
    let u = response_to(&operator.zoh(ts)?, &e);
    let logged = |x: &[f64]| -> Vec<f64> {
        x[RUN_IN_S * made_hz..]
            .iter()
            .step_by(made_hz / rate_hz)
            .copied()
            .collect()
    };
    let (e, mut u) = (logged(&e), logged(&u));
    let sample_time = SampleTime::new(1.0 / rate_hz as f64)?;
    let deviation = (0.1 * u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64).sqrt();
    let pole = (-sample_time.s() / 0.1).exp();
    let mut noise = 0.0;
    for u in &mut u {
        noise = pole * noise + (1.0 - pole * pole).sqrt() * random.normal();
        *u += deviation * noise;
    }
    let record = Record::new(sample_time, Channel::new("e", "", e), Channel::new("u", "", u))?;
    if rate_hz <= 200 {
        return Ok((record, 0.0));
    }
    let (record, done) = record.decimated(rate_hz / 100)?;
    Ok((record, done.lead_s))
}

fn main() -> Result<(), Box<dyn Error>> {
    let number = |i: usize, otherwise: u64| env::args().nth(i).map_or(Ok(otherwise), |text| text.parse());
    let (people, seed) = (number(1, 200)?, number(2, 1)?);
    println!(
        "rate Hz, error, people whose delay is held, by the other value, within 1.96 standard errors, mean error in standard errors, \
         mean standard error s, people without an interval"
    );
    for rate_hz in RATES_HZ {
        for is_held in [true, false] {
            let mut random = Uniform(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
            let (mut right, mut other, mut near, mut none, mut errors, mut off) = (0, 0, 0, 0, 0.0, 0.0);
            for _ in 0..people {
                let x = [
                    random.between(1.0, 3.0),
                    random.between(0.2, 1.0),
                    random.between(8f64.ln(), 14f64.ln()),
                    random.between(0.2f64.ln(), 0.5f64.ln()),
                    random.between(0.15, 0.35),
                ];
                let truth = FamilyOperator::new(Form::Lead, true, &x)?;
                let (record, lead_s) = record(&truth, (rate_hz, is_held), &mut random)?;
                let estimator = FamilyEstimator {
                    forms: vec![Form::Lead],
                    nd: Some(0..=8),
                    ..FamilyEstimator::default()
                };
                let mut fit = estimator.fit(&[record])?;
                fit.lead_s = lead_s;
                let of = fit.operator(0);
                let tau = of.parameters.iter().find(|p| p.name == "tau_e").ok_or("no delay")?;
                let later = fit.delay_if_linear_s(0).map_or(0.0, |straight| straight - tau.value);
                let Some((low, high)) = tau.interval else {
                    none += 1;
                    continue;
                };
                let held = |later: f64| u64::from((low + later..=high + later).contains(&x[4]));
                let (mine, others) = if is_held { (0.0, later) } else { (later, 0.0) };
                right += held(mine);
                other += held(others);
                let error = tau.standard_error.unwrap_or(0.0);
                let of_error = (tau.value + mine - x[4]) / error;
                near += u64::from(of_error.abs() < 1.96);
                off += of_error;
                errors += error;
            }
            let determined = (people - none) as f64;
            let share = |n: u64| 100.0 * n as f64 / determined;
            let kind = if is_held { "held" } else { "logged" };
            println!(
                "{rate_hz:5} {kind:6} {:5.1} % {:5.1} % {:5.1} % {:+.2} {:.4}, {none} without",
                share(right),
                share(other),
                share(near),
                off / determined,
                errors / determined
            );
        }
    }
    Ok(())
}
