//! Order and meaning of the parameters.
//!
//! A parameter that changes has two elements in theta, before and after the change; a parameter that does not change
//! has one element:
//!
//! `theta = [v1 v2 of each parameter of the numerator, t_M, ln G, 1/T_I, omega_nm, zeta_nm, tau_e, d1 .. d_nd]`
//!
//! where the parameters of the numerator are the gain (K, or K/T_I with a lag), followed by T_L, or c_1 and c_2, or T_L
//! and alpha ([`Form::shape`]). A parameter that the form does not have has no element. For a gain and a lead,
//! `theta = [K_e1, K_e2, T_L1, T_L2, t_M, ln G, omega_nm, zeta_nm, tau_e, d1 .. d_nd]`. The rate enters through its
//! logarithm, because it is positive and its log-likelihood is much closer to a parabola in ln G than in G. A lag
//! enters as `1/T_I` for the same reason.

use hoid_model::{
    FamilyOperator, Form, ModelError, Orders,
    operator_family::{Coordinate, PARAMETERS},
};

/// Names and units of the parameters for a gain and a lead, without the coefficients d1, d2 ... of the noise model. For
/// other forms see [`crate::SigmoidChange::names`].
pub const SIGMOID_NAMES: [(&str, &str); 9] = [
    ("K_e1", ""),
    ("K_e2", ""),
    ("T_L1", "s"),
    ("T_L2", "s"),
    ("t_M", "s"),
    ("G", "1/s"),
    ("omega_nm", "rad/s"),
    ("zeta_nm", ""),
    ("tau_e", "s"),
];

/// Largest number of parameters of a numerator.
pub(crate) const MAX_VARYING: usize = 3;

/// Indices of the parameters in theta.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Layout {
    pub form: Form,
    pub neuromuscular: bool,
    pub nd: usize,
    /// Number of parameters that change.
    pub varying: usize,
    pub midpoint: usize,
    pub log_rate: usize,
    /// Index of 1/T_I.
    pub lag: Option<usize>,
    /// Indices of omega_nm and zeta_nm.
    pub neuromuscular_indices: Option<[usize; 2]>,
    pub delay: usize,
    /// Index of d1.
    pub noise: usize,
}

/// Meaning of an element of theta.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ThetaElement {
    /// A coordinate of the numerator before (0) or after (1) the change.
    Varying(Coordinate, usize),
    Midpoint,
    LogRate,
    /// A coordinate that does not change. For the neuromuscular part, the elements are omega_nm and zeta_nm, not their
    /// logarithms.
    Constant(Coordinate),
    /// Coefficient d_i of the noise model.
    Noise(usize),
}

impl Layout {
    pub fn new(form: Form, neuromuscular: bool, nd: usize) -> Self {
        let varying = 1 + form.shape_coordinate_count();
        let midpoint = 2 * varying;
        let mut next = midpoint + 2;
        let mut take = |count: usize| {
            let index = next;
            next += count;
            index
        };
        let lag = form.has_lag().then(|| take(1));
        let neuromuscular_indices = neuromuscular.then(|| take(2)).map(|index| [index, index + 1]);
        let delay = take(1);
        Self {
            form,
            neuromuscular,
            nd,
            varying,
            midpoint,
            log_rate: midpoint + 1,
            lag,
            neuromuscular_indices,
            delay,
            noise: delay + 1,
        }
    }

    /// Returns the number of elements of theta.
    pub fn len(&self) -> usize {
        self.noise + self.nd
    }

    /// Returns the indices of the i-th parameter of the numerator before and after the change.
    pub fn end_indices(i: usize) -> [usize; 2] {
        [2 * i, 2 * i + 1]
    }

    /// Returns the indices of the parameters that a model without a change does not have.
    pub fn change_indices(&self) -> Vec<usize> {
        let last = (0..self.varying).map(|i| Self::end_indices(i)[1]);
        last.chain([self.midpoint, self.log_rate]).collect()
    }

    /// Returns the indices of the poles and the delay, which determine the responses.
    pub fn pole_indices(&self) -> Vec<usize> {
        let muscles = self.neuromuscular_indices.into_iter().flatten();
        self.lag.into_iter().chain(muscles).chain([self.delay]).collect()
    }

    /// Returns the order of the dynamics of the operator.
    pub fn order(&self) -> usize {
        usize::from(self.form.has_pole()) + if self.neuromuscular { 2 } else { 0 }
    }

    /// True if the operator has a direct feedthrough of e.
    pub fn has_direct_part(&self) -> bool {
        self.form.degree() == self.order()
    }

    /// Returns the number of samples after nk during which past errors still act directly, not only through the state.
    pub fn direct_sample_count(&self) -> usize {
        if self.has_direct_part() { 2 } else { 0 }
    }

    /// Returns the number of pieces of a sampling interval within each of which the response is a smooth function of
    /// the delay. The direct part has a kink in the middle of the interval ([`hoid_model::operator_family`], `zoh`).
    pub fn piece_count(&self) -> usize {
        if self.has_direct_part() { 2 } else { 1 }
    }

    /// Returns the coordinates of the operator in the order of [`Form::coordinates`].
    pub fn coordinates(&self) -> Vec<Coordinate> {
        self.form.coordinates(self.neuromuscular)
    }

    /// Returns the meaning of each element of theta.
    pub fn elements(&self) -> Vec<ThetaElement> {
        let all = self.coordinates();
        let (varying, constant) = all.split_at(self.varying);
        let ends = varying
            .iter()
            .flat_map(|c| [ThetaElement::Varying(*c, 0), ThetaElement::Varying(*c, 1)]);
        ends.chain([ThetaElement::Midpoint, ThetaElement::LogRate])
            .chain(constant.iter().map(|c| ThetaElement::Constant(*c)))
            .chain((1..=self.nd).map(ThetaElement::Noise))
            .collect()
    }

    /// Returns the name and unit of each parameter as typed and reported: G, T_I, omega_nm and zeta_nm, not their
    /// transformed values.
    pub fn names_and_units(&self) -> Vec<(String, &'static str)> {
        let of = |element: ThetaElement| match element {
            ThetaElement::Varying(coordinate, end) => {
                let name = self.parameter_name(coordinate);
                // A name such as c_1 already ends with a digit.
                let sign = if name.ends_with('1') || name.ends_with('2') {
                    "_"
                } else {
                    ""
                };
                (format!("{name}{sign}{}", end + 1), self.unit(name))
            }
            ThetaElement::Midpoint => ("t_M".to_owned(), "s"),
            ThetaElement::LogRate => ("G".to_owned(), "1/s"),
            ThetaElement::Constant(coordinate) => {
                let name = self.parameter_name(coordinate);
                (name.to_owned(), self.unit(name))
            }
            ThetaElement::Noise(i) => (format!("d{i}"), ""),
        };
        self.elements().into_iter().map(of).collect()
    }

    pub fn names(&self) -> Vec<String> {
        self.names_and_units().into_iter().map(|(name, _)| name).collect()
    }

    /// Returns the name under which a coordinate is reported.
    fn parameter_name(&self, coordinate: Coordinate) -> &'static str {
        match (coordinate, self.form) {
            (Coordinate::Gain, Form::Lead) => "K_e",
            (Coordinate::Gain, form) if form.has_lag() => "K_over_T_I",
            (Coordinate::Gain, form) => form.gain_name_and_unit().0,
            _ => coordinate.parameter(),
        }
    }

    fn unit(&self, name: &str) -> &'static str {
        PARAMETERS
            .iter()
            .find(|(other, _)| *other == name)
            .map_or("", |(_, unit)| unit)
    }

    /// Converts a number as typed by the user to an element of theta: G to ln G, T_I to 1/T_I. All other numbers stay
    /// the same.
    pub fn theta_from_user_value(&self, index: usize, value: f64) -> f64 {
        match index {
            _ if index == self.log_rate => value.ln(),
            _ if Some(index) == self.lag => 1.0 / value,
            _ => value,
        }
    }

    pub fn user_value(&self, index: usize, value: f64) -> f64 {
        match index {
            _ if index == self.log_rate => value.exp(),
            _ if Some(index) == self.lag => 1.0 / value,
            _ => value,
        }
    }

    /// Returns the derivative of the reported number with respect to its element of theta.
    pub fn user_value_slope(&self, index: usize, value: f64) -> f64 {
        match index {
            _ if index == self.log_rate => value.exp(),
            _ if Some(index) == self.lag => -1.0 / (value * value),
            _ => 1.0,
        }
    }

    /// Returns the orders of the discrete model for this nk.
    pub fn orders(&self, nk: usize) -> Orders {
        Orders {
            nb: self.order() + if self.has_direct_part() { 3 } else { 1 },
            nd: self.nd,
            nf: self.order(),
            nk,
            ..Orders::default()
        }
    }

    /// Returns the operator with these parameters of the numerator, and with the poles and the delay of theta.
    ///
    /// # Errors
    /// The errors of [`FamilyOperator::new`].
    pub fn operator(&self, theta: &[f64], numerator: &[f64]) -> Result<FamilyOperator, ModelError> {
        let mut x = numerator[..self.varying].to_vec();
        x.extend(self.lag.map(|index| theta[index]));
        x.extend(
            self.neuromuscular_indices
                .into_iter()
                .flatten()
                .map(|index| theta[index].ln()),
        );
        x.push(theta[self.delay]);
        FamilyOperator::new(self.form, self.neuromuscular, &x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lead_layout(nd: usize) -> Layout {
        Layout::new(Form::Lead, true, nd)
    }

    #[test]
    fn gain_and_lead_layout_has_the_documented_order() {
        let known = SIGMOID_NAMES.map(|(name, unit)| (name.to_owned(), unit));
        let d1 = ("d1".to_owned(), "");
        assert_eq!(lead_layout(1).names_and_units(), [&known[..], &[d1]].concat());
        assert_eq!(lead_layout(1).change_indices(), [1, 3, 4, 5]);
        assert_eq!(lead_layout(1).pole_indices(), [6, 7, 8]);
    }

    #[test]
    fn every_coordinate_of_every_form_has_a_position() {
        for form in Form::ALL {
            for neuromuscular in [true, false].into_iter().filter(|nm| form.is_proper(*nm)) {
                let layout = Layout::new(form, neuromuscular, 2);
                let elements = layout.elements();
                assert_eq!(
                    (elements.len(), layout.names().len()),
                    (layout.len(), layout.len()),
                    "{form}"
                );
                assert_eq!(elements[layout.midpoint], ThetaElement::Midpoint);
                assert_eq!(elements[layout.log_rate], ThetaElement::LogRate);
                assert_eq!(elements[layout.delay], ThetaElement::Constant(Coordinate::Delay));
                assert_eq!(elements[layout.noise], ThetaElement::Noise(1));
                if let Some(index) = layout.lag {
                    assert_eq!(elements[index], ThetaElement::Constant(Coordinate::LagRate));
                }
                if let Some([omega, zeta]) = layout.neuromuscular_indices {
                    assert_eq!(elements[omega], ThetaElement::Constant(Coordinate::LogOmega));
                    assert_eq!(elements[zeta], ThetaElement::Constant(Coordinate::LogZeta));
                }
                let mut names = layout.names();
                names.sort();
                names.dedup();
                assert_eq!(names.len(), layout.len(), "{form}: {names:?}");
            }
        }
        let names = Layout::new(Form::LeadLag, true, 1).names().join(" ");
        assert_eq!(
            names,
            "K_over_T_I1 K_over_T_I2 T_L1 T_L2 t_M G T_I omega_nm zeta_nm tau_e d1"
        );
        let names = Layout::new(Form::QuadraticIntegral, false, 0).names().join(" ");
        assert_eq!(names, "K_I1 K_I2 c_1_1 c_1_2 c_2_1 c_2_2 t_M G tau_e");
    }
}
