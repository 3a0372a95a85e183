//! Estimation of three gains of a nominal operator as a random walk, after a whitening filter: recursive least squares
//! with basis functions of a typical operator (R. E. Kalman, J. Basic Engineering 82 (1960) 35-45; L. Ljung, *System
//! Identification*, 1999, section 11.6).
//!
//! The standard deviation of the drift of the gains is a tenth of the response at 2 rad/s per root second; innovations
//! are limited to 3.5 standard deviations. The method declares no changes.

use super::{
    super::entrant::{Entrant, EntrantResult, Task},
    basis::{GAIN_COUNT, product, regressor_responses, reported_response, whiten_run},
};

const GAIN_DRIFT: f64 = 0.1;
const DRIFT_OMEGA_RAD_S: f64 = 2.0;
const RESIDUAL_LIMIT: f64 = 3.5;
/// Memory length of the innovation variance, s.
const MEMORY_S: f64 = 20.0;

pub(super) struct Kalman;

impl Entrant for Kalman {
    fn name(&self) -> String {
        "basis-kalman".to_owned()
    }

    fn follow(&self, task: &Task) -> Result<EntrantResult, String> {
        let run = whiten_run(task)?;
        let (mut theta, mut p, mut variance) = (run.theta, run.covariance, run.variance);
        let worth = regressor_responses(task, DRIFT_OMEGA_RAD_S);
        let response = worth
            .iter()
            .zip(&theta)
            .map(|(g, t)| g * t)
            .sum::<hoid_model::Complex64>();
        let drift: [f64; GAIN_COUNT] = std::array::from_fn(|i| match worth[i].norm() {
            0.0 => (GAIN_DRIFT * run.size_u).powi(2) * run.every_s,
            size => (GAIN_DRIFT * response.norm() / size).powi(2) * run.every_s,
        });
        let forgets = 1.0 - (-run.every_s / MEMORY_S).exp();
        let mut answer = EntrantResult::default();
        for sample in &run.samples {
            while (task.asked_s.get(answer.estimates.len())).is_some_and(|t| *t < sample.t_s) {
                answer.estimates.push(reported_response(task, &theta, &p));
            }
            if sample.is_void || sample.t_s < task.start_s.1 {
                continue;
            }
            (0..GAIN_COUNT).for_each(|i| p[i][i] += drift[i]);
            let px: [f64; GAIN_COUNT] = std::array::from_fn(|i| product(&p[i], &sample.x));
            let expected = product(&px, &sample.x) + variance;
            let bound = RESIDUAL_LIMIT * expected.sqrt();
            let innovation = (sample.y - product(&theta, &sample.x)).clamp(-bound, bound);
            for i in 0..GAIN_COUNT {
                theta[i] += px[i] * innovation / expected;
            }
            for i in 0..GAIN_COUNT {
                for j in 0..GAIN_COUNT {
                    p[i][j] -= px[i] * px[j] / expected;
                }
            }
            variance += forgets * variance * (innovation * innovation / expected - 1.0);
        }
        answer
            .estimates
            .resize_with(task.asked_s.len(), || reported_response(task, &theta, &p));
        Ok(answer)
    }
}
