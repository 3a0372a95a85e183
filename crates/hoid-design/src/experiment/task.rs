//! The loop of an experiment and the signals that excite it.
//!
//! `e = f - y`, `u = B e + F f + n`, `y = P (u + d)`, with the target f, the disturbance d at the input of the
//! controlled element P, a person who responds to the error (B) and, if it is displayed, to the target (F), and the
//! remnant n.

use hoid_model::{
    ModelError,
    family_scenario::{FamilyState, Feedforward},
    forcing::{ForcingFunction, Sinusoid},
};
use serde::{Deserialize, Serialize};

/// Sample time of an experiment in s, if the length of a run is a multiple of it.
pub(super) const SAMPLE_TIME_S: f64 = 0.01;

/// Point at which a forcing function enters the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum EntryPoint {
    /// The forcing function is the target signal.
    #[default]
    Target,
    /// The forcing function is added to u at the input of the controlled element.
    Disturbance,
}

hoid_model::named_choice!(EntryPoint, "point of entry of the forcing function", 2, {
    Target => "target",
    Disturbance => "disturbance",
});

/// The remnant of a person.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Remnant {
    /// Share of the variance of u due to the remnant.
    pub share: f64,
    /// Time constant T_n in s; zero for white noise.
    pub time_constant_s: f64,
    /// Order m of the lag.
    pub order: i32,
}

impl Default for Remnant {
    /// Returns a remnant with a fifth of the variance of u, of first order with a time constant of .06 s.
    fn default() -> Self {
        Self {
            share: 0.2,
            time_constant_s: 0.06,
            order: 1,
        }
    }
}

/// The loop of an experiment: person, controlled element and remnant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The person and the controlled element.
    pub state: FamilyState,
    /// Response to a displayed target; `None` if the display shows only the error.
    #[serde(default, with = "written")]
    pub feedforward: Option<Feedforward>,
    /// Remnant of the person.
    pub remnant: Remnant,
}

/// Serialises a response to the target as operator and preview.
mod written {
    use hoid_model::{FamilyOperator, family_scenario::Feedforward};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(seen: &Option<Feedforward>, writer: S) -> Result<S::Ok, S::Error> {
        let parts = seen.as_ref().map(|seen| (&seen.operator, seen.preview_s));
        parts.serialize(writer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(reader: D) -> Result<Option<Feedforward>, D::Error> {
        let parts: Option<(FamilyOperator, f64)> = Deserialize::deserialize(reader)?;
        Ok(parts.map(|(operator, preview_s)| Feedforward::new(operator, preview_s)))
    }
}

/// The forcing functions of an experiment: a target, a disturbance, or both.
#[derive(Debug, Clone, PartialEq)]
pub struct Forcing {
    lines: Vec<(EntryPoint, Sinusoid)>,
}

impl Forcing {
    /// Creates a single forcing function that enters at the given point.
    pub fn of(enters: EntryPoint, function: &ForcingFunction) -> Self {
        let lines = function.sinusoids().iter().map(|line| (enters, *line)).collect();
        Self { lines }
    }

    /// Creates a target and a disturbance.
    pub fn with_target_and_disturbance(target: &ForcingFunction, disturbance: &ForcingFunction) -> Self {
        let mut all = Self::of(EntryPoint::Target, target);
        all.lines.extend(Self::of(EntryPoint::Disturbance, disturbance).lines);
        all
    }

    /// Creates the forcing functions from lines with their points of entry.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] as for [`ForcingFunction::new`], which is applied to the lines of each point of
    /// entry.
    pub fn new(lines: Vec<(EntryPoint, Sinusoid)>) -> Result<Self, ModelError> {
        let all = Self { lines };
        for enters in [EntryPoint::Target, EntryPoint::Disturbance] {
            all.function(enters)?;
        }
        Ok(all)
    }

    /// Returns all lines, each with its point of entry.
    pub fn lines(&self) -> &[(EntryPoint, Sinusoid)] {
        &self.lines
    }

    /// Returns the lines that enter at a point.
    pub fn sinusoids(&self, enters: EntryPoint) -> Vec<Sinusoid> {
        let here = self.lines.iter().filter(|(at, _)| *at == enters);
        here.map(|(_, line)| *line).collect()
    }

    /// Returns the forcing function that enters at a point; it is zero if no line enters there.
    ///
    /// # Errors
    /// As [`ForcingFunction::new`].
    pub fn function(&self, enters: EntryPoint) -> Result<ForcingFunction, ModelError> {
        ForcingFunction::new(self.sinusoids(enters))
    }
}
