//! The response of a person to a further input ([`hoid_ident::family::SeenChannel`]), and its columns in the table
//! `people`.
//!
//! The names of the columns start with the name of the input: `r_role`, `r_preview_s`, `r_form` (empty if no response
//! was found), `r_p_value`, and the columns of the parameters ([`super::parameter_columns`]), such as `r_tau_f`.

use hoid_ident::family::{ChannelFit, ChannelRole, Parameter, SeenChannel};
use hoid_io::OutputTable;
use hoid_model::{Form, operator_family::PARAMETERS};

use super::{
    parameter_columns,
    tables::{numbers, texts},
};
use crate::columns::Rows;

/// Suffix of the column by which a further input is recognised.
const ROLE_SUFFIX: &str = "_role";
/// The delay of a response to a further input.
const DELAY_PARAMETER: (&str, &str) = ("tau_f", "s");

/// Returns the names and units of the parameters of a response to a further input.
fn parameters() -> impl Iterator<Item = (&'static str, &'static str)> {
    PARAMETERS.into_iter().chain([DELAY_PARAMETER])
}

/// The response of a person to a further input.
#[derive(Debug, Clone, PartialEq)]
pub struct PersonChannel {
    /// Name of the input.
    pub name: String,
    /// Role of the input for the person.
    pub role: ChannelRole,
    /// Preview time, s.
    pub preview_s: f64,
    /// p-value of the improvement of the fit by this response.
    pub p_value: f64,
    /// Form of the response; `None` if no response was found.
    pub form: Option<Form>,
    /// Parameters of the response.
    pub parameters: Vec<Parameter>,
}

impl PersonChannel {
    /// Creates the response from its part of the joint fit to all runs.
    pub(super) fn of(fit: &ChannelFit) -> Self {
        let response = fit.response.as_ref();
        Self {
            name: fit.name.clone(),
            role: fit.role,
            preview_s: fit.preview_s,
            p_value: fit.p_value,
            form: response.map(|of| of.operator.form()),
            parameters: response.map_or_else(Vec::new, |of| of.parameters.clone()),
        }
    }

    /// Returns a parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// Returns the input for the fit of a single run, in the form found for the person; `None` if no response was
    /// found.
    pub(super) fn single_run_channel(&self) -> Option<SeenChannel> {
        Some(SeenChannel {
            preview_s: self.preview_s,
            forms: vec![self.form?],
            ..SeenChannel::new(self.name.clone(), self.role)
        })
    }

    pub(super) fn write(&self, rows: &mut Rows) {
        let column = |end: &str| format!("{}_{end}", self.name);
        rows.set_text(&format!("{}{ROLE_SUFFIX}", self.name), self.role.name());
        rows.set_text(&column("form"), self.form.map_or("", Form::name));
        rows.set_real(&column("preview_s"), self.preview_s);
        rows.set_real(&column("p_value"), self.p_value);
        for p in &self.parameters {
            parameter_columns::write(rows, &column(&p.name), p);
        }
    }

    /// Reads the responses to all further inputs from a row of the table.
    pub(super) fn read(table: &OutputTable, row: usize) -> Vec<Self> {
        let names = (table.columns.iter()).filter_map(|column| column.name.strip_suffix(ROLE_SUFFIX));
        let of = |name: &str| {
            let text = |end: &str| texts(table, &format!("{name}{end}")).get(row).cloned();
            let number = |end: &str| numbers(table, &format!("{name}{end}")).get(row).copied();
            Some(Self {
                name: name.to_owned(),
                role: text(ROLE_SUFFIX)?.parse().ok()?,
                preview_s: number("_preview_s").unwrap_or(0.0),
                p_value: number("_p_value").unwrap_or(f64::NAN),
                form: text("_form").and_then(|form| form.parse().ok()),
                parameters: parameters()
                    .filter_map(|parameter| parameter_columns::read(table, row, &format!("{name}_"), parameter))
                    .collect(),
            })
        };
        names.filter_map(of).collect()
    }
}

/// Returns the names of the text columns and of the numeric columns for the further inputs of all people.
pub(super) fn columns<'a>(channels: impl Iterator<Item = &'a PersonChannel> + Clone) -> (Vec<String>, Vec<String>) {
    let (mut of_text, mut real): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    let mut names: Vec<&str> = Vec::new();
    for channel in channels.clone() {
        if !names.contains(&channel.name.as_str()) {
            names.push(&channel.name);
        }
    }
    for name in names {
        of_text.extend([format!("{name}{ROLE_SUFFIX}"), format!("{name}_form")]);
        real.extend([format!("{name}_preview_s"), format!("{name}_p_value")]);
        let own = channels.clone().filter(|channel| channel.name == name);
        for (parameter, _) in parameters() {
            if own.clone().any(|channel| channel.parameter(parameter).is_some()) {
                let column = format!("{name}_{parameter}");
                real.extend(parameter_columns::numeric_column_names(&column));
                of_text.push(parameter_columns::text_column_name(&column));
            }
        }
    }
    (of_text, real)
}
