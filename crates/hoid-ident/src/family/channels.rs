//! Further inputs of a person in addition to the error: a target with preview, the output of the machine, or its
//! motion.
//!
//! `u = Y e + sum_i Y_i x_i + (C/D) eps`: the human is a multichannel controller (D. T. McRuer and H. R. Jex, *IEEE
//! Trans. Human Factors in Electronics* 8 (1967) 231-249, section II; M. Mulder et al., *IEEE Trans. Human-Machine
//! Systems* 48 (2018) 457-469). Each channel has a separate form, gain and delay; all channels share the neuromuscular
//! system of the operator, which moves the hand. All responses are fitted together by prediction error: if a person in
//! a closed loop also sees the target, `U/E` differs from the response to e at the lines and at all other frequencies.
//!
//! **Starts.** A high-order ARX model with all inputs is estimated by one linear regression and is consistent in a
//! closed loop (L. Ljung, *System Identification*, 1999, sections 13.4 and 13.5). Each form is fitted to the responses
//! of this model; searches from other starts may end in other minima.
//!
//! **Forms** of each channel are compared in [`choice`].
//!
//! **Preview** allows negative delays: the channel x is advanced by the preview in samples, and the fitted delay is
//! relative to the advanced signal.

pub(super) mod choice;

use std::sync::Arc;

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{Complex64, Detrend, Form, Record, SampleTime, Structure, operator_family::Coordinate};

use super::{
    arx_response::{MAX_NB, frequencies, halve_orders, initial_orders, measured_response},
    channel::{Channel, ChannelFit, ChannelResponse, SeenChannel, preview_samples},
    channel_criterion::{ChannelInForm, ChannelLineFitter, own_coordinates},
    channel_lines::{ChannelLines, have_separate_lines},
    coordinates,
    covariances::Covariances,
    estimated::EstimateErrors,
    intersample::Intersample,
    parameter::{CoordinateEstimate, Parameter},
    prediction::PredictionProblem,
    prediction_fit::PredictionFit,
    prior::OperatorPrior,
    response_fit::{MeasuredResponse, ResponseCriterion},
    result::FamilyFit,
};
use crate::{
    IdentError, InitialState, SearchOptions,
    criterion::{
        Criterion, Data,
        further_input::{FurtherInput, InputOrders},
    },
    grey_box::parametrisation::Parametrisation,
    independent_inputs::check_independent_inputs,
    linalg::vectors::add_scaled,
    several_inputs::SeveralInputs,
};

/// Relative increase in the diagonal of the normal matrix in the regression for the ARX model.
const RELATIVE_RIDGE: f64 = 1e-7;
/// Longest delay of a channel relative to the end of the preview, s.
const LONGEST_DELAY_S: f64 = 0.8;

/// Channels of the records, with the same kind of trend removed as from e and u.
#[derive(Debug)]
pub(super) struct FurtherInputs<'s> {
    all: &'s [SeenChannel],
    /// Values of each channel in each record.
    values: Vec<Vec<Vec<f64>>>,
    leads: Vec<usize>,
    /// The records before truncation by the preview, so whole periods are kept; the trend of e and u is removed.
    whole: Vec<Record>,
}

impl<'s> FurtherInputs<'s> {
    /// Returns the channels, and the records truncated to the samples at which every previewed channel has a value.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if a record lacks a channel or is not longer than the preview, or if a preview is out
    /// of range.
    pub fn of(
        records: Vec<Record>,
        all: &'s [SeenChannel],
        detrend: Detrend,
    ) -> Result<(Vec<Record>, Self), IdentError> {
        let refuse = |found: String, expected: &str| {
            Err(IdentError::BadOption {
                option: "the inputs".to_owned(),
                found,
                expected: expected.to_owned(),
            })
        };
        let Some(first) = records.first().filter(|_| !all.is_empty()) else {
            let none = Self {
                all,
                values: Vec::new(),
                leads: Vec::new(),
                whole: Vec::new(),
            };
            return Ok((records, none));
        };
        let sample_time = first.sample_time();
        for channel in all {
            let shown = channel.preview_s;
            if !(shown.is_finite() && (0.0..=10.0).contains(&shown)) {
                return refuse(
                    format!("{} with {shown} s of preview", channel.name),
                    "0 to 10 s of preview",
                );
            }
        }
        let leads: Vec<usize> = all.iter().map(|c| preview_samples(c.preview_s, sample_time)).collect();
        let longest = leads.iter().copied().max().unwrap_or(0);
        let mut values = vec![Vec::with_capacity(records.len()); all.len()];
        let mut cut = Vec::with_capacity(records.len());
        let whole = records.clone();
        for record in records {
            let left = record.len().saturating_sub(longest);
            if left == 0 {
                return refuse(
                    format!("{} samples of {}", record.len(), record.label()),
                    "a record longer than the preview",
                );
            }
            for ((channel, &lead), values) in all.iter().zip(&leads).zip(&mut values) {
                let Some(found) = record.channel(&channel.name) else {
                    let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
                    return refuse(
                        format!("no channel {} in {}", channel.name, record.label()),
                        &format!("one of {}", names.join(", ")),
                    );
                };
                values.push(detrend.detrended_values(&found[lead..lead + left]));
            }
            cut.push(if longest == 0 {
                record
            } else {
                record.span(record.time_s(0), record.time_s(left))?
            });
        }
        let found = Self {
            all,
            values,
            leads,
            whole,
        };
        Ok((cut, found))
    }

    /// True if there are no channels.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Returns an error for an input that is constant or a linear combination of the previous inputs, such as r = e + y
    /// if all three signals of a loop are inputs.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] with the name of the input.
    pub fn check(&self, records: &[Record]) -> Result<(), IdentError> {
        let whole = |of: &dyn Fn(usize) -> Vec<f64>| -> Vec<f64> { (0..records.len()).flat_map(of).collect() };
        let error = whole(&|k| Detrend::Mean.detrended_values(records[k].input()));
        let channels = (self.all.iter().zip(&self.values)).map(|(channel, values)| {
            let own = whole(&|k| Detrend::Mean.detrended_values(&values[k]));
            (channel.name.as_str(), own)
        });
        check_independent_inputs(std::iter::once(("e", error)).chain(channels))
    }

    /// Returns the first sample at which no channel needs samples from before the record; the noise model may need
    /// further samples.
    pub fn first_regressed_sample(&self, neuromuscular: bool, sampling: (SampleTime, Intersample)) -> usize {
        let (sample_time, intersample) = sampling;
        let muscles = if neuromuscular { 2 } else { 0 };
        let of = |(channel, lead): (&SeenChannel, &usize)| {
            let gains =
                |form: &Form| intersample.numerator_length(usize::from(form.has_pole()) + muscles, form.degree());
            let most = channel.forms.iter().map(gains).max().unwrap_or(1);
            *lead + (LONGEST_DELAY_S / sample_time.s()).ceil() as usize + 2 + most
        };
        self.all.iter().zip(&self.leads).map(of).max().unwrap_or(0)
    }

    /// Returns the names of the channels.
    pub fn names(&self) -> Vec<String> {
        self.all.iter().map(|channel| channel.name.clone()).collect()
    }

    /// Returns the lines of all excitations of the loop; `None` if there are no lines.
    pub fn lines(&self, excitation: Option<&str>, period_s: Option<f64>) -> Option<Arc<ChannelLines>> {
        let targets = self.all.iter().filter(|channel| channel.role.excites());
        let targets: Vec<String> = targets.map(|channel| channel.name.clone()).collect();
        ChannelLines::of(&self.whole, (&self.names(), &targets), (excitation, period_s)).map(Arc::new)
    }

    /// Returns a channel in a given form, with its preview and its delay range.
    fn channel_in_form(
        &self,
        index: usize,
        form: Form,
        (sample_time, intersample): (SampleTime, Intersample),
    ) -> ChannelInForm {
        let lead_s = self.leads[index] as f64 * sample_time.s();
        ChannelInForm {
            index,
            form,
            lead_s,
            delay_range_s: (intersample.shortest_delay_s(sample_time), lead_s + LONGEST_DELAY_S),
        }
    }

    /// Returns the lines with their variances, starting from the responses of the ARX model.
    ///
    /// If the lines do not distinguish the inputs, the variances are those of a fit without the further inputs. With
    /// them, `Y_e = -1/P` and `Y_r = 1/P` reproduce u without error, since `e = r - P u`. A fit near this solution
    /// leaves next to nothing in the bins between the lines, so the variances would be far too small.
    pub fn weighted_lines(
        &self,
        at: &ChannelLineFitter<'_>,
        begun: &[Vec<Channel<'_>>],
        responses: &[Vec<MeasuredResponse>],
    ) -> Arc<ChannelLines> {
        let apart = have_separate_lines(Some(at.lines), self.all);
        let nearest = |points: &Vec<MeasuredResponse>, omega: f64| {
            let off = |p: &MeasuredResponse| (p.omega_rad_s / omega).ln().abs();
            let near = points.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            near.map_or(Complex64::new(0.0, 0.0), |p| p.response)
        };
        let flexible = begun.iter().enumerate().filter(|_| apart).filter_map(|(k, forms)| {
            let form = forms.first()?.form;
            Some(self.channel_in_form(k, form, at.sampling))
        });
        at.weighted_lines((Form::LeadLag, &flexible.collect::<Vec<_>>()), |omega| {
            let turned = |(k, points): (usize, &Vec<MeasuredResponse>)| {
                let lead_s = k
                    .checked_sub(1)
                    .map_or(0.0, |k| self.leads[k] as f64 * at.sampling.0.s());
                nearest(points, omega) * Complex64::from_polar(1.0, omega * lead_s)
            };
            responses.iter().enumerate().map(turned).collect()
        })
    }

    /// Estimates the responses to e and to each channel by one regression, without an assumption on their forms.
    ///
    /// # Errors
    /// [`IdentError::SingularRegressors`] if the records do not distinguish the inputs.
    pub fn responses(&self, records: &[Record]) -> Result<Vec<Vec<MeasuredResponse>>, IdentError> {
        let mut orders = initial_orders(records, self.all.len() + 1, MAX_NB);
        loop {
            if let Some(found) = self.regress(records, orders) {
                return Ok(found);
            }
            orders = halve_orders(orders).ok_or_else(|| IdentError::SingularRegressors {
                columns: format!("e, {} and their past samples", self.names().join(", ")),
            })?;
        }
    }

    fn regress(&self, records: &[Record], (na, nb): (usize, usize)) -> Option<Vec<Vec<MeasuredResponse>>> {
        let sample_time = records[0].sample_time();
        let orders = hoid_model::Orders {
            na,
            nb,
            nk: 1,
            ..hoid_model::Orders::default()
        };
        // The delay relative to the end of the preview is longer by the preview time.
        let own = |lead: &usize| InputOrders {
            nb: (nb + lead).min(2 * MAX_NB),
            nf: 0,
            nk: 0,
        };
        let further: Vec<FurtherInput<'_>> = (self.values.iter().zip(&self.leads))
            .map(|(values, lead)| FurtherInput {
                orders: own(lead),
                values: values.iter().map(Vec::as_slice).collect(),
            })
            .collect();
        let late = further.iter().map(|f| f.orders.first_regressed_sample()).max();
        let first = orders.first_regressed_sample().max(late.unwrap_or(0));
        if records.iter().any(|record| record.len() <= first) {
            return None;
        }
        let error = InputOrders { nb, nf: 0, nk: 1 };
        let inputs = self.names().into_iter().zip(self.leads.iter().map(own));
        let model = SeveralInputs {
            na,
            inputs: std::iter::once(("e".to_owned(), error)).chain(inputs).collect(),
            ..SeveralInputs::new(Structure::Arx)
        };
        let criterion = Criterion {
            orders,
            data: Data::of(records),
            initial: InitialState::Estimate,
            first,
            weights: None,
            further,
        };
        if criterion.residual_count() <= 2 * criterion.parameter_count() {
            return None;
        }
        // An input with few lines determines only the response at these lines, and thus only a few combinations of the
        // coefficients; the ridge makes the regression regular.
        let fit = model.fit_ridge(&criterion, RELATIVE_RIDGE, sample_time)?;
        let omega = frequencies(sample_time);
        let of = |input| {
            fit.frequency_response(input, &omega)
                .iter()
                .map(measured_response)
                .collect()
        };
        Some((0..model.inputs.len()).map(of).collect())
    }

    /// Returns, for each channel, its candidate forms with their starting values; the form closest to the response of
    /// the channel is first.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] if no form could be fitted to a response.
    pub fn starting_forms(
        &self,
        responses: &[Vec<MeasuredResponse>],
        neuromuscular: bool,
        sampling: (SampleTime, Intersample),
        search: &SearchOptions,
    ) -> Result<Vec<Vec<Channel<'_>>>, IdentError> {
        let mut all = Vec::with_capacity(self.all.len());
        for (k, channel) in self.all.iter().enumerate() {
            let shown_s = self.leads[k] as f64 * sampling.0.s();
            let range = (sampling.1.shortest_delay_s(sampling.0), shown_s + LONGEST_DELAY_S);
            let mut forms: Vec<(f64, Channel<'_>)> = Vec::new();
            for &form in channel.forms.iter().filter(|form| form.is_proper(neuromuscular)) {
                let prior = OperatorPrior::population().neuromuscular_only();
                let points = &responses[k + 1];
                let criterion = ResponseCriterion::new(form, neuromuscular, points, &prior, range, sampling);
                let Ok(found) = criterion.fit(search) else {
                    continue;
                };
                let limits = coordinates::limits(form, neuromuscular, range, sampling.0);
                let places = own_coordinates(form, neuromuscular);
                let cost = found.chi_squared + 2.0 * places.len() as f64;
                forms.push((
                    cost,
                    Channel {
                        index: k,
                        form,
                        limits: places.iter().map(|&i| limits[i]).collect(),
                        start: places.iter().map(|&i| found.coordinates[i]).collect(),
                        values: self.values[k].iter().map(Vec::as_slice).collect(),
                    },
                ));
            }
            if forms.is_empty() {
                return Err(IdentError::NoFiniteLoss);
            }
            forms.sort_by(|a, b| a.0.total_cmp(&b.0));
            all.push(forms.into_iter().map(|(_, channel)| channel).collect());
        }
        Ok(all)
    }
}

/// Adds the responses of the final fit to the results of the comparison.
///
/// # Errors
/// The errors of [`hoid_model::FamilyOperator::new`].
pub(super) fn add_responses(
    mut compared: Vec<ChannelFit>,
    prediction: &PredictionProblem<'_>,
    fit: &PredictionFit<'_>,
    errors: &EstimateErrors,
) -> Result<Vec<ChannelFit>, IdentError> {
    let layout = fit.layout();
    let p = fit.parameter_count();
    for (channel, own) in prediction.channels.iter().zip(&layout.channels) {
        let places = layout.channel_indices(own, 0);
        let operator = layout.channel(fit.eta(), own, 0)?;
        let of = |c: &Covariances| -> Vec<f64> {
            let pairs = places.iter().flat_map(|&i| places.iter().map(move |&j| (i, j)));
            pairs.map(|(i, j)| c.clustered[i * p + j]).collect()
        };
        let covariance = errors.covariances.as_ref().map(of);
        let limits: Vec<(f64, f64)> = places.iter().map(|&i| layout.limits()[i]).collect();
        let known = CoordinateEstimate {
            operator: &operator,
            covariance: covariance.as_deref(),
            prior_share: &vec![0.0; places.len()],
            limits: &limits,
            profile: &vec![None; places.len()],
            quantile: errors.quantile(),
            run_to_run: errors.run_to_run,
        };
        let target = &mut compared[channel.index];
        let shown_s = target.preview_time_s(layout.sample_time);
        let muscles = [Coordinate::LogOmega, Coordinate::LogZeta].map(Coordinate::parameter);
        let parameters = known.parameters().into_iter();
        let own = parameters.filter(|parameter| !muscles.contains(&parameter.name.as_str()));
        let parameters = own.map(|parameter| {
            if parameter.name == Coordinate::Delay.parameter() {
                let delay = |tau: f64| tau - shown_s;
                Parameter {
                    name: "tau_f".to_owned(),
                    value: delay(parameter.value),
                    interval: parameter.interval.map(|(low, high)| (delay(low), delay(high))),
                    // Zero is an ordinary value of this delay, so its interval may include zero.
                    determined: parameter.standard_error.is_some(),
                    ..parameter
                }
            } else {
                parameter
            }
        });
        target.response = Some(ChannelResponse {
            parameters: parameters.collect(),
            operator: operator.clone(),
            covariance: covariance.clone(),
        });
    }
    Ok(compared)
}

impl FamilyFit {
    /// Returns a record with the responses to the further inputs, computed from rest, subtracted from u.
    ///
    /// # Errors
    /// [`IdentError`] if the record lacks one of these inputs.
    pub fn without_channels(&self, record: &Record, detrend: Detrend) -> Result<Record, IdentError> {
        let (channels, intersample) = (self.channels.as_slice(), self.intersample);
        let asked: Vec<SeenChannel> = (channels.iter())
            .map(|channel| SeenChannel {
                preview_s: channel.preview_s,
                ..SeenChannel::new(channel.name.clone(), channel.role)
            })
            .collect();
        let label = record.label().to_owned();
        let (mut cut, seen) = FurtherInputs::of(vec![record.clone()], &asked, detrend)?;
        let Some(record) = cut.pop() else {
            return Ok(record.clone());
        };
        let mut total = vec![0.0; record.len()];
        for (channel, values) in channels.iter().zip(&seen.values) {
            let Some(found) = &channel.response else { continue };
            let held = intersample.discrete_model(&found.operator, None, record.sample_time())?;
            let mut response = vec![0.0; record.len()];
            fir(&held.b, held.nk, &values[0], &mut response);
            divide_in_place(&held.f, &mut response);
            add_scaled(&mut total, -1.0, &response);
        }
        let mut of_output = false;
        let left = record.map_signals(|values| {
            if std::mem::replace(&mut of_output, true) {
                add_scaled(values, 1.0, &total);
            }
        })?;
        Ok(left.labelled(label))
    }
}

#[cfg(test)]
mod motion_tests;
#[cfg(test)]
mod tests;
