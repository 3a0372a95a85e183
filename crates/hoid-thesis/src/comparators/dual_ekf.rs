//! Two extended Kalman filters that take turns: one of the state with the parameters held, one of
//! the parameters with the state held (E. A. Wan and A. T. Nelson, *Dual extended Kalman filter
//! methods*, chapter 5 of S. Haykin (ed.), *Kalman Filtering and Neural Networks*, 2001; of
//! operators: A. Popovici, P. M. T. Zaal and D. M. Pool, *Dual extended Kalman filter for the
//! identification of time-varying human manual control behavior*, AIAA 2017).
//!
//! State `x = [y_0, y_1, .., n]`: neuromuscular position and rate, and the remnant as AR(1),
//!
//! `x(k) = A(w) x(k-1) + B(w) e(k - nk) + w_x`, `u = C(w) x`, `C = [K_e, K_e_dot, 1]`,
//!
//! A and B held exactly. Parameters `w = [K_e, K_e_dot, omega_nm, zeta_nm]` are a random walk. At
//! each sample the parameters are predicted (they stay, P_w grows), the state is predicted with
//! them, and the innovation `eps = u - C x` corrects both: the parameters along `h = d(C x)/dw`, the
//! whole derivative, in which the state's own dependence goes along,
//!
//! `D(k|k-1) = A D(k-1|k-1) + (dA/dw) x + (dB/dw) e`, `h = C D(k|k-1) + (dC/dw) x`,
//! `D(k|k) = D(k|k-1) - g h` with the gain g of the state filter (its own dependence on w left out).
//!
//! A joint filter ([`hoid_track`]'s `ekf`) keeps the covariance between state and parameters, which
//! two filters that take turns do not have. By default the delay is whole samples, as all other
//! methods have it. With `pade` of 1 to 3 it is a parameter too, behind the approximation of that
//! order, as the source and the discussion of the reference text have it for a delay that is no
//! multiple of the sample time or changes ([`super::pade`]); its states stand between y_1 and n.

use std::ops::AddAssign;

use hoid_ident::{settings, settings::Bounds};
use hoid_model::{OperatorParameters, SampleTime, second_order::HeldStates};
use nalgebra::{DMatrix, DVector, RowDVector};

use super::{
    comparator::{About, Comparator, Followed, Task},
    pade,
    start::Start,
};
use crate::ThesisError;

const NAME: &str = "dual-ekf";
/// Relative step of the central differences of the held matrices.
const STEP: f64 = 1e-5;
/// Least error of every parameter at the start where the delay is open, share of its value.
const UNKNOWN: f64 = 0.1;
/// Most halvings of a step of the parameters.
const MOST_HALVINGS: usize = 30;

settings! {
    /// Options of the two filters.
    pub struct DualEkf {
        /// Drift of K_e and K_e_dot in a root second, share of their start
        #[setting(bounds(Bounds::NonNegative))]
        pub drift: f64 = 0.1,
        /// Drift of omega_nm and zeta_nm in a root second, share of their start
        #[setting(bounds(Bounds::NonNegative))]
        pub drift_nms: f64 = 0.005,
        /// Drift of tau_e in a root second, share of its start, behind a Padé approximation
        #[setting(bounds(Bounds::NonNegative))]
        pub drift_delay: f64 = 0.02,
        /// Error that enters the neuromuscular part beside e, share of the size of e
        #[setting(bounds(Bounds::NonNegative))]
        pub state_noise: f64 = 0.1,
        /// Order of the Padé approximation of the delay, 1 to 3; 0 for whole samples
        pub pade: usize = 0,
    }
}

/// Both filters.
#[derive(Debug, Clone)]
struct Filters {
    sample_time: SampleTime,
    d1: f64,
    /// Order of the Padé approximation, 0 for none.
    pade: usize,
    /// Variances of the innovation of the remnant, and of what enters beside e.
    innovation_variance: f64,
    beside_e: f64,
    x: DVector<f64>,
    p: DMatrix<f64>,
    /// K_e, K_e_dot, omega_nm, zeta_nm, and tau_e behind a Padé approximation.
    w: DVector<f64>,
    p_w: DMatrix<f64>,
    /// Growth of P_w at a sample.
    walk: DVector<f64>,
    /// dx/dw after the correction.
    slope: DMatrix<f64>,
}

impl Filters {
    /// A and B of the state for some parameters.
    fn held(&self, w: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.x.len();
        let (mut a, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        a[(n - 1, n - 1)] = -self.d1;
        let (omega, zeta) = (w[2], w[3]);
        let square = omega * omega;
        if self.pade == 0 {
            let of = HeldStates::new(2.0 * zeta * omega, square, self.sample_time);
            for i in 0..2 {
                for j in 0..2 {
                    a[(i, j)] = of.transition[i][j];
                }
                b[i] = square * of.input[i];
            }
            return (a, b);
        }
        let (own, input) = pade::delayed_second_order(omega, zeta, w[4], self.pade, self.sample_time);
        a.view_mut((0, 0), (n - 1, n - 1)).copy_from(&own);
        b.rows_mut(0, n - 1).copy_from(&input);
        (a, b)
    }

    fn output(&self) -> RowDVector<f64> {
        let n = self.x.len();
        RowDVector::from_fn(n, |_, i| match i {
            0 => self.w[0],
            1 => self.w[1],
            i if i + 1 == n => 1.0,
            _ => 0.0,
        })
    }

    /// Predicts the state: x, P, dx/dw.
    fn predict(&mut self, e: f64) {
        let (a, b) = self.held(&self.w);
        let mut slope = &a * &self.slope;
        // K_e and K_e_dot stand in C alone.
        for i in 2..self.w.len() {
            let by = STEP * self.w[i];
            let moved = |by: f64| {
                let mut w = self.w.clone();
                w[i] += by;
                let (a, b) = self.held(&w);
                a * &self.x + b * e
            };
            let along = (moved(by) - moved(-by)) / (2.0 * by);
            slope.column_mut(i).add_assign(&along);
        }
        self.slope = slope;
        let n = self.x.len();
        self.x = &a * &self.x + &b * e;
        self.p = &a * &self.p * a.transpose() + &b * b.transpose() * self.beside_e;
        self.p[(n - 1, n - 1)] += self.innovation_variance;
    }

    /// Corrects the state, and the parameters where they move; the innovation.
    fn correct(&mut self, u: f64, moves: bool) -> f64 {
        let c = self.output();
        let innovation = u - (&c * &self.x)[0];
        // A little more than nothing: u has no noise of its own.
        let variance = (&c * &self.p * c.transpose())[0] + 1e-9 * self.innovation_variance;
        let gain = &self.p * c.transpose() / variance;
        let h = self.along();
        if moves {
            self.move_parameters(&h, innovation, variance);
        }
        self.x += &gain * innovation;
        self.slope -= &gain * h;
        self.p -= &gain * (c * &self.p);
        self.p = (&self.p + self.p.transpose()) * 0.5;
        innovation
    }

    /// h, the whole derivative of the prediction.
    fn along(&self) -> RowDVector<f64> {
        let mut h = self.output() * &self.slope;
        h[0] += self.x[0];
        h[1] += self.x[1];
        h
    }

    fn move_parameters(&mut self, h: &RowDVector<f64>, innovation: f64, variance: f64) {
        self.p_w += DMatrix::from_diagonal(&self.walk);
        let s = (h * &self.p_w * h.transpose())[0] + variance;
        let gain = &self.p_w * h.transpose() / s;
        let mut step = &gain * innovation;
        // Poles and delay stay positive: a linear step may go too far.
        for _ in 0..MOST_HALVINGS {
            let moved = &self.w + &step;
            if moved.rows(2, moved.len() - 2).iter().all(|x| *x > 0.0) {
                self.w = moved;
                break;
            }
            step *= 0.5;
        }
        self.p_w -= &gain * (h * &self.p_w);
        self.p_w = (&self.p_w + self.p_w.transpose()) * 0.5;
    }

    fn operator(&self, tau_e_s: f64) -> OperatorParameters {
        OperatorParameters {
            k_e: self.w[0],
            t_l_s: self.w[1] / self.w[0],
            omega_nm_rad_s: self.w[2],
            zeta_nm: self.w[3],
            tau_e_s: if self.pade == 0 { tau_e_s } else { self.w[4] },
        }
    }
}

impl DualEkf {
    fn filters(&self, task: &Task<'_>, e: &[f64], start: &Start) -> Filters {
        let ts = task.record.sample_time();
        let from = start.operator;
        let mut all = vec![from.k_e, from.k_e_dot, from.omega_nm_rad_s, from.zeta_nm];
        let mut drifts = vec![self.drift, self.drift, self.drift_nms, self.drift_nms];
        if self.pade > 0 {
            all.push(from.tau_e_s);
            drifts.push(self.drift_delay);
        }
        let power = e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64;
        // The errors of the start fit are those for its delay: where that is open, so are they.
        let least = if self.pade > 0 { UNKNOWN } else { 0.0 };
        let (n, p) = (3 + self.pade, all.len());
        let of = |value: fn(f64, f64, f64) -> f64| {
            DVector::from_fn(p, |i, _| {
                let fitted = all[i].standard_error.unwrap_or(0.0);
                value(all[i].value, fitted.max(least * all[i].value.abs()), drifts[i])
            })
        };
        Filters {
            sample_time: ts,
            d1: start.d1(),
            pade: self.pade,
            innovation_variance: start.innovation_variance,
            beside_e: self.state_noise * self.state_noise * power,
            x: DVector::zeros(n),
            p: DMatrix::identity(n, n) * power,
            w: of(|value, _, _| value),
            p_w: DMatrix::from_diagonal(&of(|_, error, _| error * error)),
            walk: of(|value, _, drift| (drift * value).powi(2)) * ts.s(),
            slope: DMatrix::zeros(n, p),
        }
    }
}

impl Comparator for DualEkf {
    fn about(&self) -> About {
        About {
            name: NAME,
            help: "two extended Kalman filters that take turns, of state and of parameters",
            source: "Wan and Nelson 2001; Popovici et al. 2017",
            told: "",
        }
    }

    fn follow(&self, task: &Task<'_>) -> Result<Followed, ThesisError> {
        if self.pade > pade::HIGHEST {
            return Err(ThesisError::Unsuited {
                method: NAME,
                quantity: "the order of the Padé approximation".to_owned(),
                found: self.pade.to_string(),
                expected: format!("0 to {}", pade::HIGHEST),
            });
        }
        let (e, u) = task.signals(NAME, task.nk)?;
        let ts = task.record.sample_time();
        let start = Start::of(task)?;
        let mut filters = self.filters(task, e, &start);
        let (mut found, mut asked) = (Followed::default(), task.at.iter().peekable());
        for k in 0..e.len() {
            // Behind a Padé approximation the delay is the filters' own, but for the hold.
            let late = if self.pade == 0 { task.nk } else { 1 };
            filters.predict(if k >= late { e[k - late] } else { 0.0 });
            // Until the end of the start span the filters follow and the parameters stay: no sample
            // counts twice.
            filters.correct(u[k], task.record.time_s(k) >= task.start_s.1 - 0.5 * ts.s());
            while asked.next_if(|at| **at == k).is_some() {
                found.push(task, Some(filters.operator(start.operator.tau_e_s.value)))?;
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

    fn filters(w: &[f64], pade: usize) -> Filters {
        let (n, p) = (3 + pade, w.len());
        Filters {
            sample_time: SampleTime::new(0.01).unwrap(),
            d1: -0.8,
            pade,
            innovation_variance: 1e-4,
            beside_e: 0.0,
            x: DVector::zeros(n),
            // Nothing of the state is unsure and nothing enters: the gain of y_0 and y_1 is zero,
            // that of n does not depend on w.
            p: DMatrix::zeros(n, n),
            w: DVector::from_row_slice(w),
            p_w: DMatrix::identity(p, p),
            walk: DVector::zeros(p),
            slope: DMatrix::zeros(n, p),
        }
    }

    /// h is the derivative of the prediction while the parameters stand still, with and without
    /// Padé's delay.
    #[test]
    fn the_whole_derivative_is_that_of_finite_differences() {
        let e = |k: usize| (0.07 * k as f64).sin() + 0.3 * (0.31 * k as f64).cos();
        let u = |k: usize| 0.1 * (0.05 * k as f64).sin();
        for (w, pade) in [
            (&[0.07, 0.084, 11.25, 0.35][..], 0),
            (&[0.07, 0.084, 11.25, 0.35, 0.28], 2),
        ] {
            let innovations = |w: &[f64]| {
                let mut own = filters(w, pade);
                let of = |k: usize| {
                    own.predict(e(k));
                    own.correct(u(k), false)
                };
                (0..200).map(of).collect::<Vec<f64>>()
            };
            let mut own = filters(w, pade);
            let mut slopes = Vec::new();
            for k in 0..200 {
                own.predict(e(k));
                slopes.push(own.along());
                own.correct(u(k), false);
            }
            for i in 0..w.len() {
                let step = 1e-4 * w[i];
                let moved = |by: f64| {
                    let mut w = w.to_vec();
                    w[i] += by;
                    innovations(&w)
                };
                let (forth, back) = (moved(step), moved(-step));
                for k in (50..200).step_by(50) {
                    let expected = -(forth[k] - back[k]) / (2.0 * step);
                    let found = slopes[k][i];
                    assert!(
                        (found - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                        "{pade}, {i}, {k}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn gains_after_a_change_are_near_the_truth_on_average() {
        const RUNS: u64 = 8;
        let mut mean = [0.0; 2];
        for replication in 0..RUNS {
            let run = Run::replication(Condition::C4, 1, 0.1, replication);
            let operator = DualEkf::default().follow(&run.task()).unwrap().operator[1].unwrap();
            mean[0] += operator.k_e_dot() / 0.084 / RUNS as f64;
            mean[1] += operator.omega_nm_rad_s / 11.25 / RUNS as f64;
        }
        // Standard errors of the means 3 % and 1 %.
        assert!((mean[0] - 1.0).abs() < 0.12 && (mean[1] - 1.0).abs() < 0.1, "{mean:?}");
    }

    /// A delay that is wrong by two samples is found by the filter that has it as a parameter.
    #[test]
    fn a_delay_behind_pade_is_followed() {
        let run = Run::of(Condition::C1, 1, 0.01);
        let record = run.record.span(0.0, 30.72).unwrap();
        let task = Task {
            record: &record,
            nk: 27,
            start_s: (0.0, 10.24),
            at: &[500, 3000],
            ..run.task()
        };
        let method = DualEkf {
            pade: 3,
            ..DualEkf::default()
        };
        let found = method.follow(&task).unwrap().operator;
        let delay = |row: usize| found[row].unwrap().tau_e_s;
        assert!((delay(0) - 0.26).abs() < 1e-9, "it stays until the start span ends");
        // The filter leaves it within a sample of the truth.
        assert!((delay(1) - 0.28).abs() < 0.01, "{}", delay(1));
        let many = DualEkf { pade: 4, ..method };
        assert!(many.follow(&task).unwrap_err().to_string().contains("Padé"));
    }

    #[test]
    fn a_silent_record_is_refused() {
        let silent = record_of(&[0.0; 4000], &[0.0; 4000]);
        assert!(DualEkf::default().follow(&task_of(&silent, &[3999], &[1.0])).is_err());
    }
}
