//! Responses of a family operator whose numerator is a single power of s, and their derivatives with respect to its
//! poles and its delay.
//!
//! `F y_i = B_i q^-nk e`, `F dy_i/dp = (dB_i/dp) q^-nk e - (dF/dp) y_i`, where p is 1/T_I, omega_nm, zeta_nm or tau_e.
//! For a gain and a lead, B and F come from [`hoid_model::delayed_operator`]; for other forms they come from
//! [`FamilyOperator::zoh_powers_with_delay_samples`](hoid_model::FamilyOperator::zoh_powers_with_delay_samples).

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{
    Form, SampleTime,
    delayed_operator::{delayed_operator_and_jacobian_with_delay_samples, whole_samples},
};

use super::layout::Layout;
use crate::linalg::vectors::add_scaled;

/// Operators with each power of s as numerator, for one theta.
#[derive(Debug, Clone)]
pub(crate) struct UnitOperator {
    pub nk: usize,
    /// Coefficients of B for each power of s.
    pub b: Vec<Vec<f64>>,
    pub f: Vec<f64>,
    /// Derivatives of B for each power of s, with respect to each element of [`Layout::pole_indices`].
    b_slopes: Vec<Vec<Vec<f64>>>,
    /// Derivatives of F with respect to each element of [`Layout::pole_indices`].
    f_slopes: Vec<Vec<f64>>,
}

impl UnitOperator {
    /// Returns the operators for theta; `None` if theta is invalid. The delay may be restricted to a piece of a
    /// sampling interval ([`Layout::piece_count`]).
    pub fn of(layout: &Layout, theta: &[f64], piece: Option<usize>, ts: SampleTime) -> Option<Self> {
        let sample = match piece {
            Some(piece) => piece / layout.piece_count(),
            None => whole_samples(theta[layout.delay], ts).ok()?,
        };
        match (layout.form, layout.neuromuscular_indices) {
            (Form::Lead, Some([omega, zeta])) => {
                Self::from_lead([theta[omega], theta[zeta], theta[layout.delay]], sample, ts)
            }
            _ => Self::from_family(layout, theta, sample, ts),
        }
    }

    fn from_lead([omega, zeta, delay]: [f64; 3], sample: usize, ts: SampleTime) -> Option<Self> {
        let at = |gains: [f64; 2]| [gains[0], gains[1], omega, zeta, delay];
        let (held, by_gain) = delayed_operator_and_jacobian_with_delay_samples(sample, at([1.0, 0.0]), ts).ok()?;
        let (_, by_rate) = delayed_operator_and_jacobian_with_delay_samples(sample, at([0.0, 1.0]), ts).ok()?;
        let jacobians = [by_gain, by_rate];
        let column = |side: usize, j: usize| (0..3).map(|i| jacobians[side][i][j]).collect::<Vec<f64>>();
        Some(Self {
            nk: held.nk,
            b: vec![column(0, 0), column(0, 1)],
            f: held.f.to_vec(),
            b_slopes: (0..2)
                .map(|side| (0..3).map(|p| column(side, 2 + p)).collect())
                .collect(),
            f_slopes: (0..3)
                .map(|p| vec![jacobians[0][3][2 + p], jacobians[0][4][2 + p]])
                .collect(),
        })
    }

    fn from_family(layout: &Layout, theta: &[f64], sample: usize, ts: SampleTime) -> Option<Self> {
        // The numerator of this operator has no effect on the result.
        let operator = layout.operator(theta, &[1.0; 3]).ok()?;
        let powers = operator.zoh_powers_with_delay_samples(sample, ts).ok()?;
        // Derivatives of the family coordinates with respect to theta.
        let scale: Vec<(usize, f64)> = layout
            .pole_indices()
            .into_iter()
            .enumerate()
            .map(|(p, index)| {
                let logarithmic = layout.neuromuscular_indices.is_some_and(|own| own.contains(&index));
                (layout.varying + p, if logarithmic { 1.0 / theta[index] } else { 1.0 })
            })
            .collect();
        let nb = powers[0].b.len();
        let slopes = |rows: &[[f64; hoid_model::operator_family::PARTIAL_COUNT]]| -> Vec<Vec<f64>> {
            scale
                .iter()
                .map(|&(column, by)| rows.iter().map(|row| by * row[column]).collect())
                .collect()
        };
        Some(Self {
            nk: powers[0].nk,
            f: powers[0].f.clone(),
            f_slopes: slopes(&powers[0].jacobian[nb..]),
            b_slopes: powers.iter().map(|power| slopes(&power.jacobian[..nb])).collect(),
            b: powers.into_iter().map(|power| power.b).collect(),
        })
    }

    /// Returns `y_i` for an input that starts with the errors before the record.
    pub fn response(&self, i: usize, input: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; input.len()];
        fir(&self.b[i], 0, input, &mut y);
        divide_in_place(&self.f, &mut y);
        y
    }

    /// Returns the derivative of `y_i` with respect to element p of [`Layout::pole_indices`].
    pub fn slope(&self, i: usize, p: usize, input: &[f64], y: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; input.len()];
        fir(&self.b_slopes[i][p], 0, input, &mut x);
        for (lag, &slope) in self.f_slopes[p].iter().enumerate().filter(|(_, s)| **s != 0.0) {
            add_scaled(&mut x[lag + 1..], -slope, &y[..y.len() - lag - 1]);
        }
        divide_in_place(&self.f, &mut x);
        x
    }

    /// Returns the impulse response of `B_i/F`, until it has decayed or its length is `longest`.
    pub fn impulse_response(&self, i: usize, longest: usize) -> Vec<f64> {
        let mut h: Vec<f64> = Vec::with_capacity(longest.min(4096));
        let mut largest = 0.0_f64;
        for t in 0..longest {
            let drive = self.b[i].get(t).copied().unwrap_or(0.0);
            let lags = (1..=self.f.len().min(t)).rev();
            let y = lags.fold(drive, |y, lag| y - self.f[lag - 1] * h[t - lag]);
            largest = largest.max(y.abs());
            h.push(y);
            let last = h.iter().rev().take(self.f.len().max(1));
            if t > self.b[i].len() && last.fold(0.0_f64, |m, y| m.max(y.abs())) < 1e-20 * largest {
                break;
            }
        }
        h
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn family_lead_form_matches_the_delayed_operator() {
        let layout = Layout::new(Form::Lead, true, 0);
        let ts = SampleTime::AT_100_HZ;
        for (omega, zeta, delay) in [(11.25, 0.35, 0.1234), (6.0, 1.4, 0.2), (30.0, 0.1, 0.305)] {
            let theta = [0.09, 0.07, 0.4, 1.2, 5.0, 0.0, omega, zeta, delay];
            let sample = whole_samples(delay, ts).unwrap();
            let known = UnitOperator::of(&layout, &theta, None, ts).unwrap();
            let family = UnitOperator::from_family(&layout, &theta, sample, ts).unwrap();
            assert_eq!((known.nk, known.b.len()), (family.nk, family.b.len()));
            let flat = |unit: &UnitOperator| -> Vec<Vec<f64>> {
                let slopes = unit.b_slopes.iter().flatten().cloned();
                slopes
                    .chain(unit.f_slopes.iter().cloned())
                    .chain(unit.b.iter().cloned())
                    .chain([unit.f.clone()])
                    .collect()
            };
            for (a, b) in flat(&known).into_iter().zip(flat(&family)) {
                let size = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                for (x, y) in a.iter().zip(&b) {
                    // F does not depend on the delay, so its derivative is zero except for the rounding errors of
                    // coefficients of about two.
                    assert!((x - y).abs() < 1e-10 * size + 1e-13, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn invalid_parameters_give_none() {
        let layout = Layout::new(Form::LeadLag, true, 0);
        let theta = [0.09, 0.07, 0.4, 1.2, 5.0, 0.0, 0.2, 11.0, 0.3, 0.2];
        let of = |index: usize, value: f64| {
            let mut wrong = theta;
            wrong[index] = value;
            UnitOperator::of(&layout, &wrong, None, SampleTime::AT_100_HZ)
        };
        assert!(of(layout.delay, 0.2).is_some());
        assert!(of(layout.delay, -0.2).is_none() && of(7, -11.0).is_none() && of(6, f64::NAN).is_none());
    }
}
