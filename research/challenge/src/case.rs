//! Definition of a case of the challenge as data without code.

use super::operator::{Parameter, Plant};

/// Form of the operator, whose parameters are drawn again for each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Gain and lead: the operator of the thesis.
    Lead,
    /// A gain only.
    Gain,
    /// Gain, lead and lag, as for people controlling `1/s`.
    LeadLag,
    /// Gain, two leads and a lag, as for people controlling second-order plants.
    Lead2Lag,
    /// Gain and lead, with a third-order neuromuscular system.
    ThirdOrder,
    /// Gain and lead, with the dynamics of a stick at 20 to 30 rad/s.
    StickDynamics,
}

/// Excitation, whose phases are drawn again for each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Forcing {
    /// A disturbance at the input of the plant: lines at primes times 0.05 Hz up to 1.55 Hz, with amplitudes inversely
    /// proportional to frequency.
    Disturbance,
    /// A target with the same lines as the disturbance.
    Target,
    /// A target of ten sinusoids from 0.157 to 13.8 rad/s, whose amplitudes above 2.6 rad/s are ten times smaller (D.
    /// T. McRuer et al., AFFDL-TR-65-15, 1965).
    McRuer,
}

/// Sampling of the operator's input and output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Error and control are held over each sample, as for a sampled display and stick.
    Held,
    /// Error and control are continuous; only the recorder samples them.
    Continuous,
}

/// Spectrum of the remnant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spectrum {
    /// A lag of order m, `1/(T_n s + 1)^m`.
    Lag(usize),
    /// A first-order lag, a peak at omega_nm (20 % of the variance) and a slow drift with a time constant of 3 to 10 s
    /// (10 %).
    Rich,
    /// A first-order lag, and a narrow peak at 50 to 60 rad/s with a quarter of the variance.
    Tremor,
}

/// Time course of the remnant's strength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// Constant strength.
    Steady,
    /// The standard deviation is multiplied by `1 + a sin(2 pi t/30 s + phase)`, which goes from one extreme to the
    /// other in 15 s.
    Wander(f64),
    /// The standard deviation is multiplied by a factor in every second span of 15 s.
    Steps(f64),
    /// Proportional to |e|.
    Error,
    /// Proportional to the running rms of u over 1 s.
    Control,
    /// One sample in fifty, on average, is seven times as large as the others.
    Impulsive,
    /// 80 % of the variance is in two pulses per second on average.
    Pulsed,
    /// Alternately on and off for 2 s each on average; the variance when off is a ninth of that when on.
    Intermittent,
}

/// Imperfection of the stick or the recorder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Imperfection {
    /// No imperfection.
    None,
    /// Random walk of the stick in the loop, in multiples of the rms of u per root second.
    Drift(f64),
    /// Offsets of the recorded e and u, relative to their rms.
    Offset(f64),
    /// Quantisation of the stick in the loop, in steps of this fraction of the rms of u.
    Quantised(f64),
    /// Saturation of the stick in the loop at this multiple of the rms of u.
    Saturated(f64),
    /// Outliers of the recorded u, every 50 s on average, with this number of standard deviations of the innovations.
    Glitches(f64),
    /// The recorded e and u are NaN from 60 s to 63 s.
    Missing,
    /// The recorded e and u are zero from 60 s to 63 s.
    Silent,
    /// There is no activity for this number of seconds at the start.
    IdleStart(f64),
    /// From this time on (s), u is recorded with the opposite sign.
    Polarity(f64),
}

/// A change in the operator only: the remnant, the plant and the forcing function are unchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatorChange {
    /// Time at which the change starts, s.
    pub at_s: f64,
    /// Duration of the change (s); the parameter changes exponentially.
    pub takes_s: f64,
    /// Parameter that changes.
    pub parameter: Parameter,
    /// Factor by which the parameter is multiplied.
    pub factor: f64,
}

/// Information about the delay that the methods receive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DelayKnown {
    /// The value of the delay, which is a whole number of samples.
    Whole,
    /// The value of the delay rounded down to a whole sample; the true delay is half a sample longer.
    Fraction,
    /// No information.
    No,
}

/// A theme of the challenge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Theme {
    /// Remnants without a change in the operator.
    Remnants,
    /// Changes in different parameters and of different sizes.
    Changes,
    /// Times and courses of changes.
    Courses,
    /// Changes with each kind of remnant.
    ChangesInRemnants,
    /// Delays.
    Delays,
    /// Plants, operators, forcing.
    Loops,
    /// Sampling rates.
    Rates,
}

hoid_model::named_choice!(Theme, "theme of the challenge", 7, {
    Remnants => "remnants",
    Changes => "changes",
    Courses => "courses",
    ChangesInRemnants => "changes-in-remnants",
    Delays => "delays",
    Loops => "loops",
    Rates => "rates",
});

/// A case of the challenge.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name of the case, which determines its random streams.
    pub name: String,
    /// Theme of the case.
    pub theme: Theme,
    /// Description in one line.
    pub meaning: String,
    /// Sampling rate, Hz.
    pub rate_hz: f64,
    /// Length of a record, s.
    pub length_s: f64,
    /// Controlled element.
    pub plant: Plant,
    /// Form of the operator.
    pub form: Form,
    /// Target or disturbance.
    pub forcing: Forcing,
    /// Sampling of the operator's input and output.
    pub sampling: Sampling,
    /// Spectrum of the remnant.
    pub spectrum: Spectrum,
    /// Time course of the remnant's strength.
    pub course: Course,
    /// Standard deviation of the remnant, relative to the standard deviation of u without remnant.
    pub ratio: f64,
    /// Imperfection of the stick or the recorder.
    pub imperfection: Imperfection,
    /// Changes in the operator in chronological order.
    pub operator_changes: Vec<OperatorChange>,
    /// Information about the delay that the methods receive.
    pub delay: DelayKnown,
}

impl Case {
    /// The base case: gain and lead on `1/s^2`, a disturbance, a first-order remnant of constant strength, 100 Hz, 90
    /// s, no change.
    pub(super) fn baseline(theme: Theme, name: impl Into<String>, meaning: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            theme,
            meaning: meaning.into(),
            rate_hz: 100.0,
            length_s: 90.0,
            plant: Plant::DoubleIntegrator,
            form: Form::Lead,
            forcing: Forcing::Disturbance,
            sampling: Sampling::Held,
            spectrum: Spectrum::Lag(1),
            course: Course::Steady,
            ratio: 0.3,
            imperfection: Imperfection::None,
            operator_changes: Vec::new(),
            delay: DelayKnown::Whole,
        }
    }

    /// Start span for every method (s): the first third, at most 30 s.
    pub fn start_span_s(&self) -> (f64, f64) {
        (0.0, (self.length_s / 3.0).min(30.0))
    }

    /// Times at which the changes start, s.
    pub fn change_times_s(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.operator_changes.iter().map(|shift| shift.at_s).collect();
        if let Imperfection::Polarity(at_s) = self.imperfection {
            times.push(at_s);
        }
        times.dedup();
        times
    }

    /// True if every change takes at most two seconds, so the changes have definite times.
    pub fn has_sudden_changes(&self) -> bool {
        self.operator_changes.iter().all(|shift| shift.takes_s <= 2.0)
    }
}
