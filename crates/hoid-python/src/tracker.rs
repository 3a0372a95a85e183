//! `pyhoid.Tracker`: a recursive estimate, online.

use hoid_ident::{Choice, IdentError};
use hoid_model::{Decimation, Decimator, Orders, Record, SampleTime};
use hoid_track::{Counts, Live, Sample, TrackPlan, Tracker, opened, sealed};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, Wanted, array, matrix},
    errors::{Outcome, bad_option},
    figures, files,
    fit::PyFit,
    recursion,
};

/// Maximum length of the warm-up, samples.
const LONGEST_WARM_UP: usize = 10_000_000;

/// The state of a tracker, to restore it: orders, numbers of the tracker, numbers of the warm-up.
type Saved<'py> = (Option<Bound<'py, PyDict>>, Bound<'py, PyArray1<f64>>);

/// Crossover and margin, or the reason why not.
type OpenLoopParts = (
    Option<(figures::ValueWithError, figures::ValueWithError)>,
    Option<&'static str>,
);

/// The package derives `pyhoid.Tracker` from it.
#[pyclass(name = "Tracker", module = "pyhoid._pyhoid", subclass)]
pub struct PyTracker {
    plan: TrackPlan,
    live: Live,
    choice: Option<Choice>,
    sample_time: SampleTime,
    /// Decimator of error, control and target.
    decimator: Option<Decimator<3>>,
}

/// Searches the open orders on the start record, and runs the filters over it.
fn started(plan: &TrackPlan, record: &Record) -> Result<(Tracker, Option<Choice>), IdentError> {
    let (options, choice) = plan.choose(record, &|| {})?;
    let mut tracker = Tracker::new(&options, Some(record), record.sample_time())?;
    let reference = record.channel("f_t");
    for k in 0..record.len() {
        let sample = Sample {
            e: record.input().get(k).copied().unwrap_or(0.0),
            u: record.output()[k],
            reference: reference.map(|r| r[k]),
        };
        tracker.update(sample, false);
    }
    Ok((tracker, choice))
}

impl PyTracker {
    fn tracker(&self) -> Outcome<&Tracker> {
        match &self.live {
            Live::Tracking(tracker) => Ok(tracker),
            Live::Collecting(warm_up) => Err(bad_option(format!(
                "the tracker is warming up: it has {} of {} samples; check .ready first",
                warm_up.collected, warm_up.needed
            ))),
        }
    }

    /// The sample time that is tracked.
    fn tracked(&self) -> SampleTime {
        self.decimator.as_ref().map_or(self.sample_time, Decimator::sample_time)
    }

    fn take(&mut self, sample: Sample, update: bool) -> f64 {
        let sample = match &mut self.decimator {
            None => sample,
            Some(decimator) => match decimator.take([sample.e, sample.u, sample.reference.unwrap_or(f64::NAN)]) {
                Some([e, u, f_t]) => Sample {
                    e,
                    u,
                    reference: Some(f_t).filter(|f| f.is_finite()),
                },
                None => return f64::NAN,
            },
        };
        if let (Live::Tracking(tracker), false) = (&mut self.live, update) {
            return tracker.update(sample, false).innovation.unwrap_or(f64::NAN);
        }
        let plan = &self.plan;
        let taken = self.live.update(sample, &|record| plan.choose(record, &|| {}));
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
        warm_up: usize,
        record: Option<Bound<'_, PyAny>>,
    ) -> Outcome<Self> {
        let sample_time = SampleTime::new(sample_time)?;
        let decimation = match options.get_item("decimate")? {
            Some(text) => files::decimation(&text.extract::<String>()?)?,
            None => Decimation::Off,
        };
        let asked = recursion::request(options)?;
        let decimation = if asked.counts_samples() {
            decimation.when_named()
        } else {
            decimation
        };
        let factor = decimation.factor(sample_time);
        let decimator = match factor {
            1 => None,
            factor => Some(Decimator::new(factor, sample_time, [true, false, false])?),
        };
        let tracked = decimator.as_ref().map_or(sample_time, Decimator::sample_time);
        let warm_up = if factor > 1 { (warm_up / factor).max(1) } else { warm_up };
        let plan = asked.plan(tracked)?;
        if plan.options().method.smooths() {
            return Err(bad_option(
                "smooth belongs to pyhoid.track: a stream has no future samples",
            ));
        }
        if !(1..=LONGEST_WARM_UP).contains(&warm_up) {
            return Err(bad_option(
                "warm_up: expected a time in s of one sample to 10 million samples",
            ));
        }
        if let Some(record) = record {
            let record = arrays::record(&record, Wanted::Only(&["f_t"]))?;
            if !record.sample_time().matches(sample_time) {
                return Err(bad_option(format!(
                    "the start record has a sample time of {} s, the tracker one of {} s",
                    record.sample_time().s(),
                    sample_time.s()
                )));
            }
            let (tracker, choice) = py.detach(|| {
                let record = if factor > 1 {
                    record.decimated(factor)?.0
                } else {
                    record
                };
                started(&plan, &record)
            })?;
            return Ok(Self {
                plan,
                live: Live::Tracking(Box::new(tracker)),
                choice,
                sample_time,
                decimator,
            });
        }
        Ok(Self {
            live: Live::new(plan.options(), warm_up, tracked)?,
            plan,
            choice: None,
            sample_time,
            decimator,
        })
    }

    /// Takes one sample. Returns the innovation: NaN at a fault and during the warm-up.
    #[pyo3(signature = (e, u, f_t=None, update=true))]
    fn step(&mut self, py: Python<'_>, e: f64, u: f64, f_t: Option<f64>, update: bool) -> f64 {
        let sample = Sample { e, u, reference: f_t };
        match self.live {
            Live::Tracking(_) => self.take(sample, update),
            // The last sample of the warm-up starts the fit.
            Live::Collecting(_) => py.detach(|| self.take(sample, update)),
        }
    }

    /// Takes samples one after the other; returns their innovations.
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
                    "{name} has {found} samples, u has {n}; give as many of each"
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
        matches!(self.live, Live::Tracking(_))
    }

    /// Why the last start fit failed, or why the warm-up started again.
    #[getter]
    fn trouble(&self) -> Option<String> {
        match &self.live {
            Live::Tracking(tracker) => tracker.failures().map(|(_, reason)| reason),
            Live::Collecting(warm_up) => warm_up.trouble.clone(),
        }
    }

    #[getter]
    fn sample_time(&self) -> f64 {
        self.sample_time.s()
    }

    /// How a high rate is lowered; None if it is not.
    #[getter]
    fn decimation(&self) -> Option<String> {
        self.decimator.as_ref().map(|decimator| decimator.done().to_string())
    }

    #[getter]
    fn method(&self) -> &'static str {
        self.plan.options().method.name()
    }

    #[getter]
    fn structure(&self) -> &'static str {
        self.plan.options().structure.name()
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
        let estimates = tracker.parameters().into_iter().map(figures::pair);
        Ok(tracker.parameter_names().into_iter().zip(estimates).collect())
    }

    #[getter]
    fn operator<'py>(&self, py: Python<'py>) -> Outcome<Option<Bound<'py, PyDict>>> {
        Ok(figures::operator(py, &self.tracker()?.operator())?)
    }

    /// The settings of responses: frequencies in rad/s.
    #[getter]
    fn at(&self) -> Vec<f64> {
        self.plan.options().at_rad_s.clone()
    }

    /// The controlled element.
    #[getter]
    fn controlled_element(&self) -> Option<String> {
        let element = self.plan.options().controlled_element.as_ref();
        element.map(ToString::to_string)
    }

    /// Gain in dB and phase in deg at a frequency in rad/s, each with its standard error.
    fn response(&self, omega: f64) -> Outcome<Option<(figures::ValueWithError, figures::ValueWithError)>> {
        let found = self.tracker()?.response(omega);
        Ok(found.map(|r| (figures::pair(r.gain_db()), figures::pair(r.phase_deg()))))
    }

    /// Crossover in rad/s and phase margin in deg, or why there are none; None without a controlled
    /// element.
    #[getter]
    fn open_loop(&self) -> Outcome<Option<OpenLoopParts>> {
        let found = self.tracker()?.open_loop();
        Ok(found.map(|found| match found {
            Ok(found) => (
                Some((
                    figures::pair(found.crossover_rad_s),
                    figures::pair(found.phase_margin_deg),
                )),
                None,
            ),
            Err(reason) => (None, Some(reason.words())),
        }))
    }

    /// Whether the data determine each parameter of the operator.
    #[getter]
    fn determined(&self) -> Outcome<std::collections::BTreeMap<&'static str, bool>> {
        let tracker = self.tracker()?;
        let found = tracker.operator().map(|operator| tracker.determined(&operator));
        Ok(found.unwrap_or_default().into_iter().collect())
    }

    #[getter]
    fn innovation_variance(&self) -> Outcome<f64> {
        Ok(self.tracker()?.innovation_variance())
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let counts = match &self.live {
            Live::Tracking(tracker) => tracker.counts(),
            Live::Collecting(warm_up) => Counts {
                samples: warm_up.collected as u64,
                ..Counts::default()
            },
        };
        all.set_item("samples", counts.samples)?;
        all.set_item("skipped", counts.skipped)?;
        all.set_item("held", counts.held)?;
        all.set_item("restarts", counts.restarts)?;
        all.set_item("steps_shortened", counts.shortened)?;
        Ok(all)
    }

    /// Event of the guard at the last sample, its times in s before that sample.
    #[getter]
    fn event<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Live::Tracking(tracker) = &self.live else {
            return Ok(None);
        };
        let event = tracker.event().map(|event| event.at(0.0, self.tracked()));
        event.map(|fault| figures::track_fault(py, &fault)).transpose()
    }

    /// True while the guard lets the estimate stay constant.
    #[getter]
    fn paused(&self) -> bool {
        matches!(&self.live, Live::Tracking(tracker) if tracker.is_paused())
    }

    /// The batch fit that the tracker started from; None with a given start, or from a pickle.
    #[getter]
    fn start(&self) -> Option<PyFit> {
        let Live::Tracking(tracker) = &self.live else {
            return None;
        };
        Some(PyFit::new(tracker.start()?.clone(), self.choice.clone(), 1))
    }

    /// The orders, once there is a tracker, and all that changes as numbers.
    fn saved<'py>(&mut self, py: Python<'py>) -> PyResult<Saved<'py>> {
        let (orders, mut numbers) = self.live.saved();
        if let Some(decimator) = &mut self.decimator {
            let of_tracker = numbers.len();
            numbers.extend(decimator.saved());
            numbers = sealed(numbers);
            numbers.push(of_tracker as f64);
        }
        let orders = orders.map(|orders| figures::orders(py, &orders)).transpose()?;
        Ok((orders, array(py, numbers)))
    }

    /// Restores the state that `saved` returned.
    fn restore(
        &mut self,
        orders: Option<std::collections::BTreeMap<String, usize>>,
        numbers: PyReadonlyArray1<'_, f64>,
    ) -> Outcome<()> {
        let mut numbers = numbers.as_slice().map_err(PyErr::from)?;
        let tracked = self.tracked();
        if let Some(decimator) = &mut self.decimator {
            let wrong = || bad_option("the saved tracker is of another rate, or was changed since; save it again");
            let (of_tracker, all) = numbers.split_last().ok_or_else(wrong)?;
            let all = opened(all).ok_or_else(wrong)?;
            let (tracker, of_decimator) = all.split_at_checked(*of_tracker as usize).ok_or_else(wrong)?;
            if !decimator.restore(of_decimator) {
                return Err(wrong());
            }
            numbers = tracker;
        }
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
        self.live = Live::restored(&self.plan, orders, numbers, tracked)?;
        Ok(())
    }
}
