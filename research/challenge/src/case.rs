//! Definition of a case of the challenge: data, no code.

use super::operator::{Parameter, Plant};

/// The operator's form; its parameters are drawn again in each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Gain and lead: the operator of the thesis.
    Lead,
    /// A gain only.
    Gain,
    /// Gain, lead and lag: people on `1/s`.
    LeadLag,
    /// Gain, two leads and a lag: people on plants of second order.
    Lead2Lag,
    /// Gain and lead after a neuromuscular system of third order.
    ThirdOrder,
    /// Gain and lead, and the dynamics of a stick with 20 to 30 rad/s.
    StickDynamics,
}

/// The excitation; its phases are drawn again in each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Forcing {
    /// A disturbance at the input of the plant: primes times 0.05 Hz up to 1.55 Hz, amplitudes as
    /// 1 over frequency.
    Disturbance,
    /// The same lines as a target.
    Target,
    /// Ten sines from 0.157 to 13.8 rad/s as a target, those above 2.6 rad/s ten times smaller (D. T.
    /// McRuer et al., AFFDL-TR-65-15, 1965).
    McRuer,
}

/// Sampling of the operator's input and output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// Error and control are held over each sample, as with a sampled display and stick.
    Held,
    /// Continuous; only the recorder samples.
    Continuous,
}

/// Spectrum of the remnant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spectrum {
    /// `1/(T_n s + 1)^m`.
    Lag(usize),
    /// A first-order lag, a peak at omega_nm (20 % of the variance) and a drift of 3 to 10 s (10 %).
    Rich,
    /// A first-order lag, and a narrow peak at 50 to 60 rad/s with a quarter of the variance.
    Tremor,
}

/// Time course of the remnant's strength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// Constant.
    Steady,
    /// Standard deviation times `1 + a sin(2 pi t/30 s + phase)`: from one end to the other in 15 s.
    Wander(f64),
    /// Times a factor in every second span of 15 s.
    Steps(f64),
    /// Proportional to |e|.
    Error,
    /// Proportional to the running rms of u over 1 s.
    Control,
    /// One sample in fifty is seven times as large.
    Impulsive,
    /// 80 % of the variance in two pulses per second.
    Pulsed,
    /// Alternately on and off for 2 s each on average; with a ninth of the variance when off.
    Intermittent,
}

/// Imperfections of stick and recorder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Blemish {
    /// None.
    None,
    /// A random walk of the stick in the loop, rms of u per root second.
    Drift(f64),
    /// Offset of recorded e and u, relative to their rms.
    Offset(f64),
    /// Quantisation of the stick in the loop, in steps of this fraction of the rms of u.
    Quantised(f64),
    /// Saturation of the stick in the loop at this multiple of the rms of u.
    Saturated(f64),
    /// Outliers of recorded u every 50 s on average, by this number of standard deviations of the
    /// innovations.
    Glitches(f64),
    /// Recorded e and u are NaN for 3 s from 60 s on.
    Missing,
    /// Recorded e and u are zero for 3 s from 60 s on.
    Silent,
    /// No activity for the first seconds, of the given number.
    IdleStart(f64),
    /// From this time on, s, u is recorded with the wrong sign.
    Polarity(f64),
}

/// A change of the operator only: remnant, plant and forcing function are unchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// When it starts, s.
    pub at_s: f64,
    /// Duration, s; the factor changes geometrically.
    pub takes_s: f64,
    /// The parameter that changes.
    pub parameter: Parameter,
    /// Its factor.
    pub factor: f64,
}

/// Information about the delay that is given to a method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DelayKnown {
    /// Its value, a whole number of samples.
    Whole,
    /// Its value rounded to a sample; it differs by half a sample.
    Fraction,
    /// None.
    No,
}

/// A theme of the challenge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Theme {
    /// Remnants, without a change.
    Remnants,
    /// Changes of each size.
    Changes,
    /// Time and course of changes.
    Courses,
    /// Changes under each remnant.
    ChangesInRemnants,
    /// Delays.
    Delays,
    /// Plants, operators, forcing.
    Loops,
    /// Sample rates.
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

/// A case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Its name, which determines its random streams.
    pub name: String,
    /// Its theme.
    pub theme: Theme,
    /// Description, one line.
    pub meaning: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Length of a record, s.
    pub length_s: f64,
    /// The plant.
    pub plant: Plant,
    /// The operator.
    pub form: Form,
    /// The excitation.
    pub forcing: Forcing,
    /// Sampling of the operator's input and output.
    pub sight: Sight,
    /// Spectrum of the remnant.
    pub spectrum: Spectrum,
    /// Time course of its strength.
    pub course: Course,
    /// Its standard deviation relative to that of u without it.
    pub ratio: f64,
    /// Imperfections of stick and recorder.
    pub blemish: Blemish,
    /// Changes in order of time.
    pub shifts: Vec<Shift>,
    /// Information about the delay.
    pub delay: DelayKnown,
}

impl Case {
    /// The base case: gain and lead on `1/s^2`, a disturbance, a steady first-order remnant, 100
    /// Hz, 90 s, no change.
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
            sight: Sight::Held,
            spectrum: Spectrum::Lag(1),
            course: Course::Steady,
            ratio: 0.3,
            blemish: Blemish::None,
            shifts: Vec::new(),
            delay: DelayKnown::Whole,
        }
    }

    /// The start span given to every method, s: the first third, at most 30 s.
    pub fn start_s(&self) -> (f64, f64) {
        (0.0, (self.length_s / 3.0).min(30.0))
    }

    /// Times of the changes, s.
    pub fn changes_s(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.shifts.iter().map(|shift| shift.at_s).collect();
        if let Blemish::Polarity(at_s) = self.blemish {
            times.push(at_s);
        }
        times.dedup();
        times
    }

    /// True if all changes are completed within two seconds, so that they have a definite time.
    pub fn changes_at_once(&self) -> bool {
        self.shifts.iter().all(|shift| shift.takes_s <= 2.0)
    }
}
