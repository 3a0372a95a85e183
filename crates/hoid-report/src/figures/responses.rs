//! Frequency responses to several inputs, one column each: magnitude and phase with their 95 % bands.

use hoid_ident::{ResponsePoint, frequency::unwrapped_deg};
use hoid_model::uncertainty::Estimate;

use super::{
    curves::{Curve, CurveGrid, CurvePanel, LineKind, curves},
    palette::Shade,
};
use crate::numbers::Z_95;

/// Largest half width of a band, dB or deg; a wider band would compress the scale of all curves.
const WIDEST: f64 = 60.0;

/// The response of a model to one of its inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct InputResponse {
    /// Title of its column.
    pub title: String,
    /// The response at frequencies in ascending order.
    pub points: Vec<ResponsePoint>,
    /// Delay removed for unwrapping the phase, s.
    pub delay_s: f64,
}

/// Responses to several inputs as one figure. `title` is the text for screen readers.
pub fn responses(id: &str, title: &str, inputs: &[InputResponse]) -> String {
    let panel = |(k, input): (usize, &InputResponse), is_phase: bool| {
        let omega: Vec<f64> = input.points.iter().map(|p| p.omega_rad_s).collect();
        let estimates: Vec<Estimate> = match is_phase {
            false => input.points.iter().map(|p| p.magnitude_db).collect(),
            true => {
                let principal = input.points.iter().map(|p| p.phase_deg.value);
                let pairs: Vec<(f64, f64)> = omega.iter().copied().zip(principal).collect();
                let phase = unwrapped_deg(&pairs, input.delay_s);
                let errors = input.points.iter().map(|p| p.phase_deg.standard_error);
                let both = phase.into_iter().zip(errors);
                both.map(|(value, standard_error)| Estimate { value, standard_error })
                    .collect()
            }
        };
        let band = |e: &Estimate| {
            let half = e.standard_error.map_or(f64::NAN, |s| (Z_95 * s).min(WIDEST));
            (e.value - half, e.value + half)
        };
        let has_band = estimates.iter().any(|e| e.standard_error.is_some());
        CurvePanel {
            name: if is_phase { "phase" } else { "magnitude" }.to_owned(),
            unit: if is_phase { "deg" } else { "dB" }.to_owned(),
            curves: vec![Curve {
                name: String::new(),
                kind: LineKind::Line,
                shade: Shade::of_method(k + 1),
                x: omega,
                band: match has_band {
                    true => estimates.iter().map(band).collect(),
                    false => Vec::new(),
                },
                y: estimates.iter().map(|e| e.value).collect(),
                bars: Vec::new(),
            }],
            ..CurvePanel::default()
        }
    };
    let row = |is_phase: bool| inputs.iter().enumerate().map(move |input| panel(input, is_phase));
    let grid = CurveGrid {
        panels: row(false).chain(row(true)).collect(),
        columns: inputs.len(),
        titles: inputs.iter().map(|input| input.title.clone()).collect(),
        abscissa: "frequency \u{3c9} (rad/s)".to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: false,
    };
    curves(id, title, &grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_input_has_its_column() {
        let points = |gain: f64, standard_error: Option<f64>| {
            let of = |omega: f64| ResponsePoint {
                omega_rad_s: omega,
                magnitude_db: Estimate {
                    value: gain - 20.0 * omega.log10(),
                    standard_error,
                },
                phase_deg: Estimate {
                    value: (-90.0 - 60.0 * omega + 180.0).rem_euclid(360.0) - 180.0,
                    standard_error,
                },
            };
            [0.5, 1.0, 2.0, 4.0, 8.0].map(of).to_vec()
        };
        let input = |title: &str, standard_error| InputResponse {
            title: title.to_owned(),
            points: points(3.0, standard_error),
            delay_s: 60f64.to_radians(),
        };
        let svg = responses("two", "both", &[input("to e", Some(0.5)), input("to r", None)]);
        assert!(svg.contains("to e") && svg.contains("to r"), "{svg}");
        // The phase is continuous: -90 - 60 * 8 deg at the end.
        assert!(svg.contains("\u{2212}360") || svg.contains("-360"), "{svg}");
        let empty = responses("none", "none", &[]);
        assert!(empty.contains("<svg"));
    }
}
