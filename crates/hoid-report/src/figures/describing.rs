//! A describing function with its errors over frequency: magnitude, phase and coherence, together with the curves of
//! models.
//!
//! The phase of a model is drawn on the branch nearest to the points.

use hoid_ident::{
    ResponsePoint,
    frequency::{Description, chance_coherence, unwrapped_deg},
};
use hoid_model::{Complex64, uncertainty::Estimate};
use hoid_numerics::statistics::upper_median;

use super::{
    curves::{Curve, CurveGrid, CurvePanel, LineKind, curves},
    palette::Shade,
};
use crate::numbers::Z_95;

/// Name in the legend.
const LEGEND_NAME: &str = "describing function, bars 95 %";
/// Name in the legend if an error bar is truncated.
const TRUNCATED_NAME: &str = "describing function, bars 95 %, cut at 180 deg";
/// Name of the abscissa.
pub(super) const FREQUENCY_LABEL: &str = "frequency \u{3c9} (rad/s)";
/// Number of frequencies of a model curve.
const POINT_COUNT: usize = 240;

/// A frequency response drawn with the points.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCurve {
    /// Name in the legend.
    pub name: String,
    /// Frequencies (rad/s) in ascending order.
    pub omega_rad_s: Vec<f64>,
    /// Response at each frequency.
    pub response: Vec<Complex64>,
    /// Standard errors of magnitude (dB) and phase (deg) at each frequency, for the band; empty for no band.
    pub standard_errors: Vec<[f64; 2]>,
    /// Delay removed while the phase is unwrapped, s.
    pub delay_s: f64,
}

impl ModelCurve {
    /// Creates the curve of a response over the frequency range of a description; the range is widened by a small
    /// margin and extends at least up to `reach_rad_s`.
    pub fn over_frequencies(
        found: &Description,
        reach_rad_s: f64,
        name: &str,
        delay_s: f64,
        response: impl Fn(f64) -> Complex64,
    ) -> Self {
        let omega_rad_s = frequencies(found, reach_rad_s);
        Self {
            name: name.to_owned(),
            response: omega_rad_s.iter().map(|omega| response(*omega)).collect(),
            omega_rad_s,
            standard_errors: Vec::new(),
            delay_s,
        }
    }

    /// Creates the curve of a response with its standard errors over the frequencies of [`Self::over_frequencies`].
    pub fn with_band(
        found: &Description,
        reach_rad_s: f64,
        name: &str,
        delay_s: f64,
        response: impl Fn(&[f64]) -> Vec<ResponsePoint>,
    ) -> Self {
        Self::of_points(name, delay_s, &response(&frequencies(found, reach_rad_s)))
    }

    /// Creates the curve of a response that was computed with its standard errors.
    pub fn of_points(name: &str, delay_s: f64, points: &[ResponsePoint]) -> Self {
        let value = |p: &ResponsePoint| {
            let gain = 10.0_f64.powf(p.magnitude_db.value / 20.0);
            Complex64::from_polar(gain, p.phase_deg.value.to_radians())
        };
        let errors = |p: &ResponsePoint| {
            [p.magnitude_db, p.phase_deg].map(|estimate| estimate.standard_error.unwrap_or(f64::NAN))
        };
        Self {
            name: name.to_owned(),
            omega_rad_s: points.iter().map(|p| p.omega_rad_s).collect(),
            response: points.iter().map(value).collect(),
            standard_errors: points.iter().map(errors).collect(),
            delay_s,
        }
    }

    /// Edges of the band of 1.96 standard errors around the magnitude (`part` 0) or the phase (`part` 1); empty without
    /// standard errors.
    fn band(&self, part: usize, around: &[f64]) -> Vec<(f64, f64)> {
        let ends = |(value, errors): (&f64, &[f64; 2])| {
            let whole = Z_95 * errors[part];
            // `f64::min` would ignore NaN.
            let half = if whole > MAX_BAR_HALF_LENGTH {
                MAX_BAR_HALF_LENGTH
            } else {
                whole
            };
            (value - half, value + half)
        };
        around.iter().zip(&self.standard_errors).map(ends).collect()
    }

    /// Curve of the magnitude (`part` 0) or of the phase (`part` 1), whose values are `y`, with its band.
    pub(super) fn curve(&self, (kind, shade): (LineKind, Shade), part: usize, y: Vec<f64>) -> Curve {
        Curve {
            name: self.name.clone(),
            kind,
            shade,
            x: self.omega_rad_s.clone(),
            band: self.band(part, &y),
            y,
            bars: Vec::new(),
        }
    }

    /// Magnitude in dB.
    pub(super) fn magnitude_db(&self) -> Vec<f64> {
        self.response.iter().map(|h| 20.0 * h.norm().log10()).collect()
    }

    /// Phase in deg on the branch nearest to the points, given as pairs of frequency and phase.
    pub(super) fn phase_deg(&self, points: &[(f64, f64)]) -> Vec<f64> {
        let principal = self.response.iter().map(|h| h.arg().to_degrees());
        let pairs: Vec<(f64, f64)> = self.omega_rad_s.iter().copied().zip(principal).collect();
        let phase = unwrapped_deg(&pairs, self.delay_s);
        let mut turns: Vec<f64> = points
            .iter()
            .filter_map(|(omega, of_point)| {
                let k = self
                    .omega_rad_s
                    .partition_point(|w| w < omega)
                    .min(phase.len().checked_sub(1)?);
                Some(((of_point - phase[k]) / 360.0).round()).filter(|t| t.is_finite())
            })
            .collect();
        let turn = upper_median(&mut turns).unwrap_or(0.0);
        phase.iter().map(|p| p + 360.0 * turn).collect()
    }
}

/// Returns frequencies in rad/s over the range of a description, widened by a small margin and at least up to
/// `reach_rad_s`.
fn frequencies(found: &Description, reach_rad_s: f64) -> Vec<f64> {
    let lines = &found.function.lines;
    let ends = lines.first().zip(lines.last());
    let (low, high) = ends.map_or((0.1, 10.0), |(a, b)| (0.9 * a.omega_rad_s, 1.1 * b.omega_rad_s));
    let high = f64::max(high, reach_rad_s);
    log_spaced((low, high), POINT_COUNT)
}

/// Returns `n` frequencies from `low` to `high` at equal ratios.
pub fn log_spaced((low, high): (f64, f64), n: usize) -> Vec<f64> {
    let step = (high / low).ln() / (n - 1) as f64;
    (0..n).map(|k| low * (step * k as f64).exp()).collect()
}

/// A panel of curves.
pub(super) fn panel(name: &str, unit: &str, curves: Vec<Curve>) -> CurvePanel {
    CurvePanel {
        name: name.to_owned(),
        unit: unit.to_owned(),
        curves,
        ..CurvePanel::default()
    }
}

/// Draws the describing function as points with error bars of 1.96 standard errors, and models as lines. `title` is the
/// text for screen readers.
pub fn describing(id: &str, title: &str, found: &Description, models: &[ModelCurve]) -> String {
    let lines = &found.function.lines;
    let omega: Vec<f64> = lines.iter().map(|line| line.omega_rad_s).collect();
    let magnitudes: Vec<Estimate> = lines.iter().map(|line| line.magnitude_db()).collect();
    let phases = found.phases_deg();
    let is_cut = magnitudes
        .iter()
        .chain(&phases)
        .any(|v| bar_half_length(v) > MAX_BAR_HALF_LENGTH);
    let name = if is_cut { TRUNCATED_NAME } else { LEGEND_NAME };
    let points = |values: &[Estimate], name: &str| Curve {
        name: name.to_owned(),
        kind: LineKind::Points,
        shade: Shade::of_method(0),
        x: omega.clone(),
        y: values.iter().map(|v| v.value).collect(),
        band: Vec::new(),
        bars: values.iter().map(bar_ends).collect(),
    };
    let line = |(k, model): (usize, &ModelCurve), part: usize, y: Vec<f64>| {
        model.curve((line_kind(k), Shade::of_method(k + 1)), part, y)
    };
    let known: Vec<(f64, f64)> = omega.iter().copied().zip(phases.iter().map(|p| p.value)).collect();
    // The models precede the points, which are drawn over them.
    let mut magnitude: Vec<Curve> = models
        .iter()
        .enumerate()
        .map(|m| line(m, 0, m.1.magnitude_db()))
        .collect();
    magnitude.push(points(&magnitudes, name));
    let mut phase: Vec<Curve> = models
        .iter()
        .enumerate()
        .map(|m| line(m, 1, m.1.phase_deg(&known)))
        .collect();
    phase.push(points(&phases, name));
    let mut panels = vec![panel("magnitude", "dB", magnitude), panel("phase", "deg", phase)];
    let coherences: Vec<Estimate> = lines.iter().filter_map(|l| l.coherence).map(Estimate::fixed).collect();
    // If the excitation is not recorded, the coherence is between u and e and carries little information in a closed
    // loop.
    let shown = found.channel.is_some() && coherences.len() == omega.len();
    if let Some(chance) = chance_coherence(found.function.runs.len()).filter(|_| shown) {
        let ends = models.iter().flat_map(|m| m.omega_rad_s.iter()).chain(&omega);
        let (low, high) = ends.fold((f64::INFINITY, 0.0_f64), |(l, h), w| (l.min(*w), h.max(*w)));
        let level = Curve {
            name: "95 % limit for unrelated runs".to_owned(),
            kind: LineKind::Truth,
            shade: Shade::of_method(0),
            x: vec![low, high],
            y: vec![chance; 2],
            band: Vec::new(),
            bars: Vec::new(),
        };
        let mut coherence = panel("coherence", "", vec![points(&coherences, ""), level]);
        coherence.ordinate_range = Some((0.0, 1.05));
        panels.push(coherence);
    }
    let grid = CurveGrid {
        panels,
        columns: 1,
        titles: Vec::new(),
        abscissa: FREQUENCY_LABEL.to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: false,
    };
    curves(id, title, &grid)
}

/// The first model has a solid line; further models have dashed and dotted lines, so that coinciding curves stay
/// visible.
fn line_kind(model: usize) -> LineKind {
    match model {
        0 => LineKind::Line,
        1 => LineKind::Dashed,
        _ => LineKind::Dotted,
    }
}

/// Largest half length of an error bar, dB or deg. A phase with an error of half a turn is unknown, and a longer bar
/// would compress the scale for all other points.
const MAX_BAR_HALF_LENGTH: f64 = 180.0;

/// Half length of an error bar; NaN if the standard error is unknown.
fn bar_half_length(v: &Estimate) -> f64 {
    v.standard_error.map_or(f64::NAN, |s| Z_95 * s)
}

/// Ends of an error bar, truncated to the largest length.
fn bar_ends(v: &Estimate) -> (f64, f64) {
    let whole = bar_half_length(v);
    let half = if whole > MAX_BAR_HALF_LENGTH {
        MAX_BAR_HALF_LENGTH
    } else {
        whole
    };
    (v.value - half, v.value + half)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use hoid_ident::frequency::{RecordDescriptionOptions, describe_runs};
    use hoid_model::{Channel, Record, SampleTime};

    use super::*;

    /// `u(t) = 2 e(t - 0.3)` at lines from 1 to 23 times TAU/20 rad/s, with a different disturbance in each run.
    fn simulated_description(runs: u32) -> Description {
        let ts = SampleTime::new(0.1).unwrap();
        let wave = |t: f64| {
            [1.0, 4.0, 9.0, 23.0]
                .map(|h: f64| (TAU * h * t / 20.0 + h).sin())
                .iter()
                .sum::<f64>()
        };
        let record = |run: u32| {
            let t = |k: u32| 0.1 * f64::from(k);
            let rough = |k: u32| 0.2 * f64::from(run) * (f64::from(k * k) * 0.37 + f64::from(run)).sin();
            let e: Vec<f64> = (0..200).map(|k| wave(t(k))).collect();
            let u = (0..200).map(|k| 2.0 * wave(t(k) - 0.3) + rough(k)).collect();
            Record::new(ts, Channel::new("e", "", e.clone()), Channel::new("u", "", u))
                .and_then(|r| r.with_channel(Channel::new("d", "", e)))
                .unwrap()
        };
        let records: Vec<Record> = (0..runs).map(record).collect();
        describe_runs(&records, &RecordDescriptionOptions::default()).unwrap()
    }

    #[test]
    fn model_phase_is_unwrapped_to_the_points() {
        let found = simulated_description(4);
        let model = |turn: f64| {
            ModelCurve::over_frequencies(&found, 0.0, "m", 0.3, |w| Complex64::from_polar(2.0, turn - 0.3 * w))
        };
        let points: Vec<(f64, f64)> = found
            .function
            .lines
            .iter()
            .map(|l| (l.omega_rad_s, -(0.3 * l.omega_rad_s).to_degrees() + 720.0))
            .collect();
        for turn in [0.0, TAU, -3.0 * TAU] {
            let model = model(turn);
            for (phase, omega) in model.phase_deg(&points).iter().zip(&model.omega_rad_s) {
                assert!((phase - 720.0 + (0.3 * omega).to_degrees()).abs() < 1e-9);
            }
        }
        assert!(model(0.0).phase_deg(&[]).iter().all(|p| *p < 0.0));
        let empty = ModelCurve {
            omega_rad_s: Vec::new(),
            response: Vec::new(),
            standard_errors: Vec::new(),
            ..model(0.0)
        };
        assert!(empty.phase_deg(&points).is_empty());
    }

    #[test]
    fn model_band_is_drawn() {
        let found = simulated_description(4);
        let of = |error: Option<f64>| {
            ModelCurve::with_band(&found, 0.0, "m", 0.3, |omega| {
                let point = |&omega_rad_s: &f64| ResponsePoint {
                    omega_rad_s,
                    magnitude_db: Estimate {
                        value: 6.0,
                        standard_error: error,
                    },
                    phase_deg: Estimate {
                        value: -170.0,
                        standard_error: error.map(|e| 200.0 * e),
                    },
                };
                omega.iter().map(point).collect()
            })
        };
        let known = of(Some(1.0));
        assert!((known.response[0].norm() - 10.0_f64.powf(0.3)).abs() < 1e-12);
        assert!(
            known
                .band(0, &[6.0, 6.0])
                .iter()
                .all(|b| *b == (6.0 - Z_95, 6.0 + Z_95))
        );
        assert_eq!(known.band(1, &[0.0])[0], (-MAX_BAR_HALF_LENGTH, MAX_BAR_HALF_LENGTH));
        assert!(of(None).band(0, &[6.0])[0].0.is_nan());
        let drawn = |model: ModelCurve| describing("d", "t", &found, &[model]);
        assert_ne!(drawn(known), drawn(of(None)));
        assert!(!drawn(of(None)).contains("NaN"));
    }

    #[test]
    fn figure_has_points_models_and_coherence() {
        let found = simulated_description(4);
        let model = ModelCurve::over_frequencies(&found, 0.0, "gain and delay", 0.3, |w| {
            Complex64::from_polar(2.0, -0.3 * w)
        });
        let svg = describing("d", "t", &found, std::slice::from_ref(&model));
        for text in [
            "magnitude",
            "phase",
            "coherence",
            "gain and delay",
            "describing function",
            "unrelated runs",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, describing("d", "t", &found, &[model]));
        // A single run has neither errors nor coherence.
        let alone = describing("d", "t", &simulated_description(1), &[]);
        assert!(!alone.contains("coherence") && !alone.contains("NaN"));
    }

    #[test]
    fn curves_extend_beyond_the_last_line() {
        let found = simulated_description(4);
        let last = found.function.lines.last().unwrap().omega_rad_s;
        for (asked, reached) in [(0.0, 1.1 * last), (last, 1.1 * last), (3.0 * last, 3.0 * last)] {
            let curve = ModelCurve::over_frequencies(&found, asked, "m", 0.3, |_| Complex64::new(1.0, 0.0));
            assert!(
                (curve.omega_rad_s.last().unwrap() / reached - 1.0).abs() < 1e-12,
                "{asked}"
            );
        }
    }

    #[test]
    fn identical_models_are_all_visible() {
        let found = simulated_description(4);
        let model =
            |name: &str| ModelCurve::over_frequencies(&found, 0.0, name, 0.3, |w| Complex64::from_polar(2.0, -0.3 * w));
        let broken = |models: &[ModelCurve]| describing("d", "t", &found, models).matches("stroke-dasharray").count();
        let (none, one) = (broken(&[]), broken(&[model("a")]));
        let (two, three) = (broken(&[model("a"), model("b")]), broken(&["a", "b", "c"].map(model)));
        // Each model adds a line in two panels, and a legend sample.
        assert_eq!([one - none, two - one, three - two], [0, 3, 3]);
    }

    #[test]
    fn truncated_error_bars_are_noted() {
        let mut found = simulated_description(4);
        assert!(!describing("d", "t", &found, &[]).contains("cut at 180"));
        let line = &mut found.function.lines[0];
        line.standard_error = Some(10.0 * line.response.norm());
        assert!(describing("d", "t", &found, &[]).contains("cut at 180 deg"));
    }
}
