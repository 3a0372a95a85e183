//! Intersample behaviour of the error, which the samples do not show but which affects the estimated delay.
//!
//! | name | behaviour of the error | factor on the operator's response | tau_e |
//! |---|---|---|---|
//! | `zoh` | held: a simulation, or a display with the same sampling frequency | `sin(x)/x e^{-jx}` | as simulated |
//! | `foh` | piecewise linear: logged from a continuous or faster-sampled signal | `(sin(x)/x)^2` | Ts/2 longer |
//! | `auto` | smooth, with the delay for a held error | `(sin(x)/x)^2 e^{-jx}` | as for a held error |
//!
//! with `x = omega Ts/2` (K. J. Astrom and B. Wittenmark, *Computer-Controlled Systems*, 1997, sections 3.2 and 3.4).
//! `foh` and `auto` are the same model with two definitions of its delay, so no data can distinguish them. `zoh`
//! differs from both by the factor `sin(x)/x`, which is 0.5 % below one at 20 rad/s and 60 Hz; only a recording without
//! noise can show this ([`super::low_noise`]). If it does not, the difference between the two fits is part of the error
//! bars ([`super::sensitivity`]).

use hoid_model::{Complex64, FamilyOperator, ModelError, SampleTime, named_choice, operator_family::ZohFamilyOperator};

/// Intersample behaviour of the error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Intersample {
    /// Smooth, with the delay defined as for a held error; replaced by [`Self::Zoh`] or [`Self::Foh`] if data with
    /// little noise show that the error is held or linear.
    #[default]
    Auto,
    /// Held until the next sample.
    Zoh,
    /// Linear between samples.
    Foh,
}

named_choice!(Intersample, "behaviour between samples", 3, {
    Auto => "auto",
    Zoh => "zoh",
    Foh => "foh",
});

impl Intersample {
    /// Returns the factor by which the intersample behaviour multiplies the response of the operator at a frequency.
    pub(super) fn response(self, omega_rad_s: f64, sample_time: SampleTime) -> Complex64 {
        let half = 0.5 * omega_rad_s * sample_time.s();
        let sinc = if half.abs() < 1e-8 { 1.0 } else { half.sin() / half };
        match self {
            Self::Auto => Complex64::from_polar(sinc * sinc, -half),
            Self::Zoh => Complex64::from_polar(sinc, -half),
            Self::Foh => Complex64::new(sinc * sinc, 0.0),
        }
    }

    /// Returns the shortest delay in s for which there is a causal model; linear interpolation needs the next sample.
    pub(super) fn shortest_delay_s(self, sample_time: SampleTime) -> f64 {
        match self {
            Self::Auto | Self::Zoh => 0.0,
            Self::Foh => 0.5 * sample_time.s(),
        }
    }

    /// Returns the number of coefficients of B for an operator of this order whose numerator has this degree.
    pub(super) fn numerator_length(self, order: usize, degree: usize) -> usize {
        match self {
            Self::Auto | Self::Foh => order + 2,
            Self::Zoh if degree == order => order + 3,
            Self::Zoh => order + 1,
        }
    }

    /// Returns the discrete-time model of an operator. `sample` is the number of whole samples of the delay (for a
    /// smooth error, of the delay plus half a sample); `None` computes them from the delay.
    pub(super) fn discrete_model(
        self,
        operator: &FamilyOperator,
        sample: Option<usize>,
        sample_time: SampleTime,
    ) -> Result<ZohFamilyOperator, ModelError> {
        match (self, sample) {
            (Self::Auto, Some(sample)) => operator.interpolate_with_delay_samples(sample, sample_time),
            (Self::Auto, None) => operator.interpolate(sample_time),
            (Self::Zoh, Some(sample)) => operator.zoh_with_delay_samples(sample, sample_time),
            (Self::Zoh, None) => operator.zoh(sample_time),
            (Self::Foh, _) => {
                let mut earlier = operator.coordinates().to_vec();
                if let Some(delay) = earlier.last_mut() {
                    *delay -= 0.5 * sample_time.s();
                }
                let earlier = FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &earlier)?;
                Self::Auto.discrete_model(&earlier, sample, sample_time)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{Form, polynomial};

    use super::*;

    #[test]
    fn discrete_model_has_the_expected_frequency_response() {
        let ts = SampleTime::new(0.02).unwrap();
        let forms: [(Form, bool, &[f64]); 3] = [
            (Form::Lead, true, &[1.5, 0.5, 2.4, -1.2, 0.193]),
            (Form::Lead2, true, &[1.5, 0.5, 2.4, -1.2, 0.193]),
            (Form::Gain, false, &[1.5, 0.193]),
        ];
        for course in Intersample::ALL {
            for (form, muscles, x) in forms {
                let operator = FamilyOperator::new(form, muscles, x).unwrap();
                let model = course.discrete_model(&operator, None, ts).unwrap();
                assert_eq!(
                    model.b.len(),
                    course.numerator_length(model.f.len(), form.degree()),
                    "{course} {form}"
                );
                for omega in [0.5, 3.0, 9.0] {
                    let backward = Complex64::from_polar(1.0, -omega * ts.s());
                    let f = [&[1.0][..], &model.f].concat();
                    let found = polynomial::value(&model.b, backward) / polynomial::value(&f, backward)
                        * backward.powi(model.nk as i32);
                    let expected = operator.response(omega) * course.response(omega, ts);
                    // The aliases are proportional to omega Ts for a hold, and to its square for linear interpolation.
                    let aliases = match course {
                        Intersample::Zoh => 0.2 * omega * ts.s(),
                        Intersample::Auto | Intersample::Foh => 2.0 * (omega * ts.s()).powi(2),
                    };
                    assert!(
                        (found / expected - 1.0).norm() < aliases + 1e-6,
                        "{course} {form} {omega} {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let ts = SampleTime::new(0.02).unwrap();
        let x = [1.5, 0.5, 2.4, -1.2, 0.193];
        for course in Intersample::ALL {
            let of = |x: &[f64]| {
                let operator = FamilyOperator::new(Form::Lead, true, x).unwrap();
                course.discrete_model(&operator, None, ts).unwrap()
            };
            let exact = of(&x);
            for i in 0..x.len() {
                let at = |by: f64| {
                    let mut moved = x;
                    moved[i] += by;
                    let model = of(&moved);
                    [model.b, model.f].concat()
                };
                for ((row, up), down) in exact.jacobian.iter().zip(at(1e-6)).zip(at(-1e-6)) {
                    let error = (row[i] - (up - down) / 2e-6).abs();
                    assert!(error < 1e-6 * (1.0 + row[i].abs()), "{course} {i} {error}");
                }
            }
        }
    }

    #[test]
    fn linear_interpolation_needs_a_minimum_delay() {
        let ts = SampleTime::new(0.02).unwrap();
        let operator = |tau: f64| FamilyOperator::new(Form::Gain, true, &[1.5, 2.4, -1.2, tau]).unwrap();
        assert!(Intersample::Foh.discrete_model(&operator(0.009), None, ts).is_err());
        let shortest = Intersample::Foh.shortest_delay_s(ts);
        assert!(Intersample::Foh.discrete_model(&operator(shortest), None, ts).is_ok());
        assert!(Intersample::Zoh.discrete_model(&operator(0.0), None, ts).is_ok());
        assert!("cubic".parse::<Intersample>().is_err());
    }
}
