//! Prior knowledge of people.
//!
//! A short tracking record carries little information about the neuromuscular system, whose resonance is above the
//! excited frequencies. A weak prior keeps the parameters in the range of people, and has almost no effect if the data
//! determine them. A positive parameter x has a log-normal prior, `ln x ~ N(ln centre, spread^2)`, so the spread is
//! relative. In the criterion the prior is an additional measurement of the parameter (a maximum a posteriori estimate;
//! L. Ljung, *System Identification*, 1999, section 7.4).
//!
//! The prior share of a result is the ratio of the posterior to the prior variance
//! ([`prior_share`](super::Parameter::prior_share)); a share of one means that the data carried no information. The
//! shift of the estimate by the prior follows from this share ([`OperatorPrior::pull`]).

use std::{fmt, str::FromStr};

use hoid_model::{
    operator_family::{Coordinate, Form},
    uncertainty::Estimate,
};

use super::Parameter;
use crate::{IdentError, grey_box::objective::Penalty};

/// Smallest spread. A smaller spread would practically fix the parameter and is rejected, since `--fix` does this
/// explicitly. A smaller standard error from another fit is replaced by this value.
const MIN_SPREAD: f64 = 1e-3;

/// Prior of one parameter.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ParameterPrior {
    /// Name of the parameter: `omega_nm`, `zeta_nm`, `tau_e`, `T_L` or `T_I`.
    pub parameter: String,
    /// Median, in the unit of the parameter.
    pub centre: f64,
    /// Standard deviation of the natural logarithm of the parameter.
    pub spread: f64,
    /// Source of the prior knowledge.
    pub source: String,
}

/// Prior knowledge of the parameters of an operator.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct OperatorPrior {
    entries: Vec<ParameterPrior>,
}

/// Coordinates whose parameters can have a prior.
const COORDINATES_WITH_PRIOR: [Coordinate; 5] = [
    Coordinate::LogOmega,
    Coordinate::LogZeta,
    Coordinate::Delay,
    Coordinate::Lead,
    Coordinate::LagRate,
];

/// Returns the coordinate of a parameter; `None` if the parameter cannot have a prior.
fn coordinate_of(parameter: &str) -> Option<Coordinate> {
    COORDINATES_WITH_PRIOR.into_iter().find(|c| c.parameter() == parameter)
}

/// Source of the population prior.
const POPULATION_PRIOR_SOURCE: &str = "published pilot data: D. T. McRuer et al., IEEE Trans. Man-Machine Systems 9 (1968) \
                             61-71; P. M. T. Zaal et al., J. Guidance, Control, and Dynamics 32 (2009) 1089-1099";

impl OperatorPrior {
    /// Returns an empty prior.
    pub fn none() -> Self {
        Self::default()
    }

    /// Returns the prior for people in manual control: omega_nm 10.5 rad/s within 30 %, zeta_nm 0.3 within a factor of
    /// 1.6, tau_e 0.2 s within a factor of two; each range is plus or minus one standard deviation.
    pub fn population() -> Self {
        let entry = |parameter: &str, centre, spread| ParameterPrior {
            parameter: parameter.to_owned(),
            centre,
            spread,
            source: POPULATION_PRIOR_SOURCE.to_owned(),
        };
        Self {
            entries: vec![
                entry("omega_nm", 10.5, 0.3),
                entry("zeta_nm", 0.3, 0.5),
                entry("tau_e", 0.2, 0.7),
            ],
        }
    }

    /// Creates a prior from these entries.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a parameter that cannot have a prior or has two priors, for a nonpositive centre,
    /// and for a spread below 0.001.
    pub fn new(entries: Vec<ParameterPrior>) -> Result<Self, IdentError> {
        for (i, entry) in entries.iter().enumerate() {
            let refuse = |found: String, expected: &str| {
                Err(IdentError::BadOption {
                    option: "the prior".to_owned(),
                    found,
                    expected: expected.to_owned(),
                })
            };
            if coordinate_of(&entry.parameter).is_none() {
                let names = COORDINATES_WITH_PRIOR.map(Coordinate::parameter).join(", ");
                return refuse(entry.parameter.clone(), &format!("one of {names}"));
            }
            if entries[..i].iter().any(|other| other.parameter == entry.parameter) {
                return refuse(format!("{} twice", entry.parameter), "each parameter once");
            }
            if !(entry.centre.is_finite() && entry.centre > 0.0) {
                return refuse(
                    format!("{}={}", entry.parameter, entry.centre),
                    "a positive centre, such as omega_nm=10.5:0.3",
                );
            }
            if !(entry.spread.is_finite() && entry.spread >= MIN_SPREAD) {
                return refuse(
                    format!("{}={}:{}", entry.parameter, entry.centre, entry.spread),
                    "a spread (standard deviation of the logarithm) of 0.001 or more, such as omega_nm=10.5:0.3",
                );
            }
        }
        Ok(Self { entries })
    }

    /// Creates a prior from the parameters of another fit, each given by its name, its estimate, and whether it is
    /// determined. The prior contains the determined parameters that can have a prior and have a standard error. The
    /// spread of the logarithm is `standard error/value`, to first order. The prior may be empty.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a parameter that occurs twice.
    pub fn from_parameters<'p>(
        found: impl IntoIterator<Item = (&'p str, Estimate, bool)>,
        source: &str,
    ) -> Result<Self, IdentError> {
        let entry = |(name, estimate, determined): (&str, Estimate, bool)| {
            let (value, error) = (estimate.value, estimate.standard_error?);
            let counts = determined && coordinate_of(name).is_some() && value > 0.0 && error > 0.0;
            counts.then(|| ParameterPrior {
                parameter: name.to_owned(),
                centre: value,
                spread: (error / value).max(MIN_SPREAD),
                source: source.to_owned(),
            })
        };
        Self::new(found.into_iter().filter_map(entry).collect())
    }

    /// Returns the prior with only the entries of the neuromuscular system.
    pub(super) fn neuromuscular_only(mut self) -> Self {
        self.entries.retain(|entry| {
            matches!(
                coordinate_of(&entry.parameter),
                Some(Coordinate::LogOmega | Coordinate::LogZeta)
            )
        });
        self
    }

    /// Returns the priors of the parameters.
    pub fn entries(&self) -> &[ParameterPrior] {
        &self.entries
    }

    /// Returns the shift in the logarithm of an estimate that is due to the prior of this parameter, with all other
    /// priors unchanged. Two normally distributed measurements of x with the fractions 1 - w and w of the information
    /// have the mean `x = (1 - w) x_data + w m`, so `x - x_data = w (m - x)/(1 - w)`. `None` if the parameter has no
    /// prior, or is determined by the prior alone.
    pub fn pull(&self, parameter: &Parameter) -> Option<f64> {
        let name = parameter.name.split('[').next();
        let entry = self.entries.iter().find(|e| Some(e.parameter.as_str()) == name)?;
        let share = parameter.prior_share;
        let found = (entry.centre / parameter.value).ln() * share / (1.0 - share);
        found.is_finite().then_some(found)
    }

    /// Returns the terms `(g_i - m_i)^2/s_i^2` of the prior for the coordinates of a form, with the weight one.
    pub(crate) fn penalties(&self, form: Form, neuromuscular: bool) -> Vec<Penalty> {
        let coordinates = form.coordinates(neuromuscular);
        let of = |entry: &ParameterPrior| {
            let coordinate = coordinate_of(&entry.parameter)?;
            let place = coordinates.iter().position(|c| *c == coordinate)?;
            let sign = if coordinate == Coordinate::LagRate { -1.0 } else { 1.0 };
            Some(Penalty {
                index: place,
                logarithmic: !matches!(coordinate, Coordinate::LogOmega | Coordinate::LogZeta),
                mean: sign * entry.centre.ln(),
                precision: 1.0 / (entry.spread * entry.spread),
                variance: 1.0,
            })
        };
        self.entries.iter().filter_map(of).collect()
    }
}

impl fmt::Display for OperatorPrior {
    /// Formats the prior as on the command line: `omega_nm=10.5:0.3,zeta_nm=0.3:0.5`, or `none`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.entries.is_empty() {
            return f.write_str("none");
        }
        let entry = |e: &ParameterPrior| format!("{}={}:{}", e.parameter, e.centre, e.spread);
        f.write_str(&self.entries.iter().map(entry).collect::<Vec<_>>().join(","))
    }
}

impl FromStr for OperatorPrior {
    type Err = IdentError;

    /// Parses `population`, `none`, or `NAME=CENTRE:SPREAD,...`.
    fn from_str(text: &str) -> Result<Self, IdentError> {
        match text.trim() {
            "population" => return Ok(Self::population()),
            "none" => return Ok(Self::none()),
            _ => {}
        }
        let entry = |part: &str| {
            let parsed = part.split_once('=').and_then(|(name, rest)| {
                let (centre, spread) = rest.split_once(':')?;
                Some((name.trim(), centre.trim().parse().ok()?, spread.trim().parse().ok()?))
            });
            let (parameter, centre, spread) = parsed.ok_or_else(|| IdentError::BadOption {
                option: "the prior".to_owned(),
                found: part.to_owned(),
                expected: "population, none, or NAME=CENTRE:SPREAD separated by commas, such as omega_nm=10.5:0.3"
                    .to_owned(),
            })?;
            Ok(ParameterPrior {
                parameter: parameter.to_owned(),
                centre,
                spread,
                source: "given by the user".to_owned(),
            })
        };
        Self::new(text.split(',').map(entry).collect::<Result<_, IdentError>>()?)
    }
}

#[cfg(test)]
mod tests {
    use hoid_sim::people::{Person, Plant, Population, RemnantKind, Task};

    use super::*;
    use crate::family::FamilyEstimator;

    #[test]
    fn prior_text_round_trips() {
        let typed: OperatorPrior = "omega_nm=10.5:0.3, zeta_nm=0.3:0.5".parse().unwrap();
        assert_eq!(typed.to_string(), "omega_nm=10.5:0.3,zeta_nm=0.3:0.5");
        assert_eq!("none".parse::<OperatorPrior>().unwrap(), OperatorPrior::none());
        assert_eq!("population".parse::<OperatorPrior>().unwrap().entries().len(), 3);
        for bad in [
            "",
            "omega_nm",
            "omega_nm=10",
            "K=1:1",
            "omega_nm=-1:0.3",
            "omega_nm=1:0",
            "T_L=1:1,T_L=2:1",
        ] {
            assert!(bad.parse::<OperatorPrior>().is_err(), "{bad}");
        }
    }

    #[test]
    fn prior_uses_only_parameters_determined_by_a_fit() {
        let estimate = |value, standard_error| Estimate { value, standard_error };
        let found = [
            ("K", estimate(4.0, Some(0.2)), true),
            ("T_L", estimate(0.5, Some(0.05)), true),
            ("T_I", estimate(5.0, Some(4.0)), false),
            ("omega_nm", estimate(11.0, None), true),
            ("zeta_nm", estimate(-0.1, Some(0.1)), true),
            ("tau_e", estimate(0.2, Some(1e-6)), true),
        ];
        let prior = OperatorPrior::from_parameters(found, "a fit").unwrap();
        assert_eq!(prior.to_string(), "T_L=0.5:0.1,tau_e=0.2:0.001");
        assert!(prior.entries().iter().all(|e| e.source == "a fit"));
        let none = OperatorPrior::from_parameters(found[2..5].to_vec(), "a fit").unwrap();
        assert_eq!(none, OperatorPrior::none());
        assert!(OperatorPrior::from_parameters([found[1], found[1]], "a fit").is_err());
    }

    #[test]
    fn only_coordinates_of_the_form_are_penalised() {
        let prior = OperatorPrior::population();
        assert_eq!(prior.penalties(Form::LeadLag, true).len(), 3);
        assert_eq!(prior.penalties(Form::LeadLag, false).len(), 1);
        let lag: OperatorPrior = "T_I=5:0.5".parse().unwrap();
        let [penalty] = lag.penalties(Form::LeadLag, true)[..] else {
            panic!("one penalty")
        };
        // ln(1/T_I) is centred at -ln 5.
        assert_eq!((penalty.index, penalty.mean), (2, -(5.0_f64.ln())));
        assert!(lag.penalties(Form::Lead, true).is_empty());
    }

    #[test]
    fn removing_the_prior_pull_gives_the_fit_without_prior() {
        // Computed by hand: the data are at ln 8 with three quarters of the information, and the prior is at ln 10.5.
        let (data, prior, share): (f64, f64, f64) = (8.0, 10.5, 0.25);
        let both = ((1.0 - share) * data.ln() + share * prior.ln()).exp();
        let found = parameter("omega_nm[2]", both, share);
        let pull = OperatorPrior::population().pull(&found).unwrap();
        assert!((both * (-pull).exp() - data).abs() < 1e-12);
        assert!(pull > 0.0);
        let none = [
            parameter("K", 1.0, 0.5),
            parameter("omega_nm", 8.0, 1.0),
            parameter("omega_nm", 0.0, 0.5),
        ];
        assert!(none.iter().all(|p| OperatorPrior::population().pull(p).is_none()));

        // The same holds for two fits, to first order.
        let (population, task) = (Population::default(), Task::default());
        let kind = RemnantKind::BroadBand;
        let person = Person::draw(
            &population,
            &task,
            Plant::LaggedIntegrator,
            Some(Form::Lead),
            kind,
            31,
            5,
        )
        .unwrap();
        let records: Vec<_> = (0..4).map(|run| person.run(run).unwrap().record).collect();
        let fit = |prior: &str| {
            let estimator = FamilyEstimator {
                forms: vec![Form::Lead],
                prior: prior.parse().unwrap(),
                ..FamilyEstimator::default()
            };
            let fit = estimator.fit(&records).unwrap();
            fit.operators[0]
                .parameters
                .iter()
                .find(|p| p.name == "omega_nm")
                .unwrap()
                .clone()
        };
        let (with, without) = (fit("omega_nm=10.5:0.1"), fit("none"));
        let pull = "omega_nm=10.5:0.1"
            .parse::<OperatorPrior>()
            .unwrap()
            .pull(&with)
            .unwrap();
        let moved = (with.value / without.value).ln();
        println!("{with:?} {without:?} {pull} {moved}");
        assert!((pull / moved - 1.0).abs() < 0.3, "{pull} and {moved}");
    }

    fn parameter(name: &str, value: f64, prior_share: f64) -> Parameter {
        Parameter {
            name: name.to_owned(),
            unit: "rad/s",
            value,
            standard_error: Some(0.1),
            standard_error_person: None,
            interval: None,
            prior_share,
            determined: true,
            averaged_over: Vec::new(),
        }
    }
}
