//! Evidence in a stretch of data against an operator that was estimated from other data: one step towards a fit to this
//! stretch.
//!
//! The operator is held constant, and a noise model `D v = eps` of order [`NOISE_ORDER`] is fitted to the part of u
//! that the operator does not explain. With `psi = -d eps/d eta` for `eta = [K_e, K_e_dot, omega_nm, zeta_nm, tau_e]`,
//!
//! `delta = (psi' psi)^-1 psi' eps`
//!
//! is the Gauss-Newton step towards the fit to this stretch (L. Le Cam's one-step estimate, *Proc. Third Berkeley
//! Symp.* 1 (1956) 129-156). Its covariance is computed from the scores of 2 s blocks at this step,
//! `(n/(n-5)) G^-1 sum_c s_c s_c' G^-1` with `s_c = g_c - G_c delta` (K.-Y. Liang and S. L. Zeger, *Biometrika* 73
//! (1986) 13-22). Each variance is at least the variance computed from the model.

use std::collections::BTreeMap;

use hoid_model::{
    OperatorParameters, Orders, Record, Structure,
    delayed_operator::{
        DELAYED_PARAMETER_NAMES, delayed_operator_and_jacobian_with_delay_samples, delayed_operator_parameters,
        whole_samples,
    },
    uncertainty::Estimate,
};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::constancy::score_blocks;
use crate::{
    Constraint, Estimator,
    criterion::{Criterion, Data, Workspace, first_residual},
    linalg::vectors::add_scaled,
};

/// Order of the noise model.
const NOISE_ORDER: usize = 4;
/// Number of parameters of the operator.
const PARAMETER_COUNT: usize = 5;

/// Change in one parameter of an operator that improves its fit to a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatorStep {
    /// Name of the parameter.
    pub name: &'static str,
    /// The step and its standard error, in the unit of the parameter.
    pub step: Estimate,
    /// Number of blocks from which the standard error is computed.
    pub blocks: usize,
}

impl OperatorStep {
    /// Returns the probability of a step at least this large if the record agrees with the operator, by Student's
    /// distribution. `error_of_operator` is the standard error of the parameter in the operator itself; steps up to
    /// `grid` count as zero.
    pub fn p_value(&self, error_of_operator: f64, grid: f64) -> f64 {
        let Some(own) = self.step.standard_error else {
            return 1.0;
        };
        let t = (self.step.value.abs() - grid).max(0.0) / own.hypot(error_of_operator);
        let freedom = self.blocks.saturating_sub(1).max(1) as f64;
        StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |d| 2.0 * d.sf(t))
    }
}

/// Computes the steps of K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm and tau_e (s) from an operator towards the fit to
/// a record. `None` if the record is too short or carries no information.
pub fn operator_step(operator: &OperatorParameters, record: &Record) -> Option<[OperatorStep; PARAMETER_COUNT]> {
    let ts = record.sample_time();
    let eta = delayed_operator_parameters(operator);
    let whole = whole_samples(eta[4], ts).ok()?;
    let (held, slopes) = delayed_operator_and_jacobian_with_delay_samples(whole, eta, ts).ok()?;
    let orders = Orders {
        nb: 3,
        nd: NOISE_ORDER,
        nf: 2,
        nk: held.nk,
        ..Orders::default()
    };
    let names = ["b0", "b1", "b2", "f1", "f2"].map(str::to_owned);
    let values = held.b.into_iter().chain(held.f).map(Constraint::Fixed);
    let estimator = Estimator {
        constraints: names.into_iter().zip(values).collect::<BTreeMap<_, _>>(),
        ..Estimator::new(Structure::BoxJenkins, orders)
    };
    let fit = estimator.fit(std::slice::from_ref(record)).ok()?;
    let (theta, first) = (fit.model().theta(), first_residual(&orders, fit.initial_state()));
    // The coefficients of B are at the start of theta, those of F at the end.
    let places = [0, 1, 2, theta.len() - 2, theta.len() - 1];
    let mut workspace = Workspace::borrow_from_thread();
    let mut scores = |_: usize, data: Data<'_>| {
        let criterion = Criterion::for_record(orders, data, fit.initial_state(), first);
        let eps = criterion.residuals_of(theta, 0, &mut workspace);
        let psi = criterion.jacobian(theta, 0, &mut workspace);
        let column = |k: usize| {
            let mut column = vec![0.0; eps.len()];
            for (index, row) in places.iter().zip(&slopes) {
                add_scaled(&mut column, row[k], &psi[*index]);
            }
            (k, column)
        };
        let columns = (0..PARAMETER_COUNT).map(column).collect();
        Some((eps, columns))
    };
    let blocks = score_blocks(
        &Data::of(std::slice::from_ref(record)),
        first,
        PARAMETER_COUNT,
        ts.s(),
        &mut scores,
    )?;
    let n = blocks.len();
    if n <= PARAMETER_COUNT {
        return None;
    }
    let each: Vec<(DVector<f64>, DMatrix<f64>)> = blocks
        .iter()
        .map(|b| {
            (
                DVector::from_column_slice(&b.score),
                DMatrix::from_row_slice(PARAMETER_COUNT, PARAMETER_COUNT, &b.information),
            )
        })
        .collect();
    let whole = each
        .iter()
        .fold(DMatrix::zeros(PARAMETER_COUNT, PARAMETER_COUNT), |sum, (_, big)| {
            sum + big
        });
    // Scaling is needed because the units differ by orders of magnitude.
    let scale = DVector::from_fn(PARAMETER_COUNT, |i, _| whole[(i, i)].sqrt().recip());
    let scaled = DMatrix::from_fn(PARAMETER_COUNT, PARAMETER_COUNT, |i, j| {
        whole[(i, j)] * scale[i] * scale[j]
    });
    let inverse = scaled.cholesky()?.inverse();
    let inverse = DMatrix::from_fn(PARAMETER_COUNT, PARAMETER_COUNT, |i, j| {
        inverse[(i, j)] * scale[i] * scale[j]
    });
    let delta = &inverse * each.iter().fold(DVector::zeros(PARAMETER_COUNT), |sum, (g, _)| sum + g);
    let mut scatter = DMatrix::zeros(PARAMETER_COUNT, PARAMETER_COUNT);
    for (g, big) in &each {
        let score = g - big * &delta;
        scatter += &score * score.transpose();
    }
    let clustered = &inverse * scatter * &inverse * (n as f64 / (n - PARAMETER_COUNT) as f64);
    let step = |k: usize| {
        let variance = clustered[(k, k)].max(fit.innovation_variance() * inverse[(k, k)]);
        OperatorStep {
            name: DELAYED_PARAMETER_NAMES[k],
            step: Estimate::with_variance(delta[k], variance),
            blocks: n,
        }
    };
    let steps: [OperatorStep; PARAMETER_COUNT] = std::array::from_fn(step);
    steps.iter().all(|step| step.step.value.is_finite()).then_some(steps)
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::GreyBox;

    fn run(replication: u64) -> Record {
        let streams = RunSeed {
            seed: 99,
            replication,
            ..RunSeed::default()
        };
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        simulator.run(streams, false).unwrap().span(0.0, 40.0).unwrap()
    }

    fn truth() -> OperatorParameters {
        Scenario::condition(Condition::C1).initial.operator
    }

    fn of(steps: &[OperatorStep], name: &str) -> Estimate {
        steps.iter().find(|step| step.name == name).unwrap().step
    }

    #[test]
    fn one_step_reaches_the_grey_box_fit() {
        // The reference is a grey-box fit of the same stretch, whose noise model has order one instead of four.
        let record = run(1);
        let start = OperatorParameters {
            k_e: 0.97 * truth().k_e,
            ..truth()
        };
        let steps = operator_step(&start, &record).unwrap();
        let fit = GreyBox::new(1..=1)
            .fit(std::slice::from_ref(&record))
            .unwrap()
            .operator(0)
            .unwrap();
        for (name, to, from) in [
            ("K_e", fit.k_e, start.k_e),
            ("K_e_dot", fit.k_e_dot, start.k_e_dot()),
            ("omega_nm", fit.omega_nm_rad_s, start.omega_nm_rad_s),
            ("tau_e", fit.tau_e_s, start.tau_e_s),
        ] {
            let reached = from + of(&steps, name).value;
            let error = to.standard_error.unwrap();
            assert!((reached - to.value).abs() < error, "{name}: {reached} and {}", to.value);
        }
    }

    #[test]
    fn step_is_significant_only_for_a_wrong_delay() {
        let mut squares = 0.0;
        for k in 10..22 {
            let steps = operator_step(&truth(), &run(k)).unwrap();
            assert!(steps[0].blocks > 15);
            assert!(steps.iter().all(|step| step.p_value(0.0, 0.0) > 1e-4), "{steps:?}");
            let tau = of(&steps, "tau_e");
            squares += (tau.value / tau.standard_error.unwrap()).powi(2);
        }
        // Chi-square with 12 degrees of freedom exceeds 28.3 with a probability of 0.5 %; the errors are no smaller
        // than the model-based errors.
        assert!(squares < 28.3, "{squares}");
        let late = OperatorParameters {
            tau_e_s: truth().tau_e_s + 0.05,
            ..truth()
        };
        let steps = operator_step(&late, &run(30)).unwrap();
        let tau = of(&steps, "tau_e");
        assert!(tau.value < -6.0 * tau.standard_error.unwrap(), "{tau}");
        assert!(steps[4].p_value(0.0, 0.015) < 1e-4 && steps[4].p_value(0.0, 1.0) == 1.0);
    }

    #[test]
    fn uninformative_records_give_no_step() {
        let record = run(31);
        let n = record.len();
        let still = Record::new(
            record.sample_time(),
            Channel::new("e", "", vec![0.0; n]),
            Channel::new("u", "", record.output().to_vec()),
        )
        .unwrap();
        assert!(operator_step(&truth(), &still).is_none());
        assert!(operator_step(&truth(), &record.span(0.0, 3.0).unwrap()).is_none());
    }
}
