//! Predictor-based subspace identification of a model whose parameters vary linearly with a known signal (J.-W. van
//! Wingerden and M. Verhaegen, *Subspace identification of bilinear and LPV systems for open- and closed-loop data*,
//! Automatica 45 (2009) 372-381; for human operators: R. F. M. Duarte, D. M. Pool, M. M. van Paassen and M. Mulder,
//! *Experimental scheduling functions for global LPV human controller modeling*, IFAC 2017).
//!
//! `x(k+1) = A x(k) + (B_0 + mu(k) B_1) v(k) + K eps(k)`, `u(k) = C x(k) + eps(k)`.
//!
//! At 100 Hz consecutive states differ by a few hundredths, too little to determine B. Therefore only every d-th sample
//! of u is used, and v(k) is the mean of the d values of e that act until the next sample used, delayed by nk - 1
//! samples. The scheduling signal mu is the sigmoid of the controlled element, which the experimenter knows (the
//! analytical scheduling of the source). Only the gains of an operator change, so A, C and K do not depend on mu, and
//! the number of coefficients is proportional to the window p instead of 2^p. The steps are:
//!
//! 1. Estimate by least squares the predictor `u(k) = sum_{i=1..p} C Ã^(i-1) [B_0, B_1, K] z(k-i) + eps`, with
//!    `z = [v, mu v, u]` and `Ã = A - K C`; p must be large enough that Ã^p is negligible.
//! 2. The same coefficients, shifted and multiplied by z, give `Gamma x(k)`, the prediction of the next f outputs from
//!    the past. The n principal directions of this prediction over the record form a state.
//! 3. With the state of step 2, estimate C by least squares; the residuals are eps. Then estimate A, B_0, B_1 and K by
//!    least squares.
//!
//! The response at t is the response of the model with mu(t) held constant. If nothing changes, mu is omitted.

use hoid_ident::{settings, settings::Bounds};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::{
    comparator::{Comparator, ComparatorDescription, Task, TrackingResult},
    least_squares::NormalEquations,
};
use crate::ThesisError;

const NAME: &str = "lpv-subspace";
/// Ridge, as a fraction of the mean diagonal, that keeps the predictor's normal equations positive definite if the
/// input consists of a few lines.
const RIDGE_SHARE: f64 = 1e-9;

settings! {
    /// Options of the subspace method.
    pub struct LpvSubspace {
        /// Every N-th sample is used
        #[setting(bounds(Bounds::AtLeast(1.0)))]
        pub decimate: usize = 4,
        /// Past window p, in samples used
        #[setting(unit("samples"), bounds(Bounds::AtLeast(2.0)))]
        pub past: usize = 12,
        /// Future window f, at most the past window
        #[setting(unit("samples"), bounds(Bounds::AtLeast(2.0)))]
        pub future: usize = 6,
        /// Model order n: two for the neuromuscular part, the rest for the remnant
        #[setting(bounds(Bounds::AtLeast(1.0)))]
        pub order: usize = 4,
    }
}

/// State-space model from v and mu v to u.
#[derive(Debug, Clone)]
struct Model {
    a: DMatrix<f64>,
    /// B_0, and B_1 if there is a scheduling signal.
    b: Vec<DVector<f64>>,
    c: DVector<f64>,
}

impl Model {
    fn response(&self, mu: f64, z: Complex64) -> Complex64 {
        let n = self.a.nrows();
        let complex = |x: f64| Complex64::new(x, 0.0);
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            (if i == j { z } else { Complex64::default() }) - self.a[(i, j)]
        });
        let input = match self.b.as_slice() {
            [b_0, b_1] => b_0 + b_1 * mu,
            all => all[0].clone(),
        };
        let state = matrix.lu().solve(&input.map(complex));
        state.map_or(Complex64::new(f64::NAN, f64::NAN), |x| {
            x.iter().zip(self.c.iter()).map(|(x, c)| x * c).sum()
        })
    }
}

/// Returns the scheduling signal mu at a time.
fn scheduling_signal(change: Option<(f64, f64)>, t_s: f64) -> f64 {
    change.map_or(0.0, |(at_s, rate)| 1.0 / (1.0 + (-rate * (t_s - at_s)).exp()))
}

impl LpvSubspace {
    /// Fits the model to z = [v, (mu v), u] at each sample; the last entry is the output.
    fn fit(&self, z: &[Vec<f64>]) -> Result<Model, ThesisError> {
        let (width, p, f) = (z[0].len(), self.past, self.future.min(self.past));
        let output = |k: usize| z[k][width - 1];
        let past = |k: usize| (1..=p).flat_map(move |i| z[k - i].iter().copied());
        let mut predictor = NormalEquations::new(p * width, 1);
        let mut regressors = vec![0.0; p * width];
        for k in p..z.len() {
            for (to, from) in regressors.iter_mut().zip(past(k)) {
                *to = from;
            }
            predictor.add(1.0, &regressors, &[output(k)]);
        }
        let theta = predictor.solve(NAME, &predictor.ridge(RIDGE_SHARE))?;
        // Row r of Gamma x(k) uses the coefficients from block r on, for the same past.
        let mut ahead = DMatrix::zeros(f, z.len() - p);
        for k in p..z.len() {
            let known: Vec<f64> = past(k).collect();
            for r in 0..f {
                let shifted = &theta.as_slice()[r * width..];
                ahead[(r, k - p)] = shifted.iter().zip(&known).map(|(a, b)| a * b).sum();
            }
        }
        let states = self.states(&ahead)?;
        self.model_from_states(z, &states)
    }

    /// Returns the state: the principal directions of the prediction of the future from the past, scaled to unit power.
    fn states(&self, ahead: &DMatrix<f64>) -> Result<DMatrix<f64>, ThesisError> {
        let gram = (ahead * ahead.transpose()) / ahead.ncols() as f64;
        let eigen = gram.symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|i, j| eigen.eigenvalues[*j].total_cmp(&eigen.eigenvalues[*i]));
        let n = self.order;
        let unsuited = |found: String| ThesisError::Unsuited {
            method: NAME,
            quantity: "the rank of the prediction of the future from the past".to_owned(),
            found,
            expected: format!("at least the order {n}; lower the order, or lengthen future"),
        };
        if n > order.len() {
            return Err(unsuited(order.len().to_string()));
        }
        let least = f64::EPSILON * eigen.eigenvalues[order[0]].max(0.0);
        if let Some(rank) = (0..n).find(|i| eigen.eigenvalues[order[*i]] <= least) {
            return Err(unsuited(rank.to_string()));
        }
        let rows: Vec<_> = order[..n]
            .iter()
            .map(|i| eigen.eigenvectors.column(*i).transpose() * ahead / eigen.eigenvalues[*i].sqrt())
            .collect();
        Ok(DMatrix::from_rows(&rows))
    }

    /// Estimates A, B and C for a known state.
    fn model_from_states(&self, z: &[Vec<f64>], states: &DMatrix<f64>) -> Result<Model, ThesisError> {
        let (n, width, p) = (self.order, z[0].len(), self.past);
        let mut output = NormalEquations::new(n, 1);
        for (i, x) in states.column_iter().enumerate() {
            output.add(1.0, x.as_slice(), &[z[p + i][width - 1]]);
        }
        let c = output.solve(NAME, &output.ridge(0.0))?.column(0).into_owned();
        // The regressors are the state, the inputs, and the innovation in place of the output.
        let mut next = NormalEquations::new(n + width, n);
        for i in 0..states.ncols() - 1 {
            let x = states.column(i);
            let mut regressors: Vec<f64> = x.iter().chain(&z[p + i]).copied().collect();
            regressors[n + width - 1] -= x.dot(&c);
            next.add(1.0, &regressors, states.column(i + 1).as_slice());
        }
        let theta = next.solve(NAME, &next.ridge(0.0))?;
        Ok(Model {
            a: theta.rows(0, n).transpose(),
            b: (n..n + width - 1).map(|i| theta.row(i).transpose()).collect(),
            c,
        })
    }
}

impl Comparator for LpvSubspace {
    fn description(&self) -> ComparatorDescription {
        ComparatorDescription {
            name: NAME,
            help: "predictor-based subspace identification of an LPV model",
            source: "van Wingerden and Verhaegen 2009; Duarte et al. 2017",
            extra_information: "the time and rate of the change of the controlled element, and the whole record",
        }
    }

    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
        let d = self.decimate;
        let (e, u) = task.signals(NAME, d * (4 * self.past + 4) + task.nk)?;
        let ts = task.record.sample_time().s();
        let late = task.nk.saturating_sub(1);
        let sample = |first: usize| {
            let acting = (first..first + d).filter(|k| *k >= late).map(|k| e[k - late]);
            let v = acting.sum::<f64>() / d as f64;
            let mu = scheduling_signal(task.change, task.record.time_s(first));
            match task.change {
                Some(_) => vec![v, mu * v, u[first]],
                None => vec![v, u[first]],
            }
        };
        let z: Vec<Vec<f64>> = (0..e.len() / d).map(|k| sample(k * d)).collect();
        let model = self.fit(&z)?;
        let at = |k: &usize| {
            let mu = scheduling_signal(task.change, task.record.time_s(*k));
            let of = |omega: &f64| {
                let turn = |samples: f64| Complex64::from_polar(1.0, omega * ts * samples);
                let mean: Complex64 = (0..d).map(|i| turn(i as f64 - late as f64) / d as f64).sum();
                model.response(mu, turn(d as f64)) * mean
            };
            task.omega_rad_s.iter().map(of).collect()
        };
        let response: Vec<Vec<Complex64>> = task.requested_samples.iter().map(at).collect();
        Ok(TrackingResult::without_operator(response))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::Condition;
    use hoid_sim::RunSeed;

    use super::{super::tests::*, *};

    /// A second-order system of the assumed structure, with white input and innovations of a tenth of the output: the
    /// response is correct before and after the change.
    #[test]
    fn system_of_the_assumed_structure_is_identified() {
        let white = |cell| {
            RunSeed {
                cell,
                ..RunSeed::default()
            }
            .white_noise(12_000)
        };
        let (v, noise) = (white(1), white(2));
        let (f1, f2) = (-1.5, 0.7);
        // Observable canonical form: x1 is the output without noise.
        let gains = |mu: f64| [1.0 + mu, 0.5 - 0.2 * mu];
        let mu = |k: usize| scheduling_signal(Some((60.0, 0.5)), 0.01 * k as f64);
        let (mut x, mut z) = ([0.0; 2], Vec::new());
        for k in 0..v.len() {
            let eps = 0.4 * noise[k];
            let u = x[0] + eps;
            z.push(vec![v[k], mu(k) * v[k], u]);
            let b = gains(mu(k));
            x = [
                -f1 * x[0] + x[1] + b[0] * v[k] + 0.3 * eps,
                -f2 * x[0] + b[1] * v[k] + 0.1 * eps,
            ];
        }
        let method = LpvSubspace {
            decimate: 1,
            past: 30,
            future: 15,
            order: 2,
        };
        let model = method.fit(&z).unwrap();
        for (mu, angle) in [(0.0, 0.1), (0.0, 0.6), (1.0, 0.1), (1.0, 0.6)] {
            let at = Complex64::from_polar(1.0, angle);
            let [b_1, b_2] = gains(mu);
            let expected = (b_1 / at + b_2 / (at * at)) / (1.0 + f1 / at + f2 / (at * at));
            let found = model.response(mu, at);
            // The standard error of a response from 12 000 samples is about 1 %.
            assert!(
                (found / expected - 1.0).norm() < 0.04,
                "{mu} {angle}: {found} {expected}"
            );
        }
    }

    #[test]
    fn operator_after_the_change_is_close_on_average() {
        const RUN_COUNT: u64 = 4;
        let mut mean = [0.0; 2];
        for replication in 0..RUN_COUNT {
            let run = Run::replication(Condition::C4, 1, 0.1, replication);
            let found = LpvSubspace::default().track(&run.task()).unwrap();
            for ((mean, found), expected) in mean.iter_mut().zip(&found.response).zip(run.responses()) {
                *mean += error(found, &expected) / RUN_COUNT as f64;
            }
        }
        assert!(mean.iter().all(|off| *off < 0.35), "{mean:?}");
    }

    #[test]
    fn too_high_order_is_refused() {
        let e: Vec<f64> = (0..2000).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let record = test_record(&e, &vec![0.0; 2000]);
        let refused = LpvSubspace::default()
            .track(&test_task(&record, &[1999], &[1.0]))
            .unwrap_err();
        assert!(refused.to_string().contains("rank"), "{refused}");
        let many = LpvSubspace {
            future: 2,
            ..LpvSubspace::default()
        };
        assert!(many.track(&test_task(&record, &[1999], &[1.0])).is_err());
        let short = test_record(&[1.0; 100], &[1.0; 100]);
        assert!(LpvSubspace::default().track(&test_task(&short, &[99], &[1.0])).is_err());
    }
}
