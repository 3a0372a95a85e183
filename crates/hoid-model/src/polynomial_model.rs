//! The identified model: polynomials with numerical coefficients.
//!
//! `A u = (B/F) q^-nk e + (C/D) eps`, with theta = `[a1.. b0.. c1.. d1.. f1..]`. The system from e to u is
//! `B q^-nk/(A F)`, and the noise filter is `C/(A D)`.

use hoid_core::stability::roots_inside;
use num_complex::Complex64;

use crate::{
    ModelError, NotConvertible, Orders, SampleTime, Structure, operator::DiscreteOperator, polynomial,
    second_order::ZohSecondOrder, transfer_function::DiscreteTransferFunction,
};

/// A polynomial model with its coefficients.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "SerializedModel")]
pub struct PolynomialModel {
    structure: Structure,
    orders: Orders,
    sample_time: SampleTime,
    theta: Vec<f64>,
}

/// A polynomial model as read from a file, before it is checked.
#[derive(serde::Deserialize)]
struct SerializedModel {
    structure: Structure,
    orders: Orders,
    sample_time: SampleTime,
    theta: Vec<f64>,
}

impl TryFrom<SerializedModel> for PolynomialModel {
    type Error = ModelError;

    fn try_from(written: SerializedModel) -> Result<Self, ModelError> {
        Self::new(written.structure, written.orders, written.sample_time, written.theta)
    }
}

impl PolynomialModel {
    /// Creates a model from its structure, its orders and its parameter vector.
    ///
    /// # Errors
    /// [`ModelError::Orders`] if the orders contradict the structure or the length of theta does not match the orders;
    /// [`ModelError::TransferFunction`] if a coefficient is not finite.
    pub fn new(
        structure: Structure,
        orders: Orders,
        sample_time: SampleTime,
        theta: Vec<f64>,
    ) -> Result<Self, ModelError> {
        orders.check(structure)?;
        if theta.len() != orders.parameter_count() {
            return Err(ModelError::Orders {
                found: orders.to_string(),
                expected: format!(
                    "expected {} coefficients in theta, found {}",
                    orders.parameter_count(),
                    theta.len()
                ),
            });
        }
        if let Some(i) = theta.iter().position(|v| !v.is_finite()) {
            return Err(ModelError::TransferFunction {
                found: format!("{} = {}", orders.parameter_names()[i], theta[i]),
                expected: "expected finite coefficients".to_owned(),
            });
        }
        Ok(Self {
            structure,
            orders,
            sample_time,
            theta,
        })
    }

    /// Structure of the model.
    pub fn structure(&self) -> Structure {
        self.structure
    }

    /// Orders of the model.
    pub fn orders(&self) -> Orders {
        self.orders
    }

    /// Time between two samples.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// The parameter vector `[a1.. b0.. c1.. d1.. f1..]`.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn part(&self, before: usize, n: usize) -> &[f64] {
        &self.theta[before..before + n]
    }

    /// Coefficients `[a1, ..., a_na]` of A.
    pub fn a(&self) -> &[f64] {
        self.part(0, self.orders.na)
    }

    /// Coefficients `[b0, ..., b_{nb-1}]` of B.
    pub fn b(&self) -> &[f64] {
        self.part(self.orders.na, self.orders.nb)
    }

    /// Coefficients `[c1, ..., c_nc]` of C.
    pub fn c(&self) -> &[f64] {
        self.part(self.orders.na + self.orders.nb, self.orders.nc)
    }

    /// Coefficients `[d1, ..., d_nd]` of D.
    pub fn d(&self) -> &[f64] {
        self.part(self.orders.na + self.orders.nb + self.orders.nc, self.orders.nd)
    }

    /// Coefficients `[f1, ..., f_nf]` of F.
    pub fn f(&self) -> &[f64] {
        self.part(self.orders.parameter_count() - self.orders.nf, self.orders.nf)
    }

    /// True if the predictor, with the filters `D A/C` of u and `B D/(F C)` of e, is stable: all roots of C and F are
    /// inside the unit circle.
    pub fn predictor_is_stable(&self) -> bool {
        roots_inside(self.c(), 1.0) && roots_inside(self.f(), 1.0)
    }

    /// True if the system from e to u is stable: all roots of A F are inside the unit circle.
    pub fn is_stable(&self) -> bool {
        roots_inside(self.a(), 1.0) && roots_inside(self.f(), 1.0)
    }

    /// Returns `B q^-nk / (A F)`.
    ///
    /// # Errors
    /// No error occurs for a valid model; the error type is that of [`DiscreteTransferFunction::new`].
    pub fn system(&self) -> Result<DiscreteTransferFunction, ModelError> {
        let mut num = vec![0.0; self.orders.nk];
        num.extend_from_slice(self.b());
        let den = polynomial::product(&monic(self.a()), &monic(self.f()));
        DiscreteTransferFunction::new(&num, &den, self.sample_time)
    }

    /// Returns the frequency response from e to u, `B q^-nk/(A F)` at `e^{j omega Ts}`.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.response_and_gradient(omega_rad_s).0
    }

    /// Returns the frequency response and its gradient with respect to theta: `dH/db_j = z^{-nk-j}/(A F)`,
    /// `dH/df_j = -H z^-j/F`, `dH/da_j = -H z^-j/A`; zero for c and d.
    pub fn response_and_gradient(&self, omega_rad_s: f64) -> (Complex64, Vec<Complex64>) {
        let phase = omega_rad_s * self.sample_time.s();
        let backward = |lag: usize| Complex64::from_polar(1.0, -phase * lag as f64);
        let x = backward(1);
        let a = polynomial::value(&monic(self.a()), x);
        let f = polynomial::value(&monic(self.f()), x);
        let b = polynomial::value(self.b(), x) * backward(self.orders.nk);
        let h = b / (a * f);
        let mut gradient = Vec::with_capacity(self.theta.len());
        gradient.extend((1..=self.orders.na).map(|j| -h * backward(j) / a));
        gradient.extend((0..self.orders.nb).map(|j| backward(self.orders.nk + j) / (a * f)));
        gradient.extend(std::iter::repeat_n(
            Complex64::new(0.0, 0.0),
            self.orders.nc + self.orders.nd,
        ));
        gradient.extend((1..=self.orders.nf).map(|j| -h * backward(j) / f));
        (h, gradient)
    }

    /// Returns the model as a discrete operator, which requires two coefficients in B and two poles.
    ///
    /// # Errors
    /// [`NotConvertible::OtherOrders`], [`NotConvertible::PolesInBoth`].
    pub fn discrete_operator(&self) -> Result<DiscreteOperator, NotConvertible> {
        let (na, nf) = (self.orders.na, self.orders.nf);
        if na > 0 && nf > 0 {
            return Err(NotConvertible::PolesInBoth { na, nf });
        }
        let (b, poles) = (self.b(), self.operator_poles());
        match (b, poles) {
            (&[b0, b1], &[f1, f2]) => Ok(DiscreteOperator {
                zoh: ZohSecondOrder { b0, b1, f1, f2 },
                nk: self.orders.nk,
                sample_time: self.sample_time,
            }),
            _ => Err(NotConvertible::OtherOrders {
                nb: b.len(),
                poles: self.orders.na + self.orders.nf,
            }),
        }
    }

    /// Returns the polynomial with the poles of the operator: A if there is no F (ARX and related structures),
    /// otherwise F.
    fn operator_poles(&self) -> &[f64] {
        if self.orders.nf == 0 { self.a() } else { self.f() }
    }

    /// Returns the positions in theta of `[b0, b1, f1, f2]`, or of `[b0, b1, a1, a2]` if there is no F, for models that
    /// [`PolynomialModel::discrete_operator`] accepts.
    pub fn operator_positions(&self) -> [usize; 4] {
        let b = self.orders.na;
        let f = if self.orders.nf == 0 {
            0
        } else {
            self.orders.parameter_count() - 2
        };
        [b, b + 1, f, f + 1]
    }
}

/// Returns the coefficients preceded by a leading 1.
pub fn monic(coefficients: &[f64]) -> Vec<f64> {
    let mut p = Vec::with_capacity(coefficients.len() + 1);
    p.push(1.0);
    p.extend_from_slice(coefficients);
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    fn general() -> PolynomialModel {
        let orders = Orders {
            nb: 2,
            nc: 1,
            nd: 2,
            nf: 2,
            nk: 29,
            ..Orders::default()
        };
        let theta = vec![0.044, -0.043, 0.3, -1.2, 0.4, -1.91, 0.924];
        PolynomialModel::new(Structure::BoxJenkins, orders, ts(), theta).unwrap()
    }

    #[test]
    fn named_parts_are_slices_of_theta() {
        let m = general();
        assert_eq!(m.b(), &[0.044, -0.043]);
        assert_eq!(m.c(), &[0.3]);
        assert_eq!(m.d(), &[-1.2, 0.4]);
        assert_eq!(m.f(), &[-1.91, 0.924]);
        assert!(m.a().is_empty());
        let positions = m.operator_positions();
        let h = m.discrete_operator().unwrap().zoh;
        assert_eq!(positions.map(|i| m.theta()[i]), [h.b0, h.b1, h.f1, h.f2]);
    }

    #[test]
    fn response_and_gradient_match_the_transfer_function() {
        let arx = PolynomialModel::new(
            Structure::Arx,
            Structure::Arx.operator_orders(3),
            ts(),
            vec![-1.9, 0.92, 0.04, -0.03],
        )
        .unwrap();
        for model in [general(), arx] {
            for omega in [0.1, 3.0, 40.0, 314.0] {
                let (h, gradient) = model.response_and_gradient(omega);
                assert!((h - model.system().unwrap().response(omega)).norm() < 1e-12 * h.norm());
                for (i, g) in gradient.iter().enumerate() {
                    let step = 1e-7;
                    let shifted = |sign: f64| {
                        let mut theta = model.theta().to_vec();
                        theta[i] += sign * step;
                        PolynomialModel::new(model.structure(), model.orders(), ts(), theta)
                            .unwrap()
                            .response(omega)
                    };
                    let difference = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
                    assert!(
                        (g - difference).norm() < 1e-5 * (1.0 + g.norm()),
                        "{i} at {omega}: {g} {difference}"
                    );
                }
            }
        }
    }

    #[test]
    fn bad_models_are_refused() {
        let orders = Structure::Arx.operator_orders(29);
        let make = |theta: Vec<f64>| PolynomialModel::new(Structure::Arx, orders, ts(), theta);
        assert!(make(vec![1.0]).is_err());
        assert!(make(vec![-1.9, 0.9, f64::NAN, 0.0]).is_err());
        let one_pole = Orders {
            na: 1,
            nb: 1,
            nk: 1,
            ..Orders::default()
        };
        let model = PolynomialModel::new(Structure::Arx, one_pole, ts(), vec![-0.9, 0.1]).unwrap();
        assert!(matches!(
            model.discrete_operator(),
            Err(NotConvertible::OtherOrders { .. })
        ));
    }

    #[test]
    fn predictor_may_be_stable_for_an_unstable_model() {
        assert!(general().predictor_is_stable() && general().is_stable());
        let unstable = PolynomialModel::new(
            Structure::Arx,
            Structure::Arx.operator_orders(3),
            ts(),
            vec![-2.1, 1.2, 0.04, -0.03],
        )
        .unwrap();
        // The predictor of an ARX model is always stable, but the model itself may be unstable.
        assert!(unstable.predictor_is_stable() && !unstable.is_stable());
    }
}
