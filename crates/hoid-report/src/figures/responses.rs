//! Frequency responses to several inputs, one column each: magnitude and phase with their 95 % bands.

use super::{
    curves::{Curve, CurveGrid, CurvePanel, LineKind, curves},
    describing::{FREQUENCY_LABEL, ModelCurve, panel},
    palette::Shade,
};

/// Draws the responses to several inputs as one figure; the name of each is the title of its column. `title` is the
/// text for screen readers.
pub fn responses(id: &str, title: &str, inputs: &[ModelCurve]) -> String {
    let curve = |(k, input): (usize, &ModelCurve), part: usize, y: Vec<f64>| Curve {
        // The name is the title of the column, so the curve has no name.
        name: String::new(),
        ..input.curve((LineKind::Line, Shade::of_method(k + 1)), part, y)
    };
    let magnitudes = (inputs.iter().enumerate())
        .map(|input| panel("magnitude", "dB", vec![curve(input, 0, input.1.magnitude_db())]));
    let phases =
        (inputs.iter().enumerate()).map(|input| panel("phase", "deg", vec![curve(input, 1, input.1.phase_deg(&[]))]));
    let panels: Vec<CurvePanel> = magnitudes.chain(phases).collect();
    let grid = CurveGrid {
        panels,
        columns: inputs.len(),
        titles: inputs.iter().map(|input| input.name.clone()).collect(),
        abscissa: FREQUENCY_LABEL.to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: false,
    };
    curves(id, title, &grid)
}

#[cfg(test)]
mod tests {
    use hoid_ident::ResponsePoint;
    use hoid_model::uncertainty::Estimate;

    use super::*;

    #[test]
    fn each_input_has_a_column() {
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
        let input = |title: &str, standard_error| {
            ModelCurve::of_points(title, 60f64.to_radians(), &points(3.0, standard_error))
        };
        let svg = responses("two", "both", &[input("to e", Some(0.5)), input("to r", None)]);
        assert!(svg.contains("to e") && svg.contains("to r"), "{svg}");
        // The phase is continuous and ends at -90 - 60 * 8 deg.
        assert!(svg.contains("\u{2212}360") || svg.contains("-360"), "{svg}");
        let empty = responses("none", "none", &[]);
        assert!(empty.contains("<svg"));
    }
}
