//! Operator of a person, whose form the evidence determines. The fit also uses the lines of a recorded excitation, and
//! the verdict includes the loop.

use hoid_ident::{
    SearchOptions,
    diagnostics::{other_inputs, second_opinion},
    family::{FamilyEstimator, FamilyFit, Intersample},
    settings::MethodSpec,
};
use hoid_model::{Detrend, FaultHandling, Structure, Verdict};

use super::{BatchEstimator, FittedModel, registry_settings};
use crate::{
    AnalysisError,
    description::line_describing_function,
    identification::Identification,
    level::write_levels,
    names::OPERATOR,
    options::{self, AnalysisOption},
    recordings::Recordings,
    settings::Setting,
};

impl BatchEstimator for FamilyEstimator {
    type Fit = FamilyFit;

    fn specs() -> Vec<MethodSpec> {
        vec![MethodSpec {
            name: OPERATOR,
            help: "the operator of a person: form, parameters with a prior, standard errors from the scatter between runs, and a verdict",
            source: "McRuer and Jex 1967; the thesis, equation 2.2",
            structures: &[Structure::BoxJenkins],
            settings: registry_settings(Self::options_of_analysis()),
        }]
    }

    fn options_of_analysis() -> Vec<AnalysisOption<Self>> {
        let mut all = options::with_prior_of_fits(options::estimator_options(), |how: &mut Self| &mut how.prior);
        all.extend(options::excitation_options());
        all.extend([options::controlled_element_option(), options::answers_option()]);
        all
    }

    fn further_inputs(&self) -> Vec<&str> {
        self.channels.iter().map(|channel| channel.name.as_str()).collect()
    }

    /// With a first-order hold between recorded samples the sampling rate must be kept.
    fn counts_samples(&self) -> bool {
        self.intersample == Intersample::Foh
    }

    fn search(&self) -> &SearchOptions {
        &self.search
    }

    fn initial_state(&self) -> &'static str {
        self.initial_state.name()
    }

    fn with_defaults(&self) -> Self {
        Self::default()
    }

    fn fixed_setting(&self) -> Option<Setting> {
        Some(Setting::new("removed from e and u", self.detrend.to_string()))
    }

    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<FittedModel<FamilyFit>, AnalysisError> {
        // At a line of the excitation, several inputs contribute to the single ratio of u to e.
        let alone = with.estimator.channels.is_empty();
        let described = match alone {
            true => data.describe(&with.excitation, with.period_s, with.faults),
            false => Ok(None),
        };
        let channel = match &described {
            // Instruments do not require lines, so a channel named by the user is used even without lines.
            Ok(Some(found)) => found.channel.clone(),
            _ => with.excitation.channel_name().filter(|_| alone).map(str::to_owned),
        };
        let estimator = Self {
            excitation: channel,
            period_s: with.period_s,
            // If detrending was requested, it has been applied in reading.
            detrend: if data.were_detrended() {
                Detrend::None
            } else {
                with.estimator.detrend
            },
            ..with.estimator.clone()
        };
        let lines = line_describing_function(&described, &with.excitation, with.period_s);
        let mut fit = estimator.fit_with_response(&data.records, lines)?;
        fit.lead_s = data.input_lead_s();
        let element = with.controlled_element.as_ref();
        let mut verdict = fit.verdict.clone();
        if with.faults != FaultHandling::Keep {
            verdict = verdict.append(second_opinion::family_findings(
                &estimator,
                &fit,
                &data.records,
                element,
            ));
            verdict = verdict.append(other_inputs::family_findings(&estimator, &fit, &data.records));
        }
        if let Some(element) = element {
            verdict = verdict.append(fit.loop_finding(0, element));
        }
        let described = described.ok().flatten();
        let channel = described.as_ref().and_then(|d| d.channel.clone());
        let is_named = with.excitation.channel_name().is_some();
        let found = channel.map(|channel| Setting::new("excitation", channel).with_given(is_named));
        let asked = Identification {
            estimator,
            ..with.clone()
        };
        let used = asked.settings(fit.sample_time);
        let estimator = asked.estimator;
        if estimator.detrend == Detrend::Mean {
            write_levels(&mut data.accounts, &data.records, |k, record| {
                fit.operator(k).polynomial_fit.level(record)
            });
        }
        for record in &mut data.records {
            let of_error = match alone {
                true => record.clone(),
                false => fit.without_channels(record, estimator.detrend)?,
            };
            *record = of_error.detrended(estimator.detrend);
        }
        Ok(FittedModel {
            fit,
            verdict,
            described,
            removed_trend: estimator.detrend,
            settings: used,
            found: found.into_iter().collect(),
        })
    }

    fn set_verdict(fit: &mut FamilyFit, verdict: &Verdict) {
        fit.verdict = verdict.clone();
    }
}
