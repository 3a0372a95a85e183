//! The recursive prediction-error method of BJ(nb = 2, nd = 1, nf = 2), its covariance updated by the
//! VAF of a validation set, as the discussion of the reference text proposes (VII: *the covariance
//! matrix could be updated based on VAF from a validation data set, in order to reduce the strong
//! oscillations that are given in state s2*).
//!
//! The recursion is the text's (eq. 31 to 36 with the gradient in one direct form; L. Ljung and T.
//! Söderström, *Theory and Practice of Recursive Identification*, 1983, section 3.7):
//!
//! `w = (B/F) e(t - nk)`, `eps = D (u - w)`, `g = P psi/(lambda + psi' P psi)`,
//! `theta <- theta + g eps`, `P <- (P - g psi' P)/lambda`.
//!
//! The validation set is a second run of the same person in the same task, with its own remnant. How
//! the VAF is to update P the text does not say. Here, at regular times the model of now and that of
//! one interval before are both simulated over the last seconds of the validation set; where the one
//! of now explains less,
//!
//! `P <- P max(least, ((1 - VAF_before)/(1 - VAF_now))^power)`,
//!
//! the estimate moves less until it has forgotten; where it explains more, P stays. What is left
//! unexplained by the remnant is in both, so that a model that is right is not punished by noise.

use hoid_ident::{settings, settings::Bounds};
use hoid_model::{PolynomialModel, Record, Structure};
use nalgebra::{Matrix5, Vector5};

use super::{
    comparator::{About, Comparator, Followed, Task},
    start::Start,
};
use crate::ThesisError;

const NAME: &str = "rpem-by-vaf";
/// Halvings of a step that leaves the stable region, as the recursion of the program has them.
const MOST_HALVINGS: u32 = 12;
/// Length of the simulation before the seconds that are looked at, s: the slowest poles of a person
/// die away within it.
const WARM_S: f64 = 2.0;

settings! {
    /// Options of the recursion with a validation set.
    pub struct RpemByVaf {
        /// Memory 1/(1 - lambda)
        #[setting(unit("samples"), bounds(Bounds::AtLeast(2.0)))]
        pub memory: f64 = 256.0,
        /// P at the start, a multiple of the unit matrix
        #[setting(bounds(Bounds::PositiveFinite))]
        pub covariance: f64 = 0.1,
        /// Time between two looks at the validation set
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub interval: f64 = 0.5,
        /// Length of the validation set that is looked at
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub window: f64 = 5.12,
        /// Smallest factor of P
        #[setting(bounds(Bounds::UpTo(0.0, 1.0)))]
        pub least: f64 = 0.1,
        /// Power of the ratio of what is not explained; 0 leaves P alone
        #[setting(bounds(Bounds::NonNegative))]
        pub power: f64 = 4.0,
    }
}

/// The recursion: theta = [b0, b1, d1, f1, f2], and signals of the last two samples.
#[derive(Debug, Clone)]
struct Recursion {
    lambda: f64,
    theta: Vector5<f64>,
    p: Matrix5<f64>,
    x: f64,
    v: f64,
    w: [f64; 2],
    /// e and w behind D/F.
    x_f: [f64; 2],
    w_f: [f64; 2],
}

/// Roots of F and D inside the unit circle.
fn is_stable(theta: &Vector5<f64>) -> bool {
    let [_, _, d1, f1, f2] = theta.data.0[0];
    d1.abs() < 1.0 && f2.abs() < 1.0 && f1.abs() < 1.0 + f2
}

impl Recursion {
    fn new(theta: [f64; 5], covariance: f64, lambda: f64) -> Self {
        Self {
            lambda,
            theta: Vector5::from(theta),
            p: Matrix5::identity() * covariance,
            x: 0.0,
            v: 0.0,
            w: [0.0; 2],
            x_f: [0.0; 2],
            w_f: [0.0; 2],
        }
    }

    /// w and v of this sample with a theta.
    fn residual(&self, theta: &Vector5<f64>, x: f64, u: f64) -> (f64, f64) {
        let w = theta[0] * x + theta[1] * self.x - theta[3] * self.w[0] - theta[4] * self.w[1];
        (w, u - w)
    }

    fn step(&mut self, x: f64, u: f64) {
        let theta = self.theta;
        let x_f = x + theta[2] * self.x - theta[3] * self.x_f[0] - theta[4] * self.x_f[1];
        let psi = Vector5::new(x_f, self.x_f[0], -self.v, -self.w_f[0], -self.w_f[1]);
        let innovation = self.residual(&theta, x, u).1 + theta[2] * self.v;
        let along = self.p * psi;
        let gain = along / (self.lambda + psi.dot(&along));
        self.p = (self.p - gain * along.transpose()) / self.lambda;
        self.p = (self.p + self.p.transpose()) * 0.5;
        let moved = |halvings: u32| theta + gain * (innovation * 0.5f64.powi(halvings as i32));
        self.theta = (0..=MOST_HALVINGS).map(moved).find(is_stable).unwrap_or(theta);
        // Once more with the new estimate: a posteriori.
        let theta = self.theta;
        let (w, v) = self.residual(&theta, x, u);
        let w_f = w + theta[2] * self.w[0] - theta[3] * self.w_f[0] - theta[4] * self.w_f[1];
        self.x_f = [x_f, self.x_f[0]];
        self.w_f = [w_f, self.w_f[0]];
        self.w = [w, self.w[0]];
        (self.x, self.v) = (x, v);
    }
}

/// What a model leaves unexplained of the validation set, 1 - VAF, over `span` before sample `end`.
fn unexplained(validation: &Record, theta: &Vector5<f64>, nk: usize, end: usize, span: usize, warm: usize) -> f64 {
    let (e, u) = (validation.input(), validation.output());
    let first = end.saturating_sub(span);
    let (mut x_1, mut w) = (0.0, [0.0; 2]);
    let [mut error, mut power] = [0.0; 2];
    for k in first.saturating_sub(warm)..end {
        let x = if k >= nk { e[k - nk] } else { 0.0 };
        let now = theta[0] * x + theta[1] * x_1 - theta[3] * w[0] - theta[4] * w[1];
        (x_1, w) = (x, [now, w[0]]);
        if k >= first {
            error += (u[k] - now).powi(2);
            power += u[k] * u[k];
        }
    }
    error / power
}

impl Comparator for RpemByVaf {
    fn about(&self) -> About {
        About {
            name: NAME,
            help: "recursive prediction-error method, its covariance updated by the VAF of a validation set",
            source: "the reference text, section VII",
            told: "a second run of the same person in the same task",
        }
    }

    fn follow(&self, task: &Task<'_>) -> Result<Followed, ThesisError> {
        let (e, u) = task.signals(NAME, task.nk)?;
        let unsuited = |found: String| ThesisError::Unsuited {
            method: NAME,
            quantity: "the validation set".to_owned(),
            found,
            expected: format!("a second run of {} samples", e.len()),
        };
        let validation = task.validation.ok_or_else(|| unsuited("not there".to_owned()))?;
        if validation.len() != e.len() || validation.input().len() != e.len() {
            return Err(unsuited(format!("of {} samples", validation.len())));
        }
        let ts = task.record.sample_time();
        let samples = |time_s: f64| ((time_s / ts.s()).round() as usize).max(1);
        let (interval, window, warm) = (samples(self.interval), samples(self.window), samples(WARM_S));
        let start = Start::of(task)?;
        let mut recursion = Recursion::new(start.theta, self.covariance, 1.0 - 1.0 / self.memory);
        let mut before = recursion.theta;
        let (mut found, mut asked) = (Followed::default(), task.at.iter().peekable());
        let structure = Structure::BoxJenkins;
        let orders = structure.operator_orders(task.nk);
        for k in 0..e.len() {
            recursion.step(if k >= task.nk { e[k - task.nk] } else { 0.0 }, u[k]);
            if (k + 1).is_multiple_of(interval) {
                let of = |theta| unexplained(validation, theta, task.nk, k + 1, window, warm);
                let ratio = of(&before) / of(&recursion.theta);
                if ratio < 1.0 {
                    recursion.p *= ratio.powf(self.power).max(self.least);
                }
                before = recursion.theta;
            }
            while asked.next_if(|at| **at == k).is_some() {
                let model = PolynomialModel::new(structure, orders, ts, recursion.theta.as_slice().to_vec())?;
                let operator = model.discrete_operator().and_then(|of| of.parameters());
                found
                    .response
                    .push(task.omega_rad_s.iter().map(|omega| model.response(*omega)).collect());
                found.operator.push(operator.ok());
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::Condition;

    use super::{super::tests::*, *};

    /// Without a look at the validation set it is the textbook's recursion: the replica in Python of
    /// `fixtures/recursive/make.py`, Box-Jenkins with nk = 0.
    #[test]
    fn without_validation_it_is_the_replica() {
        let text = include_str!("../../../../fixtures/recursive/rpem.csv");
        let mut own = Recursion::new([0.02, 0.0, -0.4, -1.6, 0.7], 0.1, 1.0 - 1.0 / 256.0);
        let mut rows = 0;
        for line in text.lines().filter(|line| line.starts_with("bj,")) {
            let fields: Vec<&str> = line.split(',').collect();
            own.step(fields[6].parse().unwrap(), fields[7].parse().unwrap());
            for (found, expected) in own.theta.iter().zip(fields[9].split(' ')) {
                let expected: f64 = expected.parse().unwrap();
                assert!((found - expected).abs() < 1e-9, "{rows}: {found} {expected}");
            }
            rows += 1;
        }
        assert_eq!(rows, 300);
    }

    #[test]
    fn what_is_not_explained_is_that_of_the_remnant_at_the_truth() {
        let run = Run::of(Condition::C1, 1, 0.0);
        let truth = run.operator(0).discretise(run.record.sample_time()).unwrap().held;
        let theta = Vector5::new(truth.b0, truth.b1, 0.0, truth.f1, truth.f2);
        let exact = unexplained(&run.record, &theta, 29, 4000, 500, 400);
        assert!(exact < 1e-5, "{exact}");
        // Half of every gain leaves a quarter of the power.
        let half = Vector5::new(0.5 * truth.b0, 0.5 * truth.b1, 0.0, truth.f1, truth.f2);
        let found = unexplained(&run.record, &half, 29, 4000, 500, 400);
        assert!((found - 0.25).abs() < 0.01, "{found}");
    }

    #[test]
    fn a_power_of_zero_leaves_the_covariance_alone_and_another_does_not() {
        let run = Run::of(Condition::C4, 2, 0.2);
        let of = |power: f64| {
            let method = RpemByVaf {
                power,
                ..RpemByVaf::default()
            };
            method.follow(&run.task()).unwrap().response
        };
        assert_ne!(of(0.0), of(4.0));
        let without = Task {
            validation: None,
            ..run.task()
        };
        let refused = RpemByVaf::default().follow(&without).unwrap_err().to_string();
        assert!(refused.contains("validation set"), "{refused}");
    }
}
