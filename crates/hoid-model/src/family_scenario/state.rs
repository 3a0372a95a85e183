//! Operator and controlled element at one instant.

use crate::{
    ContinuousTransferFunction, FamilyOperator, ModelError,
    margins::{Crossings, MANUAL_CONTROL_RANGE_RAD_S, Margins, closed_loop_is_stable, crossings},
};

/// Operator of the family and controlled element at one instant.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FamilyState {
    /// Operator at this instant.
    pub operator: FamilyOperator,
    /// Controlled element at this instant.
    pub controlled_element: ContinuousTransferFunction,
}

impl FamilyState {
    /// Returns the open loop `Y(s) P(s)`.
    ///
    /// # Errors
    /// As [`FamilyOperator::transfer_function`].
    pub fn open_loop(&self) -> Result<ContinuousTransferFunction, ModelError> {
        Ok(self.operator.transfer_function()?.series(&self.controlled_element))
    }

    /// Returns the crossover frequency and the margins of the open loop in continuous time.
    ///
    /// # Errors
    /// As [`FamilyState::crossings`].
    pub fn margins(&self) -> Result<Margins, ModelError> {
        Ok(self.crossings()?.margins())
    }

    /// Returns every crossing of unit gain and of the negative real axis by the open loop in continuous time.
    ///
    /// # Errors
    /// As [`FamilyState::open_loop`]; [`ModelError::UnstableLoop`].
    pub fn crossings(&self) -> Result<Crossings, ModelError> {
        let open_loop = self.open_loop()?;
        if !closed_loop_is_stable(&open_loop) {
            return Err(ModelError::UnstableLoop {
                reason: "the characteristic equation 1 + Y P = 0 has roots outside the left half plane".to_owned(),
            });
        }
        Ok(crossings(|omega| open_loop.response(omega), MANUAL_CONTROL_RANGE_RAD_S))
    }

    /// True if both states have the same form, which is required for a transition between them.
    pub(super) fn has_same_form(&self, other: &Self) -> bool {
        let (c, d) = (&self.controlled_element, &other.controlled_element);
        self.operator.has_same_form(&other.operator) && (c.num().len(), c.den().len()) == (d.num().len(), d.den().len())
    }

    /// Returns a state between this state and another one. `between` computes each parameter of the operator
    /// ([`FamilyOperator::coordinates`], with omega_nm and zeta_nm instead of their logarithms) and of the controlled
    /// element (its leading gain, and the coefficients of the numerator and the denominator without this gain). The
    /// delay of this state is kept.
    pub(super) fn interpolated(&self, other: &Self, between: impl Fn(f64, f64) -> f64) -> Result<Self, ModelError> {
        let (c, d) = (&self.controlled_element, &other.controlled_element);
        let pairs = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| between(*p, *q)).collect::<Vec<f64>>();
        let shape = |p: &[f64]| {
            p.iter()
                .map(|c| if p[0] == 0.0 { *c } else { c / p[0] })
                .collect::<Vec<f64>>()
        };
        let gain = between(c.num()[0], d.num()[0]);
        let num: Vec<f64> = pairs(&shape(c.num()), &shape(d.num()))
            .iter()
            .map(|c| c * gain)
            .collect();
        Ok(Self {
            operator: self.operator.with_interpolated_parameters(&other.operator, &between)?,
            controlled_element: ContinuousTransferFunction::new(&num, &pairs(c.den(), d.den()))?,
        })
    }
}
