//! Figures of a designed experiment: the forcing function with the response of the person, and the expected errors as
//! functions of the number of runs.

use hoid_design::experiment::{
    DesignedLine, EntryPoint, Expected, ExpectedResponse, ExperimentDesign, has_absolute_error,
};
use hoid_model::{numbers::count_with_noun, uncertainty::Estimate};

use crate::{
    figures::{Curve, CurveGrid, CurvePanel, LineKind, Shade, curves},
    numbers::Z_95,
};

/// Draws the amplitudes of the lines and the gain and phase of the person. The curve of the operator has a 95 % band,
/// and the response at each line has a 95 % error bar; both are expected from all runs together. If the target is
/// displayed, the response to it is drawn in the same way.
pub fn design_figure(design: &ExperimentDesign) -> String {
    let is_seen = design.task.feedforward.is_some();
    let amplitude = |(shade, enters): (usize, EntryPoint)| {
        let own: Vec<&DesignedLine> = design.lines.iter().filter(|l| l.enters == enters).collect();
        let name = if is_seen { enters.name() } else { "" };
        Curve {
            kind: LineKind::Stems,
            ..curve(
                name,
                shade,
                own.iter().map(|l| l.line.omega_rad_s).collect(),
                own.iter().map(|l| l.line.amplitude_deg).collect(),
            )
        }
    };
    let points = [(0, EntryPoint::Target), (1, EntryPoint::Disturbance)].into_iter();
    let there = points.filter(|(_, enters)| design.lines.iter().any(|l| l.enters == *enters));
    let amplitudes = match is_seen {
        true => there.map(amplitude).collect(),
        false => there.map(|(_, enters)| amplitude((0, enters))).collect(),
    };
    let of_target = |l: &&DesignedLine| is_seen && l.enters == EntryPoint::Target;
    let (target, error): (Vec<&DesignedLine>, Vec<&DesignedLine>) = design.lines.iter().partition(of_target);
    let of_error = if is_seen { "of B " } else { "" };
    let mut panels = vec![panel("amplitude", "", amplitudes)];
    panels.extend(response_panels(of_error, &design.response, &error));
    if is_seen {
        panels.extend(response_panels("of F ", &design.response_to_target, &target));
    }
    let grid = CurveGrid {
        panels,
        columns: 1,
        abscissa: "frequency \u{3c9} (rad/s)".to_owned(),
        logarithmic_abscissa: true,
        ..CurveGrid::default()
    };
    let title = format!(
        "the forcing function, and the response of {} with the errors expected from {} of {} s",
        design.person,
        count_with_noun(design.runs, "run"),
        design.length_s
    );
    curves("design", &title, &grid)
}

/// Panels of the gain and phase of a response: the operator as a curve with its band, and the response at each line
/// with its error bar.
fn response_panels(of: &str, between: &[ExpectedResponse], at: &[&DesignedLine]) -> [CurvePanel; 2] {
    let one = |name: &str, unit: &str, part: fn(&ExpectedResponse) -> Estimate| {
        let band: Vec<Estimate> = between.iter().map(part).collect();
        let points: Vec<Estimate> = at.iter().map(|l| part(&l.response)).collect();
        let values = |all: &[Estimate]| all.iter().map(|e| e.value).collect::<Vec<f64>>();
        let operator = Curve {
            band: band.iter().map(interval).collect(),
            ..curve(
                "operator, band 95 %",
                1,
                between.iter().map(|r| r.omega_rad_s).collect(),
                values(&band),
            )
        };
        let at_lines = Curve {
            kind: LineKind::Points,
            bars: points.iter().map(interval).collect(),
            ..curve(
                "single line, bars 95 %",
                0,
                at.iter().map(|l| l.line.omega_rad_s).collect(),
                values(&points),
            )
        };
        panel(format!("{name} {of}").trim_end(), unit, vec![operator, at_lines])
    };
    [one("gain", "dB", |r| r.gain_db), one("phase", "deg", |r| r.phase_deg)]
}

/// Smallest upper end of the abscissa, in runs.
const MIN_RUNS: usize = 8;
/// Largest upper end of the abscissa, in runs.
const MAX_RUNS: usize = 200;

/// Draws the expected errors as functions of the number of runs: relative to the accepted errors, or in percent of the
/// values if no accepted errors are given. A second panel shows the number of people needed to detect a planned
/// difference.
pub fn runs_figure(design: &ExperimentDesign) -> String {
    let last = (2 * design.runs_needed).max(design.runs).clamp(MIN_RUNS, MAX_RUNS);
    let runs: Vec<f64> = (1..=last).map(|runs| runs as f64).collect();
    let of_one = |expected: &Expected| expected.clone().scaled((design.runs as f64).sqrt());
    let falling = |error: f64| runs.iter().map(|n| error / n.sqrt()).collect::<Vec<f64>>();
    let mut errors: Vec<Curve> = Vec::new();
    let mut people = vec![("", &design.expected, LineKind::Line)];
    people.extend(
        design
            .worst
            .as_ref()
            .map(|w| (w.name.as_str(), &w.expected, LineKind::Dashed)),
    );
    for (who, expected, kind) in people {
        let one = of_one(expected);
        for (k, (name, scale)) in scaled_quantities(design).iter().enumerate() {
            let Some(error) = one.error(name).filter(|e| e.is_finite()) else {
                continue;
            };
            let label = match who {
                "" => name.clone(),
                who => format!("{name}, {who}"),
            };
            errors.push(Curve {
                kind,
                ..curve(&label, k, runs.clone(), falling(error * scale))
            });
        }
    }
    let mut panels = match design.wanted.is_empty() {
        true => vec![panel("relative error", "%", errors)],
        false => {
            errors.push(Curve {
                kind: LineKind::Truth,
                ..curve("accepted", 0, vec![1.0, last as f64], vec![1.0; 2])
            });
            vec![panel("error / accepted", "", errors)]
        }
    };
    panels[0].logarithmic = true;
    if let Some(plan) = &design.difference {
        let known: Vec<(f64, f64)> = plan
            .rows
            .iter()
            .filter_map(|row| Some((row.runs as f64, row.people? as f64)))
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = known.into_iter().unzip();
        let most = 1.1 * y.iter().copied().fold(1.0, f64::max);
        let people = Curve {
            kind: LineKind::Points,
            ..curve("", 0, x, y)
        };
        panels.push(CurvePanel {
            ordinate_range: Some((0.0, most)),
            ..panel("people", "", vec![people])
        });
    }
    let grid = CurveGrid {
        panels,
        columns: 1,
        abscissa: "runs of a person".to_owned(),
        ..CurveGrid::default()
    };
    curves("runs", "expected errors by number of runs", &grid)
}

/// The quantities of the figure, each with the factor that scales its error.
fn scaled_quantities(design: &ExperimentDesign) -> Vec<(String, f64)> {
    if !design.wanted.is_empty() {
        return design.wanted.iter().map(|w| (w.name.clone(), 1.0 / w.error)).collect();
    }
    let names = design.expected.names().into_iter();
    names
        .filter(|name| !has_absolute_error(name))
        .map(|name| (name.to_owned(), 100.0))
        .collect()
}

fn interval(e: &Estimate) -> (f64, f64) {
    let half = e.standard_error.map_or(f64::NAN, |s| Z_95 * s);
    (e.value - half, e.value + half)
}

fn curve(name: &str, shade: usize, x: Vec<f64>, y: Vec<f64>) -> Curve {
    Curve {
        name: name.to_owned(),
        kind: LineKind::Line,
        shade: Shade::of_method(shade),
        x,
        y,
        band: Vec::new(),
        bars: Vec::new(),
    }
}

fn panel(name: &str, unit: &str, curves: Vec<Curve>) -> CurvePanel {
    CurvePanel {
        name: name.to_owned(),
        unit: unit.to_owned(),
        curves,
        ..CurvePanel::default()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_design::experiment::{DesignRequest, DifferenceRequest};
    use hoid_model::family_scenario::Display;

    use super::*;

    #[test]
    fn design_figures_are_complete() {
        let request = DesignRequest {
            controlled_element: Some("4/s".parse().unwrap()),
            difference: Some(DifferenceRequest::new("crossover=10%".parse().unwrap())),
            ..DesignRequest::default()
        };
        let mut design = request.run().unwrap();
        let figure = design_figure(&design);
        // Each line has a stem and two bars with caps.
        assert!(figure.matches("<circle").count() >= 3 * design.lines.len() && !figure.contains("NaN"));
        let runs = runs_figure(&design);
        assert!(runs.contains("tau") && runs.contains("relative error") && !runs.contains("NaN"));
        assert!(!figure.contains("gain of F"));
        let pursuit = DesignRequest {
            display: Display::Pursuit,
            ..request.clone()
        };
        let both = design_figure(&pursuit.run().unwrap());
        for name in ["gain of B", "phase of F", "target", "disturbance"] {
            assert!(both.contains(name) && !both.contains("NaN"), "{name}");
        }
        design.wanted = vec!["crossover=3%".parse().unwrap()];
        assert!(runs_figure(&design).contains("accepted"));
    }
}
