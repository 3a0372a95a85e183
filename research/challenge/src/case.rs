//! Definition of a case of the challenge: data, no code.

use super::operator::{Parameter, Plant};

/// The operator's form; its parameters are drawn again in each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Gain and lead: the operator of the thesis.
    Lead,
    /// A gain alone.
    Gain,
    /// Gain, lead and lag: people on `1/s`.
    LeadLag,
    /// Gain, two leads and a lag: people on plants of second order.
    Lead2Lag,
    /// Gain and lead after a neuromuscular system of third order.
    ThirdOrder,
    /// Gain and lead, and the dynamics of a stick of 20 to 30 rad/s.
    StickDynamics,
}

/// The excitation; its phases are drawn again in each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Forcing {
    /// A disturbance at the input of the plant: primes times 0.05 Hz up to 1.55 Hz, amplitudes as
    /// 1 over frequency.
    Disturbance,
    /// The same as a target.
    Target,
    /// Ten sines from 0.157 to 13.8 rad/s as a target, those above 2.6 rad/s ten times smaller (D. T.
    /// McRuer et al., AFFDL-TR-65-15, 1965).
    McRuer,
}

/// When the person looks and acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// Error and control are held over each sample, as on a display that is drawn again and a stick
    /// that is read.
    Held,
    /// Continuously; the recorder samples.
    Continuous,
}

/// Spectrum of the remnant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spectrum {
    /// `1/(T_n s + 1)^m`.
    Lag(usize),
    /// A lag of first order, a peak at omega_nm (20 % of the variance) and a drift of 3 to 10 s (10 %).
    Rich,
    /// A lag of first order, and a narrow peak at 50 to 60 rad/s with a quarter of the variance.
    Tremor,
}

/// How the strength of the remnant continues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// It stays.
    Steady,
    /// Standard deviation times `1 + a sin(2 pi t/30 s + phase)`: from one end to the other in 15 s.
    Wander(f64),
    /// Times a factor in every second span of 15 s.
    Steps(f64),
    /// Proportional to |e|.
    Error,
    /// Proportional to the running rms of u over 1 s.
    Control,
    /// One sample in fifty seven times as large.
    Impulsive,
    /// 80 % of the variance in two pulses a second.
    Pulsed,
    /// On and off for 2 s each in the mean; off with a ninth of the variance.
    Intermittent,
}

/// Effects of stick and recorder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Blemish {
    /// Nothing.
    None,
    /// A random walk of the stick, rms of u per root second, in the loop.
    Drift(f64),
    /// Offset of recorded e and u, in their rms.
    Offset(f64),
    /// The stick reads in steps of this part of the rms of u, in the loop.
    Quantised(f64),
    /// The stick ends at a given number of rms of u, in the loop.
    Saturated(f64),
    /// Every 50 s in the mean one recorded sample of u is off by a given number of standard
    /// deviations of the innovations.
    Glitches(f64),
    /// Recorded e and u are NaN for 3 s from 60 s on.
    Missing,
    /// They are zero for 3 s from 60 s on.
    Silent,
    /// No one acts and nothing moves for the first a given number of seconds.
    IdleStart(f64),
    /// From so many seconds on u is recorded with the wrong sign.
    Polarity(f64),
}

/// A change of the operator alone: remnant, plant and forcing stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// When it starts, s.
    pub at_s: f64,
    /// How long it takes, s; the factor grows geometrically.
    pub takes_s: f64,
    /// The part that changes.
    pub parameter: Parameter,
    /// By which factor.
    pub factor: f64,
}

/// Information about the delay that a method gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DelayKnown {
    /// Its value, which is a whole number of samples.
    Whole,
    /// Its value to the next sample; it lies half a sample off.
    Fraction,
    /// Nothing.
    No,
}

/// A theme of the challenge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Theme {
    /// Remnants, without a change.
    Remnants,
    /// Changes of each size.
    Changes,
    /// When and how the person changes.
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
    /// Its name: random streams belong to it.
    pub name: String,
    /// Its theme.
    pub theme: Theme,
    /// Its definition, in a line.
    pub meaning: String,
    /// Samples a second.
    pub rate_hz: f64,
    /// Length of a record, s.
    pub length_s: f64,
    /// The plant.
    pub plant: Plant,
    /// The operator.
    pub form: Form,
    /// The excitation.
    pub forcing: Forcing,
    /// When the person looks and acts.
    pub sight: Sight,
    /// Spectrum of the remnant.
    pub spectrum: Spectrum,
    /// Its strength.
    pub course: Course,
    /// Its standard deviation in that of u without it.
    pub ratio: f64,
    /// Stick and recorder.
    pub blemish: Blemish,
    /// Changes in order of time.
    pub shifts: Vec<Shift>,
    /// The report of the delay.
    pub delay: DelayKnown,
}

impl Case {
    /// The case that all others are variants of: gain and lead on `1/s^2`, a disturbance, a steady
    /// remnant of first order, 100 Hz, 90 s, no one changes.
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

    /// The start span that every method is given, s: the first third, 30 s at most.
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

    /// True if all that changes does so within two seconds: there is a moment to be found.
    pub fn changes_at_once(&self) -> bool {
        self.shifts.iter().all(|shift| shift.takes_s <= 2.0)
    }
}
