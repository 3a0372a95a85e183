//! Bode diagrams: magnitude and phase of models with their 95 % bands, and of the true operator if it is known.
//!
//! The estimators identify the operator including the zero-order hold of the sampling, `B q^-nk/(A F)`. The true
//! response is drawn with the same hold, so the curves coincide if the parameters agree. Before the phase is unwrapped,
//! the phase of the delay, `nk Ts omega`, is removed because it dominates; it is added back afterwards.

use std::f64::consts::TAU;

use hoid_ident::{Fit, ResponsePoint, frequency::unwrapped_deg};
use hoid_model::{Complex64, OperatorParameters, PolynomialModel, Record, SampleTime, Structure};
use kuva::prelude::{BandPlot, Plot};

use super::{
    bode_points::BodePoints,
    frame::Area,
    legend::{Entry, Sample, add_legend},
    scale::Scale,
    style::{self, BLACK, MODEL_COLOURS},
    svg,
};
use crate::numbers::Z_95;

const MAGNITUDE_HEIGHT: f64 = 175.0;
const PHASE_HEIGHT: f64 = 205.0;

const MAGNITUDE_STEPS: [f64; 5] = [1.0, 2.0, 5.0, 10.0, 20.0];
const MAX_STEP_COUNT: f64 = 6.5;
const PHASE_STEPS: [f64; 6] = [15.0, 30.0, 45.0, 90.0, 180.0, 360.0];

/// Number of frequencies of a curve.
const POINT_COUNT: usize = 240;
/// Lowest frequency of manual control (rad/s), followed by the highest; on an axis from 0.1 to 50 rad/s there are ticks
/// at 1, 2 and 5 in each decade.
const MIN_OMEGA_RAD_S: f64 = 0.1;
const MAX_OMEGA_RAD_S: f64 = 50.0;
/// Displayed range of the phase, deg. Below this range the phase of a dead time decreases without bound and is not
/// relevant to the closed loop.
const PHASE_RANGE_DEG: (f64, f64) = (-540.0, 270.0);

/// A model that is drawn in a Bode diagram.
#[derive(Debug, Clone, Copy)]
pub struct BodeModel<'a> {
    /// Name of the model in the legend.
    pub name: &'a str,
    /// The fitted model.
    pub fit: &'a Fit,
    /// The records of the fit; the longest record determines the lowest frequency.
    pub records: &'a [Record],
}

/// A true operator that is drawn in a Bode diagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueResponse {
    /// Parameters of the operator.
    pub operator: OperatorParameters,
    /// Sample time of the hold.
    pub sample_time: SampleTime,
}

/// Draws the magnitude in dB and the phase in deg over frequency in rad/s. The lower end of the abscissa is 0.1 rad/s
/// or, if that is higher, the lowest frequency that the longest record resolves; the upper end is 50 rad/s or, if that
/// is lower, the Nyquist frequency.
///
/// Bands extend 1.96 standard errors to either side; a model without standard errors has no band. A true response that
/// no discrete model represents (with a fractional delay) is drawn without the hold.
pub fn bode(id: &str, models: &[BodeModel<'_>], truths: &[TrueResponse]) -> String {
    bode_with_points(id, models, truths, &[])
}

/// Draws the figure of [`bode`] with additional points, such as a describing function of the same records, with error
/// bars of 1.96 standard errors. The axes extend below the frequencies of the curves if there are points at lower
/// frequencies. The first set of points is black; further sets have colours that no model has.
pub fn bode_with_points(id: &str, models: &[BodeModel<'_>], truths: &[TrueResponse], points: &[BodePoints]) -> String {
    let points: Vec<BodePoints> = points.iter().map(BodePoints::drawable_points).collect();
    let omega = frequencies(models, &points);
    let mut curves: Vec<(Curve, &str)> = Vec::new();
    for (i, model) in models.iter().enumerate() {
        let delay_s = model.fit.orders().nk as f64 * model.fit.model().sample_time().s();
        let curve = Curve::of_model(&model.fit.frequency_response(&omega), delay_s);
        curves.push((curve, MODEL_COLOURS[i % MODEL_COLOURS.len()]));
    }
    let truths: Vec<Curve> = truths.iter().map(|t| Curve::of_truth(t, &omega)).collect();

    let first: Option<Vec<f64>> = curves
        .iter()
        .map(|(c, _)| c)
        .chain(&truths)
        .next()
        .map(|c| c.phase_deg.iter().map(|p| p.0).collect());
    let points: Vec<BodePoints> = points
        .into_iter()
        .map(|p| p.shift_to_branch_of(first.as_deref().map(|phase| (&omega[..], phase))))
        .collect();

    let limits = (omega[0], omega[omega.len() - 1]);
    let mut panels = Vec::new();
    let mut scales = Vec::new();
    for is_phase in [false, true] {
        let series = |c: &Curve| {
            if is_phase {
                c.phase_deg.iter().map(|p| (phase_or_gap(p.0), p.1)).collect()
            } else {
                c.magnitude_db.clone()
            }
        };
        let all = curves.iter().map(|(c, _)| c).chain(&truths);
        let of_points = |p: &BodePoints| -> Vec<f64> {
            BodePoints::values_and_bar_ends(if is_phase { &p.phase_deg } else { &p.magnitude_db }).collect()
        };
        let values = all.flat_map(|c| series(c).into_iter().map(|p| p.0));
        let (low, high) = style::padded_range(values.chain(points.iter().flat_map(of_points)));
        let room = 0.05 * (high - low);
        let step = tick_step(
            high - low + 2.0 * room,
            if is_phase { &PHASE_STEPS } else { &MAGNITUDE_STEPS },
        );
        let range = (
            ((low - room) / step).floor() * step,
            ((high + room) / step).ceil() * step,
        );
        let mut plots: Vec<Plot> = Vec::new();
        for (curve, colour) in &curves {
            plots.extend(band(&omega, &series(curve), range, colour));
        }
        for (curve, colour) in &curves {
            let points = omega.iter().copied().zip(series(curve).into_iter().map(|p| p.0));
            plots.push(style::line(points, colour, 1.6).into());
        }
        for truth in &truths {
            let points = omega.iter().copied().zip(series(truth).into_iter().map(|p| p.0));
            plots.push(style::line(points, BLACK, 1.4).with_dashed().into());
        }
        let height = if is_phase { PHASE_HEIGHT } else { MAGNITUDE_HEIGHT };
        let layout = style::layout(limits, range, height).with_log_x().with_y_tick_step(step);
        let layout = if is_phase {
            layout
                .with_y_label("phase (deg)")
                .with_x_label("frequency \u{3c9} (rad/s)")
        } else {
            layout
                .with_y_label("magnitude (dB)")
                .with_force_margins_y(style::TOP_MARGIN, style::BOTTOM_MARGIN_WITHOUT_LABEL)
        };
        // A figure that contains only points still needs axes.
        if plots.is_empty() {
            plots.push(style::line([], BLACK, 1.0).into());
        }
        let (top, below) = if is_phase {
            (MAGNITUDE_HEIGHT, style::BOTTOM_MARGIN)
        } else {
            (0.0, style::BOTTOM_MARGIN_WITHOUT_LABEL)
        };
        scales.push(Scale {
            area: Area {
                left: style::LEFT_MARGIN,
                top: top + style::TOP_MARGIN,
                width: style::WIDTH - style::LEFT_MARGIN - style::RIGHT_MARGIN,
                height: height - style::TOP_MARGIN - below,
            },
            x: limits,
            y: range,
            log_x: true,
            log_y: false,
        });
        panels.push((plots, layout, height));
    }
    let mut entries: Vec<_> = models
        .iter()
        .zip(&curves)
        .map(|(m, (_, colour))| Entry::new(m.name, colour, Sample::Line))
        .collect();
    if !truths.is_empty() {
        entries.push(Entry::new("true operator", BLACK, Sample::Dashed));
    }
    let mut scene = style::stack_panels(panels);
    for (i, set) in points.iter().enumerate() {
        let colour = match i {
            0 => BLACK,
            _ => MODEL_COLOURS[(models.len() + i - 1) % MODEL_COLOURS.len()],
        };
        set.draw(&mut scene, &scales[0], &set.magnitude_db, colour);
        set.draw(&mut scene, &scales[1], &set.phase_deg, colour);
        entries.push(Entry::new(&set.name, colour, Sample::Point));
    }
    add_legend(&mut scene, &entries);
    svg::finish(id, "Frequency response with 95 % bands", scene)
}

/// Returns a phase within the displayed range; NaN, which becomes a gap, for any other phase.
fn phase_or_gap(phase_deg: f64) -> f64 {
    let (low, high) = PHASE_RANGE_DEG;
    if (low..=high).contains(&phase_deg) {
        phase_deg
    } else {
        f64::NAN
    }
}

fn frequencies(models: &[BodeModel<'_>], points: &[BodePoints]) -> Vec<f64> {
    let nyquist = models
        .iter()
        .map(|m| m.fit.model().sample_time().nyquist_rad_s())
        .fold(f64::INFINITY, f64::min);
    let high = nyquist.min(MAX_OMEGA_RAD_S);
    let longest_s = models
        .iter()
        .flat_map(|m| m.records)
        .map(|r| r.len() as f64 * r.sample_time().s())
        .fold(0.0, f64::max);
    let low = (TAU / longest_s).max(MIN_OMEGA_RAD_S).min(high / 10.0);
    // A point at the edge of the axes would be cut in half.
    let below = points.iter().flat_map(|p| &p.omega_rad_s).map(|w| w / 1.1);
    let low = below.filter(|w| *w > 1e-6 * high).fold(low, f64::min);
    let ratio = (high / low).ln() / (POINT_COUNT - 1) as f64;
    (0..POINT_COUNT).map(|i| low * (ratio * i as f64).exp()).collect()
}

/// Values and standard errors of the magnitude and the phase over frequency.
struct Curve {
    magnitude_db: Vec<(f64, Option<f64>)>,
    phase_deg: Vec<(f64, Option<f64>)>,
}

impl Curve {
    fn of_model(response: &[ResponsePoint], delay_s: f64) -> Self {
        let phases: Vec<(f64, f64)> = response.iter().map(|p| (p.omega_rad_s, p.phase_deg.value)).collect();
        let unwrapped = unwrapped_deg(&phases, delay_s);
        Self {
            magnitude_db: response
                .iter()
                .map(|p| (p.magnitude_db.value, p.magnitude_db.standard_error))
                .collect(),
            phase_deg: unwrapped
                .into_iter()
                .zip(response)
                .map(|(phase, p)| (phase, p.phase_deg.standard_error))
                .collect(),
        }
    }

    fn of_truth(truth: &TrueResponse, omega: &[f64]) -> Self {
        let discrete = truth.operator.discretise(truth.sample_time).ok().and_then(|d| {
            let orders = Structure::BoxJenkins.operator_orders(d.nk);
            let theta = [d.zoh.b0, d.zoh.b1, 0.0, d.zoh.f1, d.zoh.f2];
            PolynomialModel::new(Structure::BoxJenkins, orders, truth.sample_time, theta.to_vec()).ok()
        });
        let continuous = truth.operator.transfer_function().ok();
        let (delay_s, response): (f64, Vec<Complex64>) = match (&discrete, &continuous) {
            (Some(model), _) => (
                model.orders().nk as f64 * truth.sample_time.s(),
                omega.iter().map(|&w| model.response(w)).collect(),
            ),
            (None, Some(h)) => (h.delay_s(), omega.iter().map(|&w| h.response(w)).collect()),
            (None, None) => (0.0, Vec::new()),
        };
        let phases: Vec<(f64, f64)> = omega
            .iter()
            .zip(&response)
            .map(|(&w, h)| (w, h.arg().to_degrees()))
            .collect();
        Self {
            magnitude_db: response.iter().map(|h| (20.0 * h.norm().log10(), None)).collect(),
            phase_deg: unwrapped_deg(&phases, delay_s).into_iter().map(|p| (p, None)).collect(),
        }
    }
}

/// Returns the first element of `steps` that gives at most eight ticks over `span`; if there is none, a multiple of the
/// last element.
fn tick_step(span: f64, steps: &[f64]) -> f64 {
    let largest = steps.last().copied().unwrap_or(1.0);
    let enough = |step: &&f64| span / **step <= MAX_STEP_COUNT;
    steps
        .iter()
        .find(enough)
        .copied()
        .unwrap_or_else(|| largest * (span / (MAX_STEP_COUNT * largest)).ceil())
}

/// The 95 % band, limited to the range of the figure; `None` without standard errors.
fn band(omega: &[f64], curve: &[(f64, Option<f64>)], (low, high): (f64, f64), colour: &str) -> Option<Plot> {
    let known: Vec<(f64, f64, f64)> = omega
        .iter()
        .zip(curve)
        .filter_map(|(&w, &(value, error))| {
            let reach = Z_95 * error?;
            let cut = |v: f64| v.clamp(low, high);
            (value.is_finite() && reach.is_finite()).then(|| (w, cut(value - reach), cut(value + reach)))
        })
        .collect();
    (known.len() > 1).then(|| {
        BandPlot::new(
            known.iter().map(|k| k.0),
            known.iter().map(|k| k.1),
            known.iter().map(|k| k.2),
        )
        .with_color(colour)
        .with_opacity(0.22)
        .into()
    })
}

#[cfg(test)]
mod tests {
    use hoid_model::scenario::OperatingState;

    use super::*;

    #[test]
    fn long_delay_does_not_stretch_the_phase_axis() {
        let truth = |tau_e_s: f64| TrueResponse {
            operator: OperatorParameters {
                tau_e_s,
                ..OperatingState::s1().operator
            },
            sample_time: SampleTime::AT_100_HZ,
        };
        // A delay of 0.5 s gives four turns of phase at 50 rad/s.
        let figure = bode("b", &[], &[truth(0.5)]);
        let has = |tick: &str| figure.contains(&format!(">{tick}<"));
        assert!(has("-540") && !has("-720") && !has("-900"), "{figure}");
        assert!(bode("b", &[], &[truth(0.1)]).contains("<path"));
    }

    #[test]
    fn held_true_operator_matches_continuous_at_low_frequency() {
        let truth = TrueResponse {
            operator: OperatingState::s1().operator,
            sample_time: SampleTime::AT_100_HZ,
        };
        let curve = Curve::of_truth(&truth, &[0.01, 5.0]);
        // The magnitude is K_e in dB; at 5 rad/s the half-sample delay of the hold adds 1.4 deg of phase lag.
        assert!((curve.magnitude_db[0].0 - 20.0 * 0.09_f64.log10()).abs() < 1e-3);
        let h = truth.operator.transfer_function().unwrap().response(5.0);
        let half_sample_deg = (5.0_f64 * 0.005).to_degrees();
        assert!((curve.phase_deg[1].0 - (h.arg().to_degrees() - half_sample_deg)).abs() < 0.05);
        assert!((curve.magnitude_db[1].0 - 20.0 * h.norm().log10()).abs() < 0.01);
    }
}
