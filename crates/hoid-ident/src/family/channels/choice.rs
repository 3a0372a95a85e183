//! Selection of the form of each further input: at the lines of the excitations (`channel_lines`) if there are lines,
//! otherwise by prediction error, with likelihood ratios divided by the inflation kappa.
//!
//! The absence of a response is one of the candidates. It is rejected if the p-value of the likelihood ratio of the
//! best form, times the number of forms tried (Bonferroni), is below 0.01.

use hoid_model::Form;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::FurtherInputs;
use crate::{
    IdentError,
    criterion::Workspace,
    family::{
        channel::{Channel, ChannelFit, ChannelForm},
        channel_criterion::{ChannelInForm, ChannelLineFitter, ChannelMinimum, own_coordinates},
        prediction::{NoiseOrders, PredictionProblem},
        prediction_fit::PredictionFit,
    },
};

/// Significance level of the test: the probability of reporting a response that does not exist.
pub(in crate::family) const SIGNIFICANCE_LEVEL: f64 = 0.01;
/// Cost of each parameter of a form, in units of chi^2.
const COST_PER_PARAMETER: f64 = 4.0;

/// Returns an upper bound on the probability that the best of `forms` forms, each with `more` additional parameters,
/// reaches at least this likelihood ratio if there is no response.
fn chance_probability(ratio: f64, more: usize, forms: usize) -> f64 {
    let chance = ChiSquared::new(more as f64).map_or(1.0, |chi| chi.sf(ratio.max(0.0)));
    (chance * forms as f64).min(1.0)
}

/// Result of the selection of forms at the lines.
pub(in crate::family) struct LineSelection<'a> {
    /// Comparison of the forms for each input.
    pub fits: Vec<ChannelFit>,
    /// Inputs with a response, with starting values for the prediction error search.
    pub channels: Vec<Channel<'a>>,
    /// The same inputs, in the representation that fits at the lines require.
    pub in_form: Vec<ChannelInForm>,
}

impl FurtherInputs<'_> {
    /// Selects the form of each channel at the lines. Each candidate is fitted with every form in `operators` as the
    /// form of the operator, and the best of these fits counts. Returns the comparison, and the channels with a
    /// response in the selected forms.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] if no form of a channel could be fitted.
    pub fn choose_at_lines<'a>(
        &self,
        at: &ChannelLineFitter<'_>,
        operators: &[Form],
        begun: Vec<Vec<Channel<'a>>>,
    ) -> Result<LineSelection<'a>, IdentError> {
        let best_of = |channels: &[ChannelInForm]| {
            let fits = operators
                .iter()
                .filter_map(|&form| Some((form, at.fit(form, channels)?)));
            fits.min_by(|a, b| a.1.criterion().total_cmp(&b.1.criterion()))
        };
        let mut in_use: Vec<ChannelInForm> = (begun.iter().enumerate())
            .filter_map(|(k, forms)| Some(self.channel_in_form(k, forms.first()?.form, at.sampling)))
            .collect();
        let mut compared = Vec::with_capacity(begun.len());
        let mut best = None;
        for (k, asked) in self.all.iter().enumerate() {
            let others: Vec<ChannelInForm> = in_use.iter().filter(|c| c.index != k).copied().collect();
            let with = |form: Form| {
                let mut all = others.clone();
                all.push(self.channel_in_form(k, form, at.sampling));
                all.sort_by_key(|channel| channel.index);
                all
            };
            let without = best_of(&others);
            let fits: Vec<(Form, Option<(Form, ChannelMinimum)>)> =
                begun[k].iter().map(|c| (c.form, best_of(&with(c.form)))).collect();
            let found = fits.iter().filter_map(|(form, fit)| Some((*form, fit.as_ref()?)));
            // With this cost a parameter without effect is included in fewer than one in twenty records.
            let excess =
                (fits.iter().filter_map(|(_, fit)| Some(fit.as_ref()?.1.excess()))).fold(f64::INFINITY, f64::min);
            let cost =
                |fit: &ChannelMinimum| fit.chi_squared / excess + COST_PER_PARAMETER * fit.coordinates.len() as f64;
            let found = found.min_by(|a, b| cost(&a.1.1).total_cmp(&cost(&b.1.1)));
            let (form, fit) = found.ok_or(IdentError::NoFiniteLoss)?;
            let p_value = without.as_ref().map_or(0.0, |(_, without)| {
                let ratio = (without.chi_squared - fit.1.chi_squared) / fit.1.excess();
                let more = fit.1.coordinates.len().saturating_sub(without.coordinates.len()).max(1);
                chance_probability(ratio, more, fits.len())
            });
            let least = (without.iter().chain([fit]))
                .map(|(_, fit)| fit.criterion())
                .fold(f64::INFINITY, f64::min);
            let row = |form: Option<Form>, fit: Option<&(Form, ChannelMinimum)>| ChannelForm {
                form,
                loss: None,
                criterion: fit.map(|(_, fit)| fit.criterion() - least),
            };
            let mut rows = vec![row(None, without.as_ref())];
            rows.extend(fits.iter().map(|(form, fit)| row(Some(*form), fit.as_ref())));
            compared.push(ChannelFit::from_comparison(asked, rows, p_value));
            if p_value < SIGNIFICANCE_LEVEL || asked.forms.len() == 1 {
                in_use = with(form);
                best = Some(fit.1.clone());
            } else {
                in_use = others;
                best = without.map(|(_, fit)| fit);
            }
        }
        let mut start = best.map(|fit| fit.coordinates).unwrap_or_default();
        let own = |channel: &ChannelInForm| own_coordinates(channel.form, at.neuromuscular).len();
        let of_channels: usize = in_use.iter().map(own).sum();
        start.drain(..start.len().saturating_sub(of_channels));
        let mut channels = Vec::with_capacity(in_use.len());
        for channel in &in_use {
            let begun = begun[channel.index].iter().find(|c| c.form == channel.form);
            let begun = begun.ok_or(IdentError::NoFiniteLoss)?;
            let rest = start.split_off(own(channel).min(start.len()));
            channels.push(Channel {
                start: std::mem::replace(&mut start, rest),
                ..begun.clone()
            });
        }
        Ok(LineSelection {
            fits: compared,
            channels,
            in_form: in_use,
        })
    }

    /// Selects the form of each channel by prediction error, with the given form of the operator and its starting
    /// coordinates. Only channels with a response remain in the prediction. Returns the comparison.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] if no form of a channel could be fitted.
    pub fn choose<'a>(
        &self,
        prediction: &mut PredictionProblem<'a>,
        begun: Vec<Vec<Channel<'a>>>,
        (form, starts): ((Form, bool), &[Vec<f64>]),
        noise: NoiseOrders,
        workspace: &mut Workspace,
    ) -> Result<Vec<ChannelFit>, IdentError> {
        let mut compared = Vec::with_capacity(begun.len());
        for (k, forms) in begun.into_iter().enumerate() {
            let asked = &self.all[k];
            let others: Vec<Channel<'a>> = prediction.channels.iter().filter(|c| c.index != k).cloned().collect();
            let mut best_of = |channel: Option<&Channel<'a>>| -> Option<PredictionFit<'a>> {
                let tried = PredictionProblem {
                    channels: others.iter().chain(channel).cloned().collect(),
                    ..prediction.clone()
                };
                let fits = starts
                    .iter()
                    .filter_map(|start| tried.fit(form, noise, start, workspace).ok());
                fits.min_by(|a, b| a.objective().total_cmp(&b.objective()))
            };
            let without = best_of(None);
            let fits: Vec<(Channel<'a>, Option<PredictionFit<'a>>)> = (forms.into_iter())
                .map(|channel| {
                    let fit = best_of(Some(&channel));
                    (channel, fit)
                })
                .collect();
            let inflation = fits.iter().filter_map(|(_, fit)| Some(fit.as_ref()?.inflation));
            let inflation = inflation.fold(f64::NAN, f64::min);
            let value = |fit: &PredictionFit<'a>| {
                fit.residuals as f64 * fit.loss.ln() / inflation + 2.0 * fit.parameter_count() as f64
            };
            let cost = |fit: &PredictionFit<'a>| value(fit) + (COST_PER_PARAMETER - 2.0) * fit.parameter_count() as f64;
            let best = (fits.iter())
                .filter_map(|(channel, fit)| Some((channel, fit.as_ref()?)))
                .min_by(|a, b| cost(a.1).total_cmp(&cost(b.1)));
            let (best, fit) = best.ok_or(IdentError::NoFiniteLoss)?;
            let p_value = without.as_ref().map_or(0.0, |without| {
                let ratio = fit.residuals as f64 * (without.loss / fit.loss).ln() / inflation;
                let more = fit.parameter_count().saturating_sub(without.parameter_count()).max(1);
                chance_probability(ratio, more, fits.len())
            });
            let least = std::iter::once(value(fit))
                .chain(without.as_ref().map(value))
                .fold(f64::INFINITY, f64::min);
            let row = |form: Option<Form>, fit: Option<&PredictionFit<'a>>| ChannelForm {
                form,
                loss: fit.map(|fit| fit.loss),
                criterion: fit.map(|fit| value(fit) - least),
            };
            let mut rows = vec![row(None, without.as_ref())];
            rows.extend(fits.iter().map(|(channel, fit)| row(Some(channel.form), fit.as_ref())));
            compared.push(ChannelFit::from_comparison(asked, rows, p_value));
            let has_response = p_value < SIGNIFICANCE_LEVEL || asked.forms.len() == 1;
            let chosen = has_response.then(|| {
                let own = &fit.layout().channels[others.len()];
                Channel {
                    start: fit.eta()[own.place..own.place + own.limits.len()].to_vec(),
                    ..best.clone()
                }
            });
            prediction.channels = others.into_iter().chain(chosen).collect();
            prediction.channels.sort_by_key(|channel| channel.index);
        }
        Ok(compared)
    }
}
