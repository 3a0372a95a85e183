//! Operators between two states, and operators with another neuromuscular system or delay.

use super::{form::Coordinate, operator::FamilyOperator};
use crate::ModelError;

impl FamilyOperator {
    /// True if both operators have the same form, which is required for a transition between them.
    pub fn has_same_form(&self, other: &Self) -> bool {
        self.form() == other.form() && self.has_neuromuscular() == other.has_neuromuscular()
    }

    /// Returns an operator between this operator and another one of the same form. `between` computes each coordinate,
    /// with omega_nm and zeta_nm instead of their logarithms. The delay of this operator is kept.
    ///
    /// # Errors
    /// As [`FamilyOperator::new`].
    pub fn with_interpolated_parameters(
        &self,
        other: &Self,
        between: impl Fn(f64, f64) -> f64,
    ) -> Result<Self, ModelError> {
        let on_its_way = |(kind, (x, y)): (Coordinate, (&f64, &f64))| match kind {
            Coordinate::Delay => *x,
            // If both values are equal, this value is kept exactly.
            _ if x == y => *x,
            Coordinate::LogOmega | Coordinate::LogZeta => between(x.exp(), y.exp()).ln(),
            _ => between(*x, *y),
        };
        let both = self.coordinates().iter().zip(other.coordinates());
        let coordinates: Vec<f64> = self.coordinate_kinds().into_iter().zip(both).map(on_its_way).collect();
        Self::new(self.form(), self.has_neuromuscular(), &coordinates)
    }

    /// Returns this operator with another neuromuscular frequency in rad/s and damping; an operator without a
    /// neuromuscular part remains unchanged.
    ///
    /// # Errors
    /// As [`FamilyOperator::new`].
    pub fn with_neuromuscular(&self, omega_nm_rad_s: f64, zeta_nm: f64) -> Result<Self, ModelError> {
        self.with_coordinates(|kind, x| match kind {
            Coordinate::LogOmega => omega_nm_rad_s.ln(),
            Coordinate::LogZeta => zeta_nm.ln(),
            _ => x,
        })
    }

    /// Returns this operator with another delay in s.
    ///
    /// # Errors
    /// As [`FamilyOperator::new`].
    pub fn with_delay(&self, tau_e_s: f64) -> Result<Self, ModelError> {
        self.with_coordinates(|kind, x| if kind == Coordinate::Delay { tau_e_s } else { x })
    }

    fn with_coordinates(&self, value: impl Fn(Coordinate, f64) -> f64) -> Result<Self, ModelError> {
        let all = self.coordinate_kinds().into_iter().zip(self.coordinates());
        let coordinates: Vec<f64> = all.map(|(kind, x)| value(kind, *x)).collect();
        Self::new(self.form(), self.has_neuromuscular(), &coordinates)
    }

    fn coordinate_kinds(&self) -> Vec<Coordinate> {
        self.form().coordinates(self.has_neuromuscular())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Form, examples::operator};

    #[test]
    fn only_changed_parameters_are_interpolated() {
        let (a, b) = (operator(Form::LeadLag, true, 0.1), operator(Form::LeadLag, true, 0.3));
        let b = b.with_neuromuscular(9.0, 0.45).unwrap();
        let half = a.with_interpolated_parameters(&b, |x, y| 0.5 * (x + y)).unwrap();
        let (omega, zeta) = half.neuromuscular_parameters().unwrap();
        assert!((omega - 10.0).abs() < 1e-12 && (zeta - 0.35).abs() < 1e-12);
        // Coordinates that are equal in both operators, and the delay, are bit-identical to the values of the first
        // operator.
        assert_eq!(half.coordinates()[..3], a.coordinates()[..3]);
        assert_eq!(half.tau_e_s(), 0.1);
        assert_eq!(a.with_delay(0.3).unwrap().tau_e_s(), 0.3);
        let bare = operator(Form::Gain, false, 0.1);
        assert_eq!(bare.with_neuromuscular(9.0, 0.4).unwrap(), bare);
        assert!(!a.has_same_form(&bare));
        assert!(a.with_delay(-0.1).is_err() && a.with_neuromuscular(-1.0, 0.4).is_err());
    }
}
