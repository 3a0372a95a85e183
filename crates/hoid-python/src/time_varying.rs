//! The fit of an operator whose gains change once.

use hoid_analysis::IdentifiedModel;
use hoid_ident::{ChangedOperator, InstantGains, SigmoidFit, validation::whiteness};
use numpy::{PyArray1, PyArray2};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, ChannelSelection, array, matrix},
    errors::Outcome,
    faults::{UsedRecord, faults_of, used_records},
    figures::{self, ValueWithError, error_or_nan, value_and_error},
};

/// Fit of an operator whose gains change once; the package wraps it in `pyhoid.TimeVaryingFit`.
#[pyclass(name = "TimeVaryingFit", module = "pyhoid._pyhoid", frozen)]
pub struct PyTimeVaryingFit(pub IdentifiedModel<SigmoidFit>);

/// Returns the operator before or after the change. A gain with a lead is returned as for any fit; any other form is
/// returned with its name and each parameter by name. Operators of the family are stable because of the bounds of their
/// parameters.
fn operator<'py>(py: Python<'py>, of: &ChangedOperator) -> PyResult<Option<Bound<'py, PyDict>>> {
    if let Some(lead) = of.operator_estimate() {
        return figures::operator(py, &Ok(lead));
    }
    let all = PyDict::new(py);
    all.set_item("convertible", true)?;
    all.set_item("stable", true)?;
    all.set_item("form", of.operator.form().name())?;
    for p in &of.parameters {
        all.set_item(p.name, value_and_error(p.estimate))?;
    }
    Ok(Some(all))
}

#[pymethods]
impl PyTimeVaryingFit {
    /// Returns the settings: name, value, and whether the user gave it.
    #[getter]
    fn settings(&self) -> Vec<(String, String, bool)> {
        figures::settings(&self.0.settings)
    }

    /// Returns the result as JSON, from which it can be restored.
    fn to_json(&self) -> Outcome<String> {
        Ok(self.0.to_json()?)
    }

    #[getter]
    fn form(&self) -> &'static str {
        self.0.fit.form().name()
    }

    /// Returns the name, the estimate, the unit and the remark for each parameter.
    #[getter]
    fn parameters(&self) -> Vec<(String, ValueWithError, &'static str, Option<String>)> {
        let one = |p: hoid_ident::ChangeParameter| {
            (
                p.name,
                value_and_error(p.estimate),
                p.unit,
                p.remark.map(|r| r.to_string()),
            )
        };
        self.0.fit.parameters().into_iter().map(one).collect()
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(c) = self.0.fit.covariance() else {
            return Ok(None);
        };
        let columns = (c.len() as f64).sqrt().round() as usize;
        matrix(py, c, columns).map(Some)
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (fit, all) = (&self.0.fit, PyDict::new(py));
        all.set_item("loss", fit.loss())?;
        all.set_item("innovation_variance", fit.innovation_variance())?;
        all.set_item("residuals", fit.residual_count())?;
        all.set_item("initial_states", fit.state_count())?;
        Ok(all)
    }

    #[getter]
    fn termination<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = figures::termination(py, self.0.fit.termination())?;
        all.set_item("start", self.0.fit.start())?;
        Ok(all)
    }

    /// Returns whether there is a change, the comparison with an operator that does not change, and the intervals of
    /// t_M and G.
    #[getter]
    fn change<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (c, all) = (self.0.fit.comparison(), PyDict::new(py));
        all.set_item("found", self.0.fit.has_change())?;
        all.set_item("likelihood_ratio", c.likelihood_ratio)?;
        all.set_item("extra_parameters", c.extra_parameters)?;
        all.set_item("bic_difference", c.bic_difference)?;
        all.set_item("t_M_interval", self.0.fit.midpoint_interval())?;
        all.set_item("G_interval", self.0.fit.rate_interval())?;
        Ok(all)
    }

    /// Returns the constant level of u in each record; `None` for a record in which it was not estimated.
    #[getter]
    fn levels(&self) -> Vec<Option<ValueWithError>> {
        self.0
            .data
            .accounts
            .iter()
            .map(|account| account.level.map(value_and_error))
            .collect()
    }

    /// Returns the records that were fitted: for each, the index of the given record from which it comes, the record,
    /// and the steps applied to it.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<UsedRecord<'py>>> {
        used_records(py, &self.0.data)
    }

    /// Returns the faults, each with the index of the given record in which it was found.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<(usize, Bound<'py, PyDict>)>> {
        faults_of(py, &self.0.data)
    }

    #[getter]
    fn initial<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        operator(py, self.0.fit.initial_operator())
    }

    #[getter]
    fn last<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        operator(py, self.0.fit.last_operator())
    }

    /// Returns `t` and the parameters that change (for a gain with a lead: K_e, T_L and K_e_dot) at these times, each
    /// with its standard error.
    fn gains<'py>(&self, py: Python<'py>, times: Vec<f64>) -> PyResult<Bound<'py, PyDict>> {
        let gains: Vec<InstantGains> = times.iter().map(|t| self.0.fit.gains_at(*t)).collect();
        let all = PyDict::new(py);
        all.set_item("t", array(py, times))?;
        // The names are defined even if no times are given.
        for (i, of) in self.0.fit.gains_at(0.0).gains.iter().enumerate() {
            all.set_item(
                of.name,
                array(py, gains.iter().map(|g| g.gains[i].estimate.value).collect()),
            )?;
            let errors = gains.iter().map(|g| error_or_nan(g.gains[i].estimate)).collect();
            all.set_item(format!("{}_se", of.name), array(py, errors))?;
        }
        Ok(all)
    }

    fn residuals<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
    ) -> Outcome<(usize, Bound<'py, PyArray1<f64>>)> {
        let record = arrays::record(record, ChannelSelection::Only(&[]))?;
        let found = py.detach(|| self.0.fit.residuals(&record))?;
        Ok((found.first, array(py, found.values)))
    }

    fn simulate<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
    ) -> Outcome<(usize, Bound<'py, PyArray1<f64>>)> {
        let record = arrays::record(record, ChannelSelection::Only(&[]))?;
        let found = py.detach(|| self.0.fit.simulate(&record))?;
        Ok((found.first, array(py, found.values)))
    }

    #[getter]
    fn verdict(&self) -> String {
        figures::verdict(&self.0.verdict)
    }

    /// Tests the residuals of a record for whiteness.
    fn ljung_box<'py>(&self, py: Python<'py>, record: &Bound<'py, PyAny>) -> Outcome<Option<Bound<'py, PyDict>>> {
        let record = arrays::record(record, ChannelSelection::Only(&[]))?;
        let fit = &self.0.fit;
        let test = py.detach(|| {
            fit.residuals(&record)
                .map(|found| whiteness(&found.values, fit.d().len()))
        })?;
        Ok(figures::ljung_box(py, test.as_ref())?)
    }
}
