//! Realistic remnants.
//!
//! All kinds except the first have three parts: a broad band `1/(T_n s + 1)` with T_n = 0.05 to 0.3 s (70 % of the
//! remnant), a peak at the omega_nm of the person with a damping ratio of 0.15 to 0.4 (20 %), and a drift
//! `1/(T_n s + 1)` with T_n = 3 to 10 s (10 %). [`hoid_model::family_scenario`] describes the kinds and their sources.

use hoid_model::family_scenario::{
    DependenceSignal, Intermittence, Pulses, RemnantPart, RemnantShape, SignalDependence,
};

use super::population::Range;

/// Kind of remnant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RemnantKind {
    /// Only the part `1/(T_n s + 1)`, as in the thesis.
    Lag,
    /// Three Gaussian parts: broad band, peak and drift.
    BroadBand,
    /// Like `BroadBand`, with 80 % of the variance of the broad band proportional to the running mean square of u
    /// (memory 1 s).
    SignalDependent,
    /// Like `BroadBand`, with 80 % of the variance of the broad band in pulses, two per second on average.
    Pulsed,
    /// Like `BroadBand`, with the broad band on for 2 s and off for 2 s on average.
    Intermittent,
}

hoid_model::named_choice!(RemnantKind, "kind of remnant", 5, {
    Lag => "lag",
    BroadBand => "broad-band",
    SignalDependent => "signal-dependent",
    Pulsed => "pulsed",
    Intermittent => "intermittent",
});

const BAND_RANGE_S: Range = Range::new(0.05, 0.3);
const DRIFT_RANGE_S: Range = Range::new(3.0, 10.0);
const DAMPING_RANGE: Range = Range::new(0.15, 0.4);

impl RemnantKind {
    /// Returns the parts of the remnant of a person, from three numbers in `[0, 1)`.
    pub(super) fn remnant_parts(self, share: f64, omega_nm_rad_s: f64, numbers: [f64; 3]) -> Vec<RemnantPart> {
        let lag = |time_constant_s| RemnantShape::Lag {
            time_constant_s,
            order: 1,
        };
        let shape = lag(BAND_RANGE_S.log_interpolated(numbers[0]));
        if self == Self::Lag {
            return vec![RemnantPart::new(shape, share)];
        }
        let band = RemnantPart::new(shape, 0.7 * share);
        let band = match self {
            Self::Lag | Self::BroadBand => band,
            Self::SignalDependent => RemnantPart {
                signal_dependence: Some(SignalDependence {
                    signal: DependenceSignal::Control,
                    share: 0.8,
                    memory_s: 1.0,
                }),
                ..band
            },
            Self::Pulsed => RemnantPart {
                pulses: Some(Pulses {
                    share: 0.8,
                    rate_per_s: 2.0,
                }),
                ..band
            },
            Self::Intermittent => RemnantPart {
                intermittence: Some(Intermittence { on_s: 2.0, off_s: 2.0 }),
                ..band
            },
        };
        let peak = RemnantShape::Resonance {
            omega_rad_s: omega_nm_rad_s,
            zeta: DAMPING_RANGE.log_interpolated(numbers[1]),
        };
        let drift = lag(DRIFT_RANGE_S.log_interpolated(numbers[2]));
        vec![
            band,
            RemnantPart::new(peak, 0.2 * share),
            RemnantPart::new(drift, 0.1 * share),
        ]
    }
}
