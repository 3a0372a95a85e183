//! A trace as named columns, for files and other programs.

use hoid_model::{
    NotConvertible,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::{FurtherOperator, OPERATOR_COLUMNS, OpenLoop, Response, Trace};

/// Named columns of equal length.
pub type Columns = Vec<(String, Vec<f64>)>;

impl Trace {
    /// Returns the operator of every row, or the reason why there is none.
    pub fn operators(&self) -> Vec<Result<OperatorEstimate, NotConvertible>> {
        (0..self.len()).map(|row| self.operator(row)).collect()
    }

    /// Returns the names of the operator's columns: the columns of every trace, and `tau_e` if the delay is tracked.
    pub fn operator_columns(&self) -> Vec<&'static str> {
        let mut names = OPERATOR_COLUMNS.to_vec();
        let method = &self.options().method;
        if method.track_delay_s().is_some() || method.is_self_starting() {
            names.push("tau_e");
        }
        names
    }

    /// Returns `t`, each coefficient, each parameter of the operator, for methods that estimate them the parameters of
    /// the response to a further input r (`K_f[r]`, `K_f_dot[r]`, `tau_f[r]`), the gain in dB and the phase in degrees
    /// at the frequencies of the options (`gain_db@2.5`, `phase_deg@2.5`; for a further input r also `gain_db[r]@2.5`,
    /// `phase_deg[r]@2.5`), and with a controlled element `crossover_rad_s` and `phase_margin_deg`. Each of these
    /// columns except `t` is followed by its standard error (`_se`). NaN marks a missing operator, crossover or
    /// standard error. `operators` is the result of [`Trace::operators`].
    pub fn estimate_columns(&self, operators: &[Result<OperatorEstimate, NotConvertible>]) -> Columns {
        let mut columns: Columns = vec![("t".to_owned(), self.times_s().to_vec())];
        let mut add = |name: &str, estimates: &[Option<Estimate>]| {
            let value = |e: &Option<Estimate>| e.map_or(f64::NAN, |e| e.value);
            let error = |e: &Option<Estimate>| e.and_then(|e| e.standard_error).unwrap_or(f64::NAN);
            columns.push((name.to_owned(), estimates.iter().map(value).collect()));
            columns.push((format!("{name}_se"), estimates.iter().map(error).collect()));
        };
        let coefficients: Vec<Vec<Estimate>> = (0..self.len()).map(|row| self.parameters(row)).collect();
        for (i, name) in self.parameter_names().iter().enumerate() {
            let each: Vec<Option<Estimate>> = coefficients.iter().map(|c| Some(c[i])).collect();
            add(name, &each);
        }
        for name in self.operator_columns() {
            let each: Vec<Option<Estimate>> = operators.iter().map(|o| operator_parameter(o, name)).collect();
            add(name, &each);
        }
        if let Some(further) = self
            .options()
            .further
            .as_ref()
            .filter(|_| !self.further_operator.is_empty())
        {
            let found: Vec<_> = (0..self.len()).map(|row| self.further_operator(row)).collect();
            for (i, name) in FurtherOperator::NAMES.iter().enumerate() {
                let each: Vec<Option<Estimate>> = found
                    .iter()
                    .map(|found| Some(found.as_ref()?.parameters()[i]))
                    .collect();
                add(&format!("{name}[{}]", further.channel), &each);
            }
        }
        for (place, omega) in self.options().at_rad_s.iter().enumerate() {
            let responses: Vec<_> = (0..self.len()).map(|row| self.response(row, place)).collect();
            let each = |of: fn(&Response) -> Estimate| -> Vec<Option<Estimate>> {
                responses.iter().map(|response| response.as_ref().map(of)).collect()
            };
            add(&format!("gain_db@{omega}"), &each(Response::gain_db));
            add(&format!("phase_deg@{omega}"), &each(Response::phase_deg));
            if let Some(further) = &self.options().further {
                let channel = &further.channel;
                let responses: Vec<_> = (0..self.len()).map(|row| self.further_response(row, *omega)).collect();
                let each = |of: fn(&Response) -> Estimate| -> Vec<Option<Estimate>> {
                    responses.iter().map(|response| response.as_ref().map(of)).collect()
                };
                add(&format!("gain_db[{channel}]@{omega}"), &each(Response::gain_db));
                add(&format!("phase_deg[{channel}]@{omega}"), &each(Response::phase_deg));
            }
        }
        if self.options().controlled_element.is_some() {
            let loops: Vec<Option<OpenLoop>> = (0..self.len()).map(|row| self.open_loop(row)?.ok()).collect();
            let each = |of: fn(&OpenLoop) -> Estimate| -> Vec<Option<Estimate>> {
                loops.iter().map(|found| found.as_ref().map(of)).collect()
            };
            add("crossover_rad_s", &each(|found| found.crossover_rad_s));
            add("phase_margin_deg", &each(|found| found.phase_margin_deg));
        }
        columns
    }
}

/// Returns a parameter of an operator by its name; `None` if there is no operator or no parameter of this name.
pub fn operator_parameter(operator: &Result<OperatorEstimate, NotConvertible>, name: &str) -> Option<Estimate> {
    let rows = operator.as_ref().ok()?.rows();
    rows.into_iter().find(|(n, _, _)| *n == name).map(|(_, _, e)| e)
}
