//! The level of a record: the constant part of u that is not a response to e.
//!
//! `u(t) = c + G e(t) + v(t)`: the level c results from a nonzero rest position of the stick, or from an offset of an
//! amplifier or of e. For given dynamics u is linear in c. For long records the least squares estimate of c follows
//! from the means,
//!
//! `c = mean(u) - G(1) mean(e)`,
//!
//! so that a fit to e and u without their means ([`hoid_model::Detrend::Mean`]) is equivalent to a fit that also
//! estimates c for each record (L. Ljung, *System Identification*, 1999, section 14.1), except for end effects: in a
//! step response, for example, c does not follow from the means. With the option [`crate::Estimator::level`], c is
//! therefore an unknown of the fit, like the initial states. The constant in a record with the residuals eps is then
//!
//! `c = eps'z / z'z`, where z denotes the residuals for u = 1 and e = 0.
//!
//! The variance of c is `sigma^2 |H(1)|^2/n`, with the noise model H = C/(A D), plus the contribution
//! `mean(e)^2 var G(1)` of the uncertain static gain.

use hoid_model::{
    Channel, Detrend, Record,
    polynomial_model::monic,
    uncertainty::{Estimate, variance_along},
};
use hoid_numerics::statistics::mean;

use crate::{Fit, IdentError, linalg::vectors::dot};

/// Mean square of the residuals for u = 1 below which a constant in u counts as having no effect on the residuals.
const MIN_MEAN_SQUARE: f64 = 1e-16;
/// Channel that contains the true gain in simulated runs, which have no level.
const TRUE_GAIN_CHANNEL: &str = "K_e";

/// True if the records may have a level. False for simulated runs, which are recognised by the channel of their true
/// gain. False also if e or u is constant: the fit rejects such a record, and must report the value before the removal
/// of the means.
pub fn may_have_level(records: &[Record]) -> bool {
    let simulated = records.iter().any(|record| record.channel(TRUE_GAIN_CHANNEL).is_some());
    let moves = |x: &[f64]| x.iter().any(|v| *v != x[0]);
    let alive = |record: &Record| moves(record.input()) && moves(record.output());
    !simulated && records.iter().all(alive)
}

/// Returns the records with the means of e and u removed, which removes the level for a time-invariant model.
pub fn without_level(records: &[Record]) -> Vec<Record> {
    records.iter().map(|r| r.clone().detrended(Detrend::Mean)).collect()
}

impl Fit {
    /// Returns the constant part of u in a record that is not a response to e, by least squares over the residuals;
    /// `None` if a constant in u has no effect on the residuals, as with a root of A or D at one.
    ///
    /// # Errors
    /// The errors of [`Fit::residuals`].
    pub fn constant_part(&self, record: &Record) -> Result<Option<f64>, IdentError> {
        let ones = |name: &str, one: f64| Channel::new(name, "", vec![one; record.len()]);
        let unit = Record::new(record.sample_time(), ones("e", 0.0), ones("u", 1.0))?;
        let (of_record, of_unit) = (self.residuals(record)?.values, self.residuals(&unit)?.values);
        let (products, squares) = (dot(&of_record, &of_unit), dot(&of_unit, &of_unit));
        let found = products / squares;
        Ok((squares > MIN_MEAN_SQUARE * of_unit.len() as f64 && found.is_finite()).then_some(found))
    }

    /// Returns the level c of u in a record, in the unit of u, with its standard error. The model must have been fitted
    /// to this record with the means of e and u removed. `None` if the model has no static gain (an integrator) or no
    /// input, or if the fit is exact.
    pub fn level(&self, record: &Record) -> Option<Estimate> {
        let model = self.model();
        let covariance = self.covariance()?;
        if !model.structure().has_input() {
            return None;
        }
        let (e, u) = (mean(record.input()), mean(record.output()));
        let (response, gradient) = model.response_and_gradient(0.0);
        let gradient: Vec<f64> = gradient.iter().map(|g| g.re).collect();
        let at_rest = |coefficients: &[f64]| monic(coefficients).iter().sum::<f64>();
        let noise = at_rest(model.c()) / (at_rest(model.a()) * at_rest(model.d()));
        let variance = self.innovation_variance() * noise * noise / record.len() as f64
            + e * e * variance_along(&gradient, covariance);
        let level = Estimate::with_variance(u - response.re * e, variance);
        (level.value.is_finite() && variance.is_finite()).then_some(level)
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel, Structure,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{Estimator, linalg::least_squares::solve_symmetric};

    fn simulated_record(replication: u64) -> Record {
        let streams = RunSeed {
            seed: 31,
            replication,
            ..RunSeed::default()
        };
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        simulator.run(streams, false).unwrap()
    }

    fn shifted_record(record: &Record, by_e: f64, by_u: f64) -> Record {
        let add = |x: &[f64], by: f64| x.iter().map(|v| v + by).collect::<Vec<f64>>();
        let e = Channel::new("e", "", add(record.input(), by_e));
        let u = Channel::new("u", "", add(record.output(), by_u));
        Record::new(record.sample_time(), e, u).unwrap()
    }

    fn fit_without_level(structure: Structure, record: &Record) -> Fit {
        let without = record.clone().detrended(Detrend::Mean);
        Estimator::new(structure, structure.operator_orders(29))
            .fit(&[without])
            .unwrap()
    }

    #[test]
    fn offset_of_u_is_found_without_bias() {
        // The squared errors of c, in standard errors, are summed over the runs.
        let (mut squares, runs) = (0.0, 12);
        for k in 0..runs {
            let record = simulated_record(k);
            let (clean, off) = (
                fit_without_level(Structure::BoxJenkins, &record),
                shifted_record(&record, 0.02, 0.01),
            );
            let fit = fit_without_level(Structure::BoxJenkins, &off);
            assert!((fit.model().b()[0] - clean.model().b()[0]).abs() < 1e-9);
            let (before, after) = (clean.level(&record).unwrap(), fit.level(&off).unwrap());
            let gain = fit.model().response(0.0).re;
            assert!((after.value - before.value - (0.01 - 0.02 * gain)).abs() < 1e-9);
            squares += (before.value / before.standard_error.unwrap()).powi(2);
        }
        // Chi-square with 12 degrees of freedom is between 3.1 and 28.3, except for 0.5 % on each side.
        assert!((3.1..28.3).contains(&squares), "{squares}");
    }

    #[test]
    fn level_equals_the_regression_constant() {
        // The reference is a regression with a column of ones, since ARX is linear.
        let record = shifted_record(&simulated_record(40), 0.0, 0.03);
        let fit = fit_without_level(Structure::Arx, &record);
        let (e, u) = (record.input(), record.output());
        let rows: Vec<[f64; 5]> = (31..u.len())
            .map(|t| [-u[t - 1], -u[t - 2], e[t - 29], e[t - 30], 1.0])
            .collect();
        let gram: Vec<f64> = (0..25)
            .map(|k| rows.iter().map(|r| r[k / 5] * r[k % 5]).sum())
            .collect();
        let right: Vec<f64> = (0..5)
            .map(|k| rows.iter().zip(&u[31..]).map(|(r, u)| r[k] * u).sum())
            .collect();
        let theta = solve_symmetric(&gram, &right).unwrap();
        let twin = theta[4] / (1.0 + theta[0] + theta[1]);
        let level = fit.level(&record).unwrap();
        // The end effects are limited to about 30 of the 8192 samples.
        assert!(
            (level.value - twin).abs() < 0.1 * level.standard_error.unwrap(),
            "{level} and {twin}"
        );
    }

    /// Returns a record with `u(t) = level + y(t)` and `y(t) = 0.9 y(t-1) + 0.2 e(t-3)`, started from rest.
    fn record_from_rest(e: &[f64], level: f64) -> Record {
        let mut y = vec![0.0; e.len()];
        for t in 3..e.len() {
            y[t] = 0.9 * y[t - 1] + 0.2 * e[t - 3];
        }
        let u = y.iter().map(|y| level + y).collect();
        Record::new(
            hoid_model::SampleTime::new(0.05).unwrap(),
            Channel::new("e", "", e.to_vec()),
            Channel::new("u", "", u),
        )
        .unwrap()
    }

    #[test]
    fn level_of_a_noise_free_step_response_is_exact() {
        let step: Vec<f64> = (0..200).map(|t| if t < 40 { 0.0 } else { 10.0 }).collect();
        let two: Vec<Record> = [13.5, -2.0].map(|level| record_from_rest(&step, level)).into();
        let without = without_level(&two);
        let orders = |na, nf| hoid_model::Orders {
            na,
            nb: 1,
            nf,
            nk: 3,
            ..hoid_model::Orders::default()
        };
        for (structure, orders) in [
            (Structure::Arx, orders(1, 0)),
            (Structure::OutputError, orders(0, 1)),
            (Structure::Arx, hoid_model::Orders { nb: 2, ..orders(2, 0) }),
        ] {
            let estimator = Estimator {
                level: true,
                ..Estimator::new(structure, orders)
            };
            let Ok(fit) = estimator.fit(&without) else {
                // Exact data carry no information about a superfluous second pole.
                assert_eq!(orders.na, 2);
                continue;
            };
            let gain = fit.model().response(0.0).re;
            assert!((gain - 2.0).abs() < 1e-9, "{structure} {gain}");
            for (record, level) in without.iter().zip([13.5, -2.0]) {
                // Removing the means subtracts mean(u), a part of which mean(e) explains.
                let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
                let taken = mean(two[0].output()) - 13.5 + level - gain * mean(&step);
                let found = fit.constant_part(record).unwrap().unwrap();
                assert!((found + taken - level).abs() < 1e-8, "{structure} {found} {taken}");
            }
            // If a lag responds to a step, removing the means alone biases the static gain.
            let without_level_term = Estimator::new(structure, orders).fit(&without).unwrap();
            let missed = (without_level_term.model().response(0.0).re - 2.0).abs();
            assert!(structure != Structure::Arx || missed > 1e-4, "{structure} {missed}");
        }
    }

    #[test]
    fn level_hardly_changes_other_estimates() {
        let record = shifted_record(&simulated_record(43), 0.0, 0.03);
        let without = without_level(std::slice::from_ref(&record));
        let plain = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29));
        let with = Estimator {
            level: true,
            ..plain.clone()
        };
        let (without_level_term, unknown) = (plain.fit(&without).unwrap(), with.fit(&without).unwrap());
        assert_eq!(unknown.state_count(), without_level_term.state_count() + 1);
        for ((name, a), (_, b)) in without_level_term.parameters().iter().zip(unknown.parameters()) {
            let off = (a.value - b.value).abs() / a.standard_error.unwrap();
            assert!(off < 0.2, "{name} {off}");
        }
        let zero = |level| Estimator {
            level,
            initial_state: Some(crate::InitialState::Zero),
            ..plain.clone()
        };
        let both = [true, false].map(|level| zero(level).fit(&without).unwrap());
        assert_eq!(both[0].model().theta(), both[1].model().theta());
    }

    #[test]
    fn integrating_model_has_no_constant() {
        let e: Vec<f64> = (0..400)
            .map(|t| (0.31 * t as f64).sin() + (0.07 * t as f64).cos())
            .collect();
        let mut u = vec![0.0; 400];
        for t in 1..400 {
            u[t] = u[t - 1] + 0.1 * e[t - 1] + 1e-3 * (1.7 * t as f64).sin();
        }
        let ts = hoid_model::SampleTime::new(0.05).unwrap();
        let record = Record::new(ts, Channel::new("e", "", e), Channel::new("u", "", u)).unwrap();
        let orders = hoid_model::Orders {
            na: 1,
            nb: 1,
            nk: 1,
            ..hoid_model::Orders::default()
        };
        let exact = Estimator {
            constraints: [("a1".to_owned(), crate::Constraint::Fixed(-1.0))].into(),
            ..Estimator::new(Structure::Arx, orders)
        };
        let fit = exact.fit(std::slice::from_ref(&record)).unwrap();
        assert_eq!(fit.constant_part(&record).unwrap(), None);
    }

    #[test]
    fn model_without_input_has_no_level() {
        let record = simulated_record(41);
        let orders = hoid_model::Orders {
            na: 2,
            ..hoid_model::Orders::default()
        };
        let fit = Estimator::new(Structure::Ar, orders)
            .fit(std::slice::from_ref(&record))
            .unwrap();
        assert!(fit.level(&record).is_none());
    }
}
