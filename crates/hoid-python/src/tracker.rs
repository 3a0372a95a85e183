//! `pyhoid.Tracker`: an online recursive estimate.

use hoid_ident::Choice;
use hoid_model::{Decimation, Orders, SampleTime};
use hoid_track::{Live, Sample, Stage, Tracker};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, ChannelSelection, array, matrix},
    errors::{Outcome, bad_option},
    figures, files,
    fit::PyFit,
    recursion,
};

/// The saved state of a tracker: its orders, and all changing values as numbers.
type SavedParts<'py> = (Option<Bound<'py, PyDict>>, Bound<'py, PyArray1<f64>>);

/// Crossover frequency and phase margin, or the reason why there are none.
type OpenLoopParts = (
    Option<(figures::ValueWithError, figures::ValueWithError)>,
    Option<&'static str>,
);

/// An online tracker; the package derives `pyhoid.Tracker` from it.
#[pyclass(name = "Tracker", module = "pyhoid._pyhoid", subclass)]
pub struct PyTracker {
    live: Live,
    choice: Option<Choice>,
}

impl PyTracker {
    fn tracker(&self) -> Outcome<&Tracker> {
        match self.live.stage() {
            Stage::Tracking(tracker) => Ok(tracker),
            Stage::Collecting(warm_up) => Err(bad_option(format!(
                "the tracker is warming up: it has {} of {} samples; check .ready first",
                warm_up.collected, warm_up.needed
            ))),
        }
    }

    fn take(&mut self, sample: Sample, update: bool) -> f64 {
        let taken = (self.live).update(sample, update, &|plan, record| plan.choose(record, &|| {}));
        if let Some((_, choice)) = taken.started {
            self.choice = choice;
        }
        taken.outcome.and_then(|o| o.innovation).unwrap_or(f64::NAN)
    }
}

#[pymethods]
impl PyTracker {
    #[new]
    #[pyo3(signature = (options, sample_time, warm_up, record))]
    fn new(
        py: Python<'_>,
        options: &Bound<'_, PyDict>,
        sample_time: f64,
        warm_up: f64,
        record: Option<Bound<'_, PyAny>>,
    ) -> Outcome<Self> {
        let sample_time = SampleTime::new(sample_time)?;
        let decimation = match options.get_item("decimate")? {
            Some(text) => files::decimation(&text.extract::<String>()?)?,
            None => Decimation::Off,
        };
        let asked = recursion::request(options)?;
        let mut live = Live::new(&asked, sample_time, decimation, warm_up)?;
        let mut choice = None;
        if let Some(record) = record {
            let record = arrays::record(&record, ChannelSelection::Only(&["f_t"]))?;
            choice = py.detach(|| live.start_from(record))?;
        }
        Ok(Self { live, choice })
    }

    /// Processes one sample and returns the innovation, which is NaN at a fault and during the warm-up.
    #[pyo3(signature = (e, u, f_t=None, update=true))]
    fn step(&mut self, py: Python<'_>, e: f64, u: f64, f_t: Option<f64>, update: bool) -> f64 {
        let sample = Sample { e, u, reference: f_t };
        match self.live.stage() {
            Stage::Tracking(_) => self.take(sample, update),
            // The last sample of the warm-up triggers the start fit, which takes long.
            Stage::Collecting(_) => py.detach(|| self.take(sample, update)),
        }
    }

    /// Processes the samples one after the other and returns their innovations.
    #[pyo3(signature = (e, u, f_t, update))]
    fn take_all<'py>(
        &mut self,
        py: Python<'py>,
        e: PyReadonlyArray1<'py, f64>,
        u: PyReadonlyArray1<'py, f64>,
        f_t: Option<PyReadonlyArray1<'py, f64>>,
        update: bool,
    ) -> Outcome<Bound<'py, PyArray1<f64>>> {
        let slice = |array: &'_ PyReadonlyArray1<'py, f64>| array.as_slice().map(<[f64]>::len);
        let n = slice(&u).map_err(PyErr::from)?;
        for (name, other) in [("e", Some(&e)), ("f_t", f_t.as_ref())] {
            let found = other.map_or(Ok(n), slice).map_err(PyErr::from)?;
            if found != n {
                return Err(bad_option(format!(
                    "{name} has {found} samples, u has {n}; give the same number of each"
                )));
            }
        }
        let (e, u) = (e.as_slice().map_err(PyErr::from)?, u.as_slice().map_err(PyErr::from)?);
        let f_t = match &f_t {
            Some(array) => Some(array.as_slice().map_err(PyErr::from)?),
            None => None,
        };
        let innovations = py.detach(|| {
            (0..n)
                .map(|k| {
                    let sample = Sample {
                        e: e[k],
                        u: u[k],
                        reference: f_t.map(|f| f[k]),
                    };
                    self.take(sample, update)
                })
                .collect()
        });
        Ok(array(py, innovations))
    }

    /// True once there is an estimate.
    #[getter]
    fn ready(&self) -> bool {
        self.live.tracker().is_some()
    }

    /// Returns the reason why the last fit failed or the warm-up restarted; `None` if neither happened.
    #[getter]
    fn trouble(&self) -> Option<String> {
        match self.live.stage() {
            Stage::Tracking(tracker) => tracker.failures().map(|(_, reason)| reason),
            Stage::Collecting(warm_up) => warm_up.trouble.clone(),
        }
    }

    #[getter]
    fn sample_time(&self) -> f64 {
        self.live.sample_time().s()
    }

    /// Returns the decimation that a high sampling frequency required; `None` if there is none.
    #[getter]
    fn decimation(&self) -> Option<String> {
        self.live.decimation().map(|done| done.to_string())
    }

    #[getter]
    fn method(&self) -> &'static str {
        self.live.plan().options().method.name()
    }

    #[getter]
    fn structure(&self) -> &'static str {
        self.live.plan().options().structure.name()
    }

    #[getter]
    fn orders<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyDict>> {
        Ok(figures::orders(py, &self.tracker()?.options().orders)?)
    }

    #[getter]
    fn parameter_names(&self) -> Outcome<Vec<String>> {
        Ok(self.tracker()?.parameter_names())
    }

    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_slice(py, self.tracker()?.theta()))
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Outcome<Option<Bound<'py, PyArray2<f64>>>> {
        let tracker = self.tracker()?;
        let columns = tracker.theta().len();
        match tracker.covariance() {
            Some(c) => Ok(Some(matrix(py, c, columns)?)),
            None => Ok(None),
        }
    }

    #[getter]
    fn parameters(&self) -> Outcome<Vec<(String, figures::ValueWithError)>> {
        let tracker = self.tracker()?;
        let estimates = tracker.parameters().into_iter().map(figures::value_and_error);
        Ok(tracker.parameter_names().into_iter().zip(estimates).collect())
    }

    #[getter]
    fn operator<'py>(&self, py: Python<'py>) -> Outcome<Option<Bound<'py, PyDict>>> {
        Ok(figures::operator(py, &self.tracker()?.operator())?)
    }

    /// Returns the frequencies in rad/s at which the response is evaluated.
    #[getter]
    fn at(&self) -> Vec<f64> {
        self.live.plan().options().at_rad_s.clone()
    }

    /// Returns the controlled element as text.
    #[getter]
    fn controlled_element(&self) -> Option<String> {
        let element = self.live.plan().options().controlled_element.as_ref();
        element.map(ToString::to_string)
    }

    /// Returns the gain in dB and the phase in deg at a frequency in rad/s, each with its standard error.
    fn response(&self, omega: f64) -> Outcome<Option<(figures::ValueWithError, figures::ValueWithError)>> {
        let found = self.tracker()?.response(omega);
        Ok(found.map(|r| {
            (
                figures::value_and_error(r.gain_db()),
                figures::value_and_error(r.phase_deg()),
            )
        }))
    }

    /// Returns the crossover frequency in rad/s and the phase margin in deg, or the reason why there are none; `None`
    /// without a controlled element.
    #[getter]
    fn open_loop(&self) -> Outcome<Option<OpenLoopParts>> {
        let found = self.tracker()?.open_loop();
        Ok(found.map(|found| match found {
            Ok(found) => (
                Some((
                    figures::value_and_error(found.crossover_rad_s),
                    figures::value_and_error(found.phase_margin_deg),
                )),
                None,
            ),
            Err(reason) => (None, Some(reason.as_text())),
        }))
    }

    /// Returns whether the data determine each parameter of the operator.
    #[getter]
    fn determined(&self) -> Outcome<std::collections::BTreeMap<&'static str, bool>> {
        let tracker = self.tracker()?;
        let found = tracker.operator().map(|operator| tracker.determinations(&operator));
        Ok(found.unwrap_or_default().into_iter().collect())
    }

    #[getter]
    fn innovation_variance(&self) -> Outcome<f64> {
        Ok(self.tracker()?.innovation_variance())
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let counts = self.live.counts();
        all.set_item("samples", counts.samples)?;
        all.set_item("skipped", counts.skipped)?;
        all.set_item("held", counts.held)?;
        all.set_item("restarts", counts.restarts)?;
        all.set_item("steps_shortened", counts.shortened)?;
        Ok(all)
    }

    /// Returns the event of the guard at the last sample, with times in s relative to that sample.
    #[getter]
    fn event<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(tracker) = self.live.tracker() else {
            return Ok(None);
        };
        let tracked = self.live.plan().sample_time();
        let event = tracker.event().map(|event| event.at(0.0, tracked));
        event.map(|fault| figures::track_fault(py, &fault)).transpose()
    }

    /// True while the guard keeps the estimate constant.
    #[getter]
    fn paused(&self) -> bool {
        self.live.tracker().is_some_and(Tracker::is_paused)
    }

    /// Returns the batch fit from which the tracker started; `None` if the start was given or the tracker was restored
    /// from a pickle.
    #[getter]
    fn start(&self) -> Option<PyFit> {
        let start = self.live.tracker()?.start()?.clone();
        Some(PyFit::new(start, self.choice.clone(), 1))
    }

    /// Returns the orders, once the tracker has started, and all changing values as numbers.
    fn saved<'py>(&mut self, py: Python<'py>) -> PyResult<SavedParts<'py>> {
        let (orders, numbers) = self.live.save();
        let orders = orders.map(|orders| figures::orders(py, &orders)).transpose()?;
        Ok((orders, array(py, numbers)))
    }

    /// Restores a state that `saved` returned.
    fn restore(
        &mut self,
        orders: Option<std::collections::BTreeMap<String, usize>>,
        numbers: PyReadonlyArray1<'_, f64>,
    ) -> Outcome<()> {
        let numbers = numbers.as_slice().map_err(PyErr::from)?;
        let orders = match orders {
            None => None,
            Some(orders) => {
                let of = |name: &str| {
                    let wrong = || bad_option(format!("the saved tracker has no {name}; save it again"));
                    orders.get(name).copied().ok_or_else(wrong)
                };
                Some(Orders {
                    na: of("na")?,
                    nb: of("nb")?,
                    nc: of("nc")?,
                    nd: of("nd")?,
                    nf: of("nf")?,
                    nk: of("nk")?,
                })
            }
        };
        Ok(self.live.restore(orders, numbers)?)
    }
}
