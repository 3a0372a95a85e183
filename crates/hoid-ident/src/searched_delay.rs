//! Contribution of a delay found by a search to the error bars of a fit.
//!
//! If nk is found by a search, it is estimated from the data like theta, and theta depends on it. The residual also has
//! a derivative with respect to the delay tau. With the filtered response of the model
//! `x = (D/C) w = sum_j b_j psi_bj`, this derivative is computed by central differences,
//! `d(t) = -d eps/d tau = (x(t-1) - x(t+1))/(2 Ts)`. With `G = psi' psi` the estimate of theta depends on the delay
//! with the slope
//!
//! `s = d theta/d tau = -G^-1 psi' d`
//!
//! and the component of `d` orthogonal to psi determines the delay:
//! `var tau = sigma^2/(d'd - d' psi G^-1 psi' d) + Ts^2/12`. The first term is sigma^2 times the diagonal element for
//! tau of the inverse information matrix of theta and tau together (L. Ljung, *System Identification*, 1999, section
//! 9.4). The second term is due to the integer nk (W. F. Sheppard, *Proc. London Math. Soc.* 29 (1898) 353-380). The
//! variance is limited to the variance of a uniform distribution over the searched range. The covariance of theta
//! becomes `P + s s' var tau`, and a quantity with the gradient g with respect to theta and the derivative h with
//! respect to the delay has the variance
//!
//! `g' P g + (g' s + h)^2 var tau`.
//!
//! For the frequency response, the two terms of `g' s + h` partly cancel: a longer delay is compensated by a faster
//! neuromuscular system.

use hoid_model::Record;
use nalgebra::{DMatrix, DVector};

use crate::{
    Fit,
    criterion::{Criterion, Data, Workspace, first_residual},
    fit::SearchedDelay,
    linalg::vectors::dot,
};

impl Fit {
    /// Returns the fit with the delay treated as an estimate from a search over `delays` values of nk. Models that do
    /// not represent an operator are returned unchanged: with many coefficients of B, a shift by one sample only
    /// renumbers them.
    pub(crate) fn with_searched_delay(self, records: &[Record], delays: usize) -> Self {
        match self.searched_delay(records, delays) {
            None => self,
            Some(delay) => {
                let p = delay.slope.len();
                let spread = |k: usize| delay.variance_s2 * delay.slope[k / p] * delay.slope[k % p];
                let covariance = self.covariance.as_ref();
                let covariance = covariance.map(|c| c.iter().enumerate().map(|(k, c)| c + spread(k)).collect());
                Self {
                    covariance,
                    searched_delay: Some(delay),
                    ..self
                }
            }
        }
    }

    fn searched_delay(&self, records: &[Record], delays: usize) -> Option<SearchedDelay> {
        let apart = self.instrumented || self.physical.is_some();
        if apart || delays < 2 || self.covariance.is_none() || self.operator().is_err() {
            return None;
        }
        let (orders, theta, ts) = (self.orders(), self.model.theta(), self.model.sample_time().s());
        let free: Vec<usize> = (0..theta.len()).filter(|i| !self.is_fixed_or_bounded[*i]).collect();
        let n = free.len();
        let mut gram = DMatrix::<f64>::zeros(n, n);
        let mut along = DVector::<f64>::zeros(n);
        let mut own = 0.0;
        let mut workspace = Workspace::borrow_from_thread();
        for data in Data::of(records) {
            let first = first_residual(&orders, self.initial_state);
            let criterion = Criterion::for_record(orders, data, self.initial_state, first);
            let psi = self.jacobian_with_delay(&criterion, &mut workspace);
            let d = &psi[theta.len()];
            own += dot(d, d);
            for (i, &at) in free.iter().enumerate() {
                along[i] += dot(&psi[at], d);
                for (j, &other) in free.iter().enumerate() {
                    gram[(i, j)] += dot(&psi[at], &psi[other]);
                }
            }
        }
        let a = gram.cholesky()?.solve(&along);
        // Variance of a uniform distribution over the searched range: the uncertainty without data.
        let most = (delays as f64 * ts).powi(2) / 12.0;
        let known = own - along.dot(&a);
        let from_data = if known > 0.0 {
            self.innovation_variance / known
        } else {
            most
        };
        let variance_s2 = (from_data + ts * ts / 12.0).min(most);
        let mut slope: Vec<f64> = vec![0.0; theta.len()];
        for (&at, a) in free.iter().zip(a.iter()) {
            slope[at] = -a;
        }
        let finite = variance_s2.is_finite() && slope.iter().all(|s| s.is_finite());
        finite.then_some(SearchedDelay { variance_s2, slope })
    }

    /// Returns the columns of psi for the record of a criterion, followed by the column d: the negative derivative of
    /// the residual with respect to the delay, as if the delay were the last element of theta.
    pub(crate) fn jacobian_with_delay(&self, criterion: &Criterion<'_>, workspace: &mut Workspace) -> Vec<Vec<f64>> {
        let mut psi = criterion.jacobian(self.model.theta(), 0, workspace);
        let of_b = &psi[criterion.orders.na..];
        psi.push(delay_derivative(self.model.b(), of_b, self.model.sample_time().s()));
        psi
    }
}

/// Returns `-d eps/d tau`, computed from the columns of psi for the coefficients of B.
fn delay_derivative(b: &[f64], of_b: &[Vec<f64>], sample_time_s: f64) -> Vec<f64> {
    let n = of_b.first().map_or(0, Vec::len);
    let x = |t: usize| -> f64 { b.iter().zip(of_b).map(|(b, column)| b * column[t]).sum() };
    (0..n)
        .map(|t| {
            let (before, next) = (t.saturating_sub(1), (t + 1).min(n - 1));
            (x(before) - x(next)) / ((next - before).max(1) as f64 * sample_time_s)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Complex64, Orders, PolynomialModel, Structure,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{
        Estimator,
        order_selection::{Choice, Criterion, OrderRanges, choose_orders},
    };

    fn run(replication: u64) -> Record {
        let streams = RunSeed {
            seed: 271,
            replication,
            ..RunSeed::default()
        };
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        simulator.run(streams, false).unwrap().span(0.0, 40.0).unwrap()
    }

    fn search_delay(record: &Record) -> Choice {
        let orders = Structure::BoxJenkins.operator_orders(29);
        let mut ranges = OrderRanges::from(orders);
        ranges.nk = 25..=33;
        let template = Estimator::new(Structure::BoxJenkins, orders);
        choose_orders(&template, &ranges, Criterion::Loss, std::slice::from_ref(record)).unwrap()
    }

    #[test]
    fn slope_of_theta_matches_neighbouring_delays() {
        // The reference is the chord between the fits with a delay one sample shorter and one sample longer, 20 ms
        // apart.
        let record = run(0);
        let fit = search_delay(&record).fit;
        let slope = &fit.searched_delay.as_ref().unwrap().slope;
        let nk = fit.orders().nk;
        let at = |nk: usize| {
            let orders = Orders { nk, ..fit.orders() };
            let estimator = Estimator::new(Structure::BoxJenkins, orders);
            estimator
                .fit(std::slice::from_ref(&record))
                .unwrap()
                .model()
                .theta()
                .to_vec()
        };
        let (before, next) = (at(nk - 1), at(nk + 1));
        let b = fit.model().b()[0];
        for (i, slope) in slope.iter().enumerate() {
            let chord = (next[i] - before[i]) / (2.0 * record.sample_time().s());
            // The tolerance is a fifth of the largest value.
            assert!(
                (slope - chord).abs() < 0.2 * chord.abs().max(0.2 * b / 0.01),
                "{i}: {slope} and {chord}"
            );
        }
    }

    #[test]
    fn errors_are_valid_for_a_searched_delay() {
        let truth = Scenario::condition(Condition::C1).initial.operator;
        let omega = 12.0;
        let response = {
            let held = truth.discretise(run(0).sample_time()).unwrap();
            let theta = vec![held.zoh.b0, held.zoh.b1, held.zoh.f1, held.zoh.f2];
            let orders = Structure::OutputError.operator_orders(held.nk);
            let model = PolynomialModel::new(Structure::OutputError, orders, held.sample_time, theta);
            model.unwrap().response(omega)
        };
        let runs = 40;
        let (mut z2, mut without) = ([0.0; 3], 0.0);
        for k in 0..runs {
            let fit = search_delay(&run(k)).fit;
            let found = fit.operator().unwrap();
            let z = |value: f64, truth: f64, error: Option<f64>| ((value - truth) / error.unwrap()).powi(2);
            z2[0] += z(
                found.omega_nm_rad_s.value,
                truth.omega_nm_rad_s,
                found.omega_nm_rad_s.standard_error,
            );
            z2[1] += z(found.tau_e_s.value, truth.tau_e_s, found.tau_e_s.standard_error);
            let phase = fit.frequency_response(&[omega])[0].phase_deg;
            let off = (Complex64::from_polar(1.0, phase.value.to_radians()) / response).arg();
            z2[2] += z(off.to_degrees(), 0.0, phase.standard_error);
            // For the standard error with a known nk, the contribution of the delay is removed.
            let delay = fit.searched_delay.clone().unwrap();
            let p = delay.slope.len();
            let mut bare = fit.clone();
            let covariance = bare.covariance.as_mut().unwrap();
            for (k, c) in covariance.iter_mut().enumerate() {
                *c -= delay.variance_s2 * delay.slope[k / p] * delay.slope[k % p];
            }
            bare.searched_delay = None;
            let bare = bare.operator().unwrap().omega_nm_rad_s;
            without += z(bare.value, truth.omega_nm_rad_s, bare.standard_error);
        }
        let n = runs as f64;
        // The mean square of 40 standard normal numbers is 1 with a standard error of 0.22.
        assert!(z2.iter().all(|s| (0.4..1.6).contains(&(s / n))), "{z2:?}");
        assert!(without / n > 1.5, "{without}");
    }

    #[test]
    fn given_delays_and_fir_models_add_no_delay_variance() {
        let record = run(1);
        let given = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29));
        let fit = given.fit(std::slice::from_ref(&record)).unwrap();
        assert_eq!(fit.operator().unwrap().tau_e_s.standard_error, None);
        let orders = Orders {
            nb: 30,
            nk: 20,
            ..Orders::default()
        };
        let mut ranges = OrderRanges::from(orders);
        ranges.nk = 20..=22;
        let template = Estimator::new(Structure::Fir, orders);
        let choice = choose_orders(&template, &ranges, Criterion::Loss, std::slice::from_ref(&record)).unwrap();
        assert_eq!(choice.fit.searched_delay, None);
    }

    #[test]
    fn delay_variance_is_limited_by_the_search_range() {
        // With this innovation variance the data carry no information about the delay.
        let record = run(2);
        let delays = 3;
        let fit = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29))
            .fit(std::slice::from_ref(&record))
            .unwrap();
        let poor = Fit {
            innovation_variance: 1e6,
            ..fit
        };
        let found = poor.with_searched_delay(std::slice::from_ref(&record), delays);
        let most = (3.0 * 0.01_f64).powi(2) / 12.0;
        assert!((found.searched_delay.unwrap().variance_s2 - most).abs() < 1e-15);
    }
}
