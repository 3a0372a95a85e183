//! Options of the estimator of a person's operator: the fields of [`FamilyEstimator`], and the names under which text
//! input sets them. Each option is defined only here.

use std::ops::RangeInclusive;

use hoid_model::{Detrend, Form, MAX_ORDER, Record, operator_family::Coordinate};

use super::{channel::SeenChannel, intersample::Intersample, prior::OperatorPrior};
use crate::{
    IdentError, InitialState, SearchOptions,
    diagnostics::RUN_TO_RUN_DEVIATION,
    order_selection::{NamedOrders, range_text},
    settings::{BatchOption, BatchOptions, Bounds, Kind, Setting},
    shared_options as shared,
};

/// Highest order of the noise model.
pub const HIGHEST_NOISE_ORDER: usize = MAX_ORDER;
/// Time in s that the noise model spans at the highest order of the default search. In a closed loop the noise model
/// must span the time in which the operator responds, or it biases the operator ([`super::sensitivity`]).
const NOISE_SPAN_S: f64 = 0.5;
/// Highest order of the default search at low rates, and for few samples.
const MIN_HIGHEST_ND: usize = 24;
/// Number of samples for each order above [`MIN_HIGHEST_ND`] in the default search: Akaike's criterion selects too high
/// an order if the number of coefficients is not small compared with the number of samples.
const SAMPLES_PER_ORDER: usize = 40;
/// Highest nd that is searched by default if nc is above zero: an ARMA model needs few coefficients.
const HIGHEST_ND_WITH_NC: usize = 8;

/// Estimator of the operator of a person, with its options.
#[derive(Debug, Clone, PartialEq)]
pub struct FamilyEstimator {
    /// Candidate forms; those that are not proper are skipped, and a single form is fitted without a comparison.
    /// Default: all forms of a response to the error.
    pub forms: Vec<Form>,
    /// True if the operator has a neuromuscular part. Default true.
    pub neuromuscular: bool,
    /// Prior knowledge of the person. Default [`OperatorPrior::population`].
    pub prior: OperatorPrior,
    /// Shortest and longest delay tau_e in s. Default 0.02 to 0.8.
    pub delay_range_s: (f64, f64),
    /// Intersample behaviour of the error. Default [`Intersample::Auto`].
    pub intersample: Intersample,
    /// Candidate orders nc of the noise model. Default 0.
    pub nc: RangeInclusive<usize>,
    /// Candidate orders nd of the noise model; if `None`, from 0 to the order that spans half a second, at least 24.
    /// Default `None`.
    pub nd: Option<RangeInclusive<usize>>,
    /// Further inputs that the person sees or feels, as channels of the records. Default none.
    pub channels: Vec<SeenChannel>,
    /// Channel of the recorded disturbance or target, which supplies the lines and the instrument.
    pub excitation: Option<String>,
    /// Period of the excitation in s; if `None`, the period is determined from the lines.
    pub period_s: Option<f64>,
    /// Coordinates that are individual to each record; all other coordinates are common to all records.
    pub individual: Vec<Coordinate>,
    /// Relative variation of a person's gain from run to run. For fewer than five records it is added to the error
    /// bars, since blocks of these records cannot show it. Default [`RUN_TO_RUN_DEVIATION`].
    pub run_to_run: f64,
    /// Trend that is removed from e and u of each record before the fit, because an operator with a lag integrates an
    /// offset. Default: the mean.
    pub detrend: Detrend,
    /// Initial states of each record. Default: estimated.
    pub initial_state: InitialState,
    /// Limits of the search.
    pub search: SearchOptions,
}

impl Default for FamilyEstimator {
    fn default() -> Self {
        Self {
            forms: Form::ERROR_FORMS.to_vec(),
            neuromuscular: true,
            prior: OperatorPrior::population(),
            delay_range_s: (0.02, 0.8),
            intersample: Intersample::Auto,
            nc: 0..=0,
            nd: None,
            channels: Vec::new(),
            excitation: None,
            period_s: None,
            individual: Vec::new(),
            run_to_run: RUN_TO_RUN_DEVIATION,
            detrend: Detrend::Mean,
            initial_state: InitialState::Estimate,
            search: SearchOptions {
                tolerance: 1e-9,
                ..SearchOptions::default()
            },
        }
    }
}

impl FamilyEstimator {
    /// Returns the estimator with the candidate orders nd for these records.
    pub(super) fn with_nd_for(&self, records: &[Record]) -> Self {
        let samples: usize = records.iter().map(Record::len).sum();
        let of_span = records
            .first()
            .map_or(0, |record| (NOISE_SPAN_S / record.sample_time().s()).round() as usize);
        let highest = of_span
            .min(samples / SAMPLES_PER_ORDER)
            .clamp(MIN_HIGHEST_ND, HIGHEST_NOISE_ORDER);
        let nd = self.nd.clone().unwrap_or(0..=highest);
        Self {
            nd: Some(nd),
            ..self.clone()
        }
    }

    /// Returns the candidate orders nd; if none are given, the default orders for few samples.
    pub(super) fn nd(&self) -> RangeInclusive<usize> {
        self.nd.clone().unwrap_or(0..=MIN_HIGHEST_ND)
    }

    /// Sets the orders nc and nd of the noise model. If nc is not given it is zero. If nd is not given it is searched
    /// up to the order that spans half a second, or up to 8 if nc is above zero.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for the name of any other order, and for an order above [`HIGHEST_NOISE_ORDER`].
    pub fn with_noise_orders(self, named: &NamedOrders) -> Result<Self, IdentError> {
        for (name, range) in named {
            let refuse = |expected: String| IdentError::BadOption {
                option: format!("order {name}"),
                found: range_text(range),
                expected,
            };
            if !matches!(name.as_str(), "nc" | "nd") {
                return Err(IdentError::BadOption {
                    option: "orders of the noise model".to_owned(),
                    found: name.clone(),
                    expected: "nc or nd: the form determines the other orders".to_owned(),
                });
            }
            if *range.end() > HIGHEST_NOISE_ORDER {
                return Err(refuse(format!("a number or a range within 0..{HIGHEST_NOISE_ORDER}")));
            }
        }
        let nc = named.get("nc").cloned().unwrap_or(0..=0);
        let of_arma = (*nc.end() > 0).then_some(0..=HIGHEST_ND_WITH_NC);
        let nd = named.get("nd").cloned().or(of_arma);
        Ok(Self { nc, nd, ..self })
    }
}

impl BatchOptions for FamilyEstimator {
    fn options() -> Vec<BatchOption<Self>> {
        let default = Self::default();
        let mut all = vec![
            shared::noise_option(|how: &mut Self, _, text| {
                if text == "arma" {
                    let orders = NamedOrders::from([("nc".to_owned(), 1..=2)]);
                    *how = how.clone().with_noise_orders(&orders)?;
                }
                Ok(())
            }),
            shared::change_option(),
            shared::form_option(|how: &mut Self, form| {
                how.forms = form.map_or(Form::ERROR_FORMS.to_vec(), |form| vec![form])
            })
            .with_formatter("form", |how, _| Some(how.forms_as_text())),
            shared::neuromuscular_option(|how: &mut Self| &mut how.neuromuscular)
                .with_formatter("neuromuscular", |how, _| Some(shared::yes_no_text(how.neuromuscular))),
            shared::prior_option("population", |how: &mut Self| &mut how.prior)
                .with_formatter("prior", |how, _| Some(how.prior.to_string())),
            BatchOption::new(
                shared::orders_setting("nc=0, nd up to 0.5 s (noise model)"),
                |how: &mut Self, option, text| {
                    let mut named: NamedOrders = option.read(text)?;
                    if *how.nc.end() > 0 {
                        named.entry("nc".to_owned()).or_insert_with(|| how.nc.clone());
                    }
                    *how = how.clone().with_noise_orders(&named)?;
                    Ok(())
                },
            )
            .with_formatter("noise orders", |how, _| {
                let nc = shared::order_range_text(&how.nc);
                let nd = match &how.nd {
                    Some(nd) => format!("nd={}", shared::order_range_text(nd)),
                    None => format!("nd up to {NOISE_SPAN_S} s"),
                };
                Some(format!("nc={nc}, {nd}, by AIC"))
            }),
            shared::delay_range_option(
                default.delay_range_s,
                |how: &mut Self| &mut how.delay_range_s,
                |how| how.delay_range_s,
            ),
            BatchOption::new(intersample_setting(), |how: &mut Self, option, text| {
                how.intersample = option.parse_choice(text)?;
                Ok(())
            })
            .with_formatter("e between samples", |how, _| Some(how.intersample.name().to_owned())),
            BatchOption::new(
                run_to_run_setting(default.run_to_run),
                |how: &mut Self, option, text| {
                    how.run_to_run = option.read(text)?;
                    Ok(())
                },
            )
            .with_formatter("variation from run to run", |how, _| Some(how.run_to_run.to_string())),
            BatchOption::new(role_setting(), |how: &mut Self, option, text| {
                let typed: Vec<String> = option.read(text)?;
                let mut channels: Vec<SeenChannel> = Vec::with_capacity(typed.len());
                for part in &typed {
                    let channel = part
                        .parse::<SeenChannel>()
                        .map_err(|why| option.invalid_value(part, &why))?;
                    if channels.iter().any(|known| known.name == channel.name) {
                        return Err(option.error(format!("names {} twice", channel.name)));
                    }
                    channels.push(channel);
                }
                how.channels = channels;
                Ok(())
            })
            .with_formatter("further inputs", |how, _| {
                let words: Vec<String> = how.channels.iter().map(SeenChannel::to_string).collect();
                (!words.is_empty()).then(|| words.join(", "))
            }),
            shared::individual_parameters_option(|how: &mut Self, option, names| {
                let coordinate = |name: &String| {
                    let expected = "K, T_L, T_I, omega_nm, zeta_nm or tau_e";
                    Coordinate::from_parameter(name).ok_or_else(|| option.invalid_value(name, expected))
                };
                how.individual = names.iter().map(coordinate).collect::<Result<_, _>>()?;
                Ok(())
            })
            .with_formatter("individual", |how, _| {
                let names: Vec<&str> = how.individual.iter().map(|c| c.parameter()).collect();
                (!names.is_empty()).then(|| names.join(", "))
            }),
            shared::initial_state_option(|how: &mut Self, _, rule| {
                how.initial_state = rule.unwrap_or_default();
                Ok(())
            }),
        ];
        all.extend(shared::search_options(default.search, |how: &mut Self| &mut how.search));
        all
    }
}

impl FamilyEstimator {
    fn forms_as_text(&self) -> String {
        let names: Vec<&str> = self.forms.iter().map(|form| form.name()).collect();
        match names.as_slice() {
            [only] => (*only).to_owned(),
            all => format!("auto among {}", all.join(", ")),
        }
    }
}

fn intersample_setting() -> Setting {
    let help = "Behaviour of e between samples: held (zoh), linear (foh: e was logged from a faster or continuous \
                signal; tau_e is half a sample longer), or auto (zoh or foh if noise-free data show which applies, \
                else smooth, with tau_e as for a held e)";
    Setting::new("intersample", Kind::Choice(&Intersample::NAMES), help).default("auto")
}

fn role_setting() -> Setting {
    let help = "Role of each input other than the error: r=feedforward (displayed target; r=feedforward:0.5 with 0.5 s \
                of preview), motion, output; /FORM restricts the response to one form, such as \
                r=feedforward/derivative";
    Setting::new("role", Kind::Names, help)
}

fn run_to_run_setting(default: f64) -> Setting {
    let help = "Relative run-to-run variation of a person's gain; added to the error bars if there are fewer than five \
                records";
    Setting::new("run_to_run", Kind::Number, help)
        .default(&default.to_string())
        .bounds(Bounds::AtLeast(0.0))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{Channel, SampleTime};

    use super::*;

    #[test]
    fn default_noise_order_spans_half_a_second() {
        let highest = |rate_hz: f64, seconds: f64, own: Option<RangeInclusive<usize>>| {
            let n = (rate_hz * seconds) as usize;
            let channel = |name: &str| Channel::new(name, "", vec![0.0; n]);
            let record = Record::new(SampleTime::new(1.0 / rate_hz).unwrap(), channel("e"), channel("u")).unwrap();
            let estimator = FamilyEstimator {
                nd: own,
                ..FamilyEstimator::default()
            };
            *estimator.with_nd_for(&[record]).nd().end()
        };
        assert_eq!(
            [20.0, 60.0, 100.0, 200.0].map(|rate| highest(rate, 80.0, None)),
            [24, 30, 50, 64]
        );
        // With few samples the highest order is lower; a range given by the user is kept.
        assert_eq!((highest(100.0, 12.0, None), highest(100.0, 4.0, None)), (30, 24));
        assert_eq!(highest(100.0, 80.0, Some(1..=3)), 3);
    }
}
