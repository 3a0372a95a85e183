//! One self-contained HTML page about the models fitted to one or several records.

use hoid_ident::{
    Choice,
    validation::{Correlation, GoodnessOfFit, Validation},
};
use hoid_model::Record;
use minijinja::{Value, context};

use crate::{
    FitSummary, ReportError, cells,
    figures::{self, BodeModel, TrueResponse},
    model_section::{ModelSection, known_operator},
    page, tables,
};

/// Maximum number of records of a model whose time response is drawn.
const MAX_TIME_RESPONSES: usize = 4;

/// Contents of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Report<'a> {
    /// Heading of the page.
    pub title: String,
    /// Inputs and processing, as pairs of name and value: command, versions, records, span, seed.
    pub settings: Vec<(String, String)>,
    /// The models, each in its own section.
    pub models: Vec<ModelSection<'a>>,
    /// Remarks for the reader, such as warnings of the command.
    pub notes: Vec<String>,
    /// Summary of the fit at the top of the page.
    pub fit_summary: Option<FitSummary>,
    /// Figures of the main result, placed before all other figures.
    pub pictures: Vec<Picture>,
}

/// A figure with its caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// The figure as SVG text.
    pub svg: String,
    /// Caption of the figure.
    pub caption: String,
}

impl<'a> Report<'a> {
    /// Creates a report about a fit to records, with the search that selected the orders.
    pub fn of(title: &str, records: &'a [Record], choice: &'a Choice) -> Self {
        Self {
            title: title.to_owned(),
            settings: vec![(
                "records".to_owned(),
                records.iter().map(Record::label).collect::<Vec<_>>().join(", "),
            )],
            models: vec![ModelSection {
                name: choice.fit.title(),
                fit: &choice.fit,
                records,
                candidates: Some(choice),
                truth: known_operator(records),
                margins: None,
            }],
            notes: Vec::new(),
            fit_summary: None,
            pictures: Vec::new(),
        }
    }
}

impl Report<'_> {
    /// Returns the page as HTML text, which contains all styles and figures. Equal data give identical bytes.
    ///
    /// # Errors
    /// [`ReportError::NoModels`]; [`ReportError::Template`] if a template cannot be rendered, which is a defect of this
    /// crate.
    pub fn to_html(&self) -> Result<String, ReportError> {
        if self.models.is_empty() {
            return Err(ReportError::NoModels);
        }
        let validations: Vec<Vec<Result<Validation, String>>> =
            self.models.iter().map(ModelSection::validate).collect();
        let qualities: Vec<Result<GoodnessOfFit, String>> = self
            .models
            .iter()
            .zip(&validations)
            .map(|(model, validations)| model.quality(validations))
            .collect();
        let sections: Vec<Value> = self
            .models
            .iter()
            .zip(&validations)
            .enumerate()
            .map(|(i, (model, validations))| section(i, model, validations))
            .collect();
        let values = context! {
            title => self.title.clone(),
            settings => page::settings_rows(&self.settings),
            notes => self.notes.clone(),
            answer => self.fit_summary.as_ref().map(FitSummary::to_value),
            pictures => self.pictures.iter().map(Picture::to_value).collect::<Vec<Value>>(),
            comparison => tables::comparison(&self.models, &qualities),
            bode => Value::from_safe_string(self.bode()),
            models => sections,
        };
        page::render("report.html", values)
    }

    fn bode(&self) -> String {
        let models: Vec<BodeModel<'_>> = self
            .models
            .iter()
            .map(|m| BodeModel {
                name: &m.name,
                fit: m.fit,
                records: m.records,
            })
            .collect();
        let mut truths: Vec<TrueResponse> = Vec::new();
        for model in &self.models {
            if let Some(operator) = model.truth {
                let truth = TrueResponse {
                    operator,
                    sample_time: model.fit.model().sample_time(),
                };
                if !truths.contains(&truth) {
                    truths.push(truth);
                }
            }
        }
        figures::bode("bode", &models, &truths)
    }
}

impl Picture {
    fn to_value(&self) -> Value {
        context! { svg => Value::from_safe_string(self.svg.clone()), caption => self.caption.clone() }
    }
}

fn section(index: usize, model: &ModelSection<'_>, validations: &[Result<Validation, String>]) -> Value {
    let fit = model.fit;
    let drawn: Vec<Value> = model
        .records
        .iter()
        .zip(validations)
        .enumerate()
        .filter_map(|(k, (record, validation))| Some((k, record, validation.as_ref().ok()?)))
        .take(MAX_TIME_RESPONSES)
        .map(|(k, record, validation)| {
            let svg = figures::time_response(&format!("m{index}-time{k}"), record, validation);
            context! { svg => Value::from_safe_string(svg), record => cells::record_name(record, k), close_up => figures::has_close_up(record) }
        })
        .collect();
    let tested = model
        .records
        .iter()
        .zip(validations)
        .enumerate()
        .find_map(|(k, (r, v))| v.as_ref().ok().map(|v| (k, r, v)));
    let tests = match tested {
        Some((k, record, validation)) => residual_tests(index, &cells::record_name(record, k), record, validation),
        None => {
            let reason = model.quality(validations).err().unwrap_or_default();
            context! { reason }
        }
    };
    context! {
        name => model.name.clone(),
        anchor => format!("model-{index}"),
        converged => fit.termination().converged(),
        stable => fit.model().is_stable(),
        exact => fit.covariance().is_none(),
        grey_box => fit.is_grey_box(),
        coefficients => tables::coefficients(fit),
        operator => tables::operator(fit, model.truth.as_ref(), &tables::gain_unit(model.records)),
        remnant => tables::remnant(fit),
        no_remnant => tables::missing_remnant_reason(fit),
        course => tables::computation_rows(fit, model.records),
        margins => model.margins.as_ref().map(tables::margins),
        several => model.records.len() > 1,
        qualities => tables::quality_rows(model.records, validations),
        not_drawn => validations.iter().filter(|v| v.is_ok()).count() - drawn.len(),
        responses => drawn,
        tests,
        candidates => model.candidates.map(tables::candidates),
    }
}

fn residual_tests(index: usize, name: &str, record: &Record, validation: &Validation) -> Value {
    let sample_time = record.sample_time();
    let (own, cross) = (&validation.autocorrelation, &validation.cross_correlation);
    let own_svg = (!own.lags.is_empty())
        .then(|| figures::autocorrelation(&format!("m{index}-auto"), own, sample_time))
        .map(Value::from_safe_string);
    let cross_svg = (cross.lags.len() > 1)
        .then(|| figures::cross_correlation(&format!("m{index}-cross"), cross, sample_time))
        .map(Value::from_safe_string);
    context! {
        record => name,
        autocorrelation => own_svg,
        outside_auto => count_outside_bounds(own, |_| true),
        lags_auto => own.lags.len(),
        cross_correlation => cross_svg,
        outside_positive => count_outside_bounds(cross, |k| k >= 0),
        lags_positive => cross.lags.iter().filter(|k| **k >= 0).count(),
        outside_negative => count_outside_bounds(cross, |k| k < 0),
        lags_negative => cross.lags.iter().filter(|k| **k < 0).count(),
    }
}

/// Number of values outside the bounds at the selected lags.
fn count_outside_bounds(correlation: &Correlation, of: impl Fn(i64) -> bool) -> usize {
    let pairs = correlation.lags.iter().zip(&correlation.values);
    pairs.filter(|(k, v)| of(**k) && v.abs() > correlation.bound_99).count()
}
