//! The page and the figure of the operator of a person, for `hoid identify` and Python.

use hoid_analysis::IdentifiedModel;
use hoid_ident::{
    MarginEstimates,
    family::{FamilyFit, Parameter},
    frequency::Description,
};
use hoid_model::{Complex64, ContinuousTransferFunction, FamilyOperator, GainUnit, uncertainty::Estimate};

use crate::{
    FitSummary, ModelSection, ParameterRow, Picture, Report,
    figures::{ModelCurve, describing, log_spaced, responses},
    model_figure, sentence, settings_pairs,
};

impl<'a> Report<'a> {
    /// Creates the page about the operator of a person.
    pub fn from_operator_fit(found: &'a IdentifiedModel) -> Self {
        let fit = &found.fit;
        let element = found.controlled_element.as_ref();
        Self {
            models: vec![ModelSection {
                name: fit.title(),
                fit: &fit.operator(0).polynomial_fit,
                records: &found.data.records,
                candidates: None,
                truth: None,
                margins: element.and_then(|element| margins(fit, element)),
            }],
            fit_summary: Some(operator_summary(found)),
            pictures: (found.described.as_ref())
                .map(|described| describing_function_picture(fit, described))
                .into_iter()
                .chain(responses_figure(found).map(|svg| Picture {
                    svg,
                    caption: "The responses of u to each input, held over a sample, with their 95 % bands.".to_owned(),
                }))
                .collect(),
            ..Self::from_identified(found)
        }
    }

    /// Creates a page with the heading and the settings of any result, without models.
    pub fn from_identified<F>(found: &IdentifiedModel<F>) -> Self {
        let data = &found.data;
        Self {
            title: match data.records.as_slice() {
                [only] => format!("Identification of {}", only.label()),
                all => format!("Identification of {} records", all.len()),
            },
            settings: settings_pairs(&data.names, &found.settings, &data.accounts),
            models: Vec::new(),
            notes: Vec::new(),
            fit_summary: None,
            pictures: Vec::new(),
        }
    }
}

/// Draws the figure of an operator. With several inputs the figure shows the response to each input. With a single
/// input it shows the operator with the describing function of the records, or the frequency response with its bands if
/// the records have no periodic excitation.
pub fn operator_figure(found: &IdentifiedModel) -> String {
    match (&found.described, responses_figure(found)) {
        (_, Some(all)) => all,
        (Some(described), None) => draw_operator(&found.fit, described),
        (None, None) => model_figure(&found.fit.operator(0).polynomial_fit, &found.data.records, None),
    }
}

/// The identified operator as a sentence.
pub fn operator_sentence(found: &IdentifiedModel) -> Option<String> {
    let known = found.fit.operator(0).parameters.iter().filter(|p| p.determined);
    let element = found.controlled_element.as_ref();
    let here = element.and_then(|element| found.fit.loop_measures(0, element));
    sentence(
        known.map(|p| (p.name.as_str(), p.value)),
        here.as_ref().map(|m| m.crossover_rad_s),
        here.as_ref().map(|m| m.phase_margin_deg),
    )
}

/// Remark for a parameter that the data do not determine; empty for a parameter that they determine.
pub fn undetermined_remark(p: &Parameter) -> &'static str {
    match (p.determined, p.prior_share > 0.5) {
        (true, _) => "",
        (false, true) => "the prior alone",
        (false, false) => "not determined",
    }
}

/// Remark on a parameter: whether the data determine it, and the share of the prior.
fn remark(p: &Parameter) -> String {
    let words = undetermined_remark(p);
    match (words, p.prior_share > 0.01) {
        (_, false) => words.to_owned(),
        ("", true) => format!("{:.0} % from the prior", 100.0 * p.prior_share),
        (_, true) => format!("{words}, {:.0} % from the prior", 100.0 * p.prior_share),
    }
}

/// Creates the head of a page.
fn operator_summary(found: &IdentifiedModel) -> FitSummary {
    let gain = found.data.records.first().map(GainUnit::of).unwrap_or_default();
    let row = |p: &Parameter| ParameterRow {
        name: p.name.clone(),
        unit: gain.unit(&p.name, p.unit),
        estimate: p.determined.then_some(Estimate {
            value: p.value,
            standard_error: p.standard_error,
        }),
        interval: p.interval,
        remark: remark(p),
    };
    let further = found.fit.channels.iter().flat_map(|channel| {
        let own = channel.response.iter().flat_map(|response| &response.parameters);
        own.map(|p| ParameterRow {
            name: format!("{}: {}", channel.name, p.name),
            ..row(p)
        })
    });
    FitSummary {
        verdict: found.fit.verdict.clone(),
        sentence: operator_sentence(found),
        parameters: found
            .fit
            .operator(0)
            .parameters
            .iter()
            .map(row)
            .chain(further)
            .collect(),
    }
}

/// The crossover and the margins in the form that all reports use.
fn margins(fit: &FamilyFit, element: &ContinuousTransferFunction) -> Option<MarginEstimates> {
    let found = fit.loop_measures(0, element)?;
    let gain_margin = fit.loop_shape(0, element).gain_margin;
    Some(MarginEstimates {
        crossover_rad_s: Some(found.crossover_rad_s),
        phase_margin_deg: Some(found.phase_margin_deg),
        phase_crossover_rad_s: gain_margin.map(|(omega, _)| omega),
        gain_margin_db: gain_margin.map(|(_, db)| db),
    })
}

/// Frequency range of the responses to several inputs (rad/s), and the number of frequencies.
const CHANNEL_RANGE: (f64, f64) = (0.3, 16.0);
const CHANNEL_POINTS: usize = 120;

/// The figure of the responses to all inputs; `None` for a fit with a single input.
fn responses_figure(found: &IdentifiedModel) -> Option<String> {
    let fit = &found.fit;
    let (low, high) = CHANNEL_RANGE;
    let high = high.min(0.9 * std::f64::consts::PI / fit.sample_time.s());
    let omega = log_spaced((low, high), CHANNEL_POINTS);
    let further: Vec<ModelCurve> = (fit.channels.iter())
        .filter_map(|channel| {
            let delay_s = channel.response.as_ref()?.operator.tau_e_s() - channel.preview_s;
            let points = channel.frequency_response(&omega, (fit.sample_time, fit.intersample))?;
            let name = format!("to {} ({})", channel.name, channel.role);
            Some(ModelCurve::of_points(&name, delay_s, &points))
        })
        .collect();
    if further.is_empty() {
        return None;
    }
    let error = found.data.records.first()?.input_channel()?;
    let feedback = ModelCurve::of_points(
        &format!("to {} (feedback)", error.name),
        fit.operator(0).operator.tau_e_s(),
        &fit.frequency_response(0, &omega),
    );
    let all: Vec<ModelCurve> = std::iter::once(feedback).chain(further).collect();
    Some(responses("inputs", "Responses to all inputs", &all))
}

/// Highest frequency shown in a figure with a neuromuscular peak, as a multiple of the natural frequency.
const PEAK_MARGIN_RATIO: f64 = 1.5;

/// Frequency up to which the curves extend in order to show the reported neuromuscular peak, even if all lines are
/// below it; 0 if no peak is reported.
fn max_omega_rad_s(fit: &FamilyFit) -> f64 {
    let all = &fit.operator(0).parameters;
    let peak = all.iter().find(|p| p.name == "omega_nm" && p.determined);
    let nyquist = std::f64::consts::PI / fit.sample_time.s();
    peak.map_or(0.0, |omega_nm| (PEAK_MARGIN_RATIO * omega_nm.value).min(0.9 * nyquist))
}

/// Curves of the fitted operator: by prediction error with its band, from the fit at the lines, and by instrumental
/// variables.
fn model_curves(fit: &FamilyFit, described: &Description) -> Vec<ModelCurve> {
    let half = 0.5 * fit.sample_time.s();
    let reach = max_omega_rad_s(fit);
    let curve = |name: &str, operator: &FamilyOperator| {
        let turn = |omega: f64| Complex64::from_polar(1.0, -omega * half);
        ModelCurve::over_frequencies(described, reach, name, operator.tau_e_s() + half, |omega| {
            operator.response(omega) * turn(omega)
        })
    };
    let delay_s = fit.operator(0).operator.tau_e_s() + half;
    let mut all = vec![ModelCurve::with_band(
        described,
        reach,
        "prediction error, band 95 %",
        delay_s,
        |omega| fit.frequency_response(0, omega),
    )];
    if let Some(lines) = &fit.lines {
        all.push(curve("fit at the lines", &lines.operator));
    }
    if let Some(instrumental) = fit.instrumental.as_ref().filter(|i| i.termination.converged()) {
        all.push(curve("RIV-BJ", &instrumental.operator));
    }
    all
}

fn describing_function_picture(fit: &FamilyFit, described: &Description) -> Picture {
    Picture {
        svg: draw_operator(fit, described),
        caption:
            "The describing function at the lines of the excitation, with 95 % intervals from its scatter, and the \
                  operator: by prediction error (the mean over the forms, with a 95 % band), by a fit of the best form \
                  at the lines, and by instrumental variables (RIV-BJ) if they converge."
                .to_owned(),
    }
}

/// Draws the operator with the describing function.
fn draw_operator(fit: &FamilyFit, described: &Description) -> String {
    let title = format!("{} through the describing function", fit.form);
    describing("describing", &title, described, &model_curves(fit, described))
}
