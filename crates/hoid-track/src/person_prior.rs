//! Prior knowledge of a person before the first sample: an option of methods that start without a fit of the record.

use hoid_ident::{
    IdentError,
    family::OperatorPrior,
    settings::{Kind, Value},
};
use hoid_model::{FittedOperator, SampleTime};

/// Prior knowledge of a person before the first sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum PersonPrior {
    /// Default values for people.
    #[default]
    Population,
    /// Almost none: the default values with large standard deviations.
    Nothing,
    /// The default values, except for the named parameters.
    Named(OperatorPrior),
    /// An earlier fit of the person.
    Fit(Box<FittedOperator>),
}

impl PersonPrior {
    /// Returns the earlier fit; `None` if the prior is not a fit.
    pub fn fit(&self) -> Option<&FittedOperator> {
        match self {
            Self::Fit(fit) => Some(fit),
            _ => None,
        }
    }

    /// Checks that the samples have the sample time and the units of the earlier fit.
    ///
    /// # Errors
    /// [`IdentError::BadStart`].
    pub(crate) fn check(&self, sample_time: SampleTime, units: [&str; 2]) -> Result<(), IdentError> {
        let Some(fit) = self.fit() else { return Ok(()) };
        fit.check_samples(sample_time, units)
            .map_err(|error| IdentError::BadStart {
                reason: error.to_string(),
            })
    }

    /// Returns a description of the start of the estimate.
    pub(crate) fn as_text(&self) -> String {
        match self {
            Self::Population => "the defaults for people".to_owned(),
            Self::Nothing => "almost no knowledge: the defaults for people, with wide errors".to_owned(),
            Self::Named(prior) => format!("the defaults for people, with {prior}"),
            Self::Fit(fit) => format!(
                "the fit in {} with its covariance, form {}",
                fit.source,
                fit.operator.form()
            ),
        }
    }

    /// Returns the delay that the prior specifies (in s); `None` if it specifies none.
    pub(crate) fn delay_s(&self) -> Option<f64> {
        match self.fit() {
            Some(fit) => Some(fit.operator.tau_e_s()),
            None => self.named_parameter("tau_e").map(|(centre, _)| centre),
        }
    }

    /// Returns the centre and the spread of a named parameter; `None` if the prior does not name it.
    pub(crate) fn named_parameter(&self, parameter: &str) -> Option<(f64, f64)> {
        let Self::Named(prior) = self else { return None };
        let entry = prior.entries().iter().find(|entry| entry.parameter == parameter)?;
        Some((entry.centre, entry.spread))
    }
}

impl Value for PersonPrior {
    const KIND: Kind = Kind::Prior;

    /// A file with a fit is read by the program and passed to [`Method::start_from`](crate::Method).
    fn read(text: &str) -> Result<Self, String> {
        let expected = "population, none, NAME=CENTRE:SPREAD of omega_nm, zeta_nm, tau_e and T_I separated by commas, \
                        such as omega_nm=10.5:0.3, or a file with the output of hoid identify --json, such as fit.json";
        Ok(match text {
            "population" => Self::Population,
            "none" => Self::Nothing,
            named => {
                let prior: OperatorPrior = named
                    .parse()
                    .map_err(|error: IdentError| format!("{expected} ({error})"))?;
                if prior.entries().iter().any(|entry| entry.parameter == "T_L") {
                    return Err(
                        "no prior for T_L: the gains, and with them the lead, are estimated from the first \
                         second; name omega_nm, zeta_nm, tau_e or T_I, or give the file of a fit"
                            .to_owned(),
                    );
                }
                Self::Named(prior)
            }
        })
    }

    fn text(&self) -> Option<String> {
        Some(match self {
            Self::Population => "population".to_owned(),
            Self::Nothing => "none".to_owned(),
            Self::Named(prior) => prior.to_string(),
            Self::Fit(fit) => fit.source.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn prior_text_round_trips() {
        for text in ["population", "none", "omega_nm=9:0.2,T_I=5:0.5"] {
            assert_eq!(PersonPrior::read(text).unwrap().text().as_deref(), Some(text));
        }
        let named = PersonPrior::read("omega_nm=9:0.2").unwrap();
        assert_eq!(
            (named.named_parameter("omega_nm"), named.named_parameter("tau_e")),
            (Some((9.0, 0.2)), None)
        );
        assert!(PersonPrior::read("T_L=1:0.1").unwrap_err().contains("T_L"));
        for wrong in ["usual", "fit.json", "omega_nm=9"] {
            assert!(
                PersonPrior::read(wrong).unwrap_err().contains("hoid identify --json"),
                "{wrong}"
            );
        }
    }
}
