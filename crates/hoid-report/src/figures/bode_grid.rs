//! Bode diagrams next to each other: in each column magnitude in dB above phase in deg, with several curves and the
//! true response.
//!
//! The delay is removed before the phase is unwrapped, as in [`super::bode`].

use hoid_ident::frequency::unwrapped_deg;
use hoid_model::{Complex64, uncertainty::Estimate};

use super::{
    bode_points::BodePoints,
    curves::{Curve, CurveGrid, CurvePanel, LineKind, curves},
    palette::Shade,
};
use crate::numbers::Z_95;

/// A frequency response in a Bode diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct BodeCurve {
    /// Name in the legend; empty for no entry. Entries with equal name and style appear only once.
    pub name: String,
    /// Line style; [`LineKind::Truth`] for the reference response.
    pub kind: LineKind,
    /// Colour of the curve.
    pub shade: Shade,
    /// Frequencies (rad/s) in ascending order.
    pub omega_rad_s: Vec<f64>,
    /// Magnitude in dB at each frequency. Non-finite values leave gaps.
    pub magnitude_db: Vec<f64>,
    /// Phase in deg at each frequency; full turns may be added or missing.
    pub phase_deg: Vec<f64>,
    /// Lower and upper edges of the band of the magnitude (dB); empty if there is no band.
    pub magnitude_band: Vec<(f64, f64)>,
    /// Lower and upper edges of the band of the phase (deg), on the branch of the phase; empty if there is no band.
    pub phase_band: Vec<(f64, f64)>,
    /// Lower and upper ends of the error bar of each magnitude (dB); empty if there are no error bars.
    pub magnitude_bars: Vec<(f64, f64)>,
    /// Lower and upper ends of the error bar of each phase (deg), on the branch of the phase; empty if there are no
    /// error bars.
    pub phase_bars: Vec<(f64, f64)>,
    /// Delay removed while the phase is unwrapped (s): the delay of the model, or zero.
    pub delay_s: f64,
}

impl BodeCurve {
    /// Creates a curve without a band from complex values.
    pub fn of_response(
        name: &str,
        kind: LineKind,
        shade: Shade,
        omega_rad_s: &[f64],
        response: &[Complex64],
        delay_s: f64,
    ) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            shade,
            omega_rad_s: omega_rad_s.to_vec(),
            magnitude_db: response.iter().map(|h| 20.0 * h.norm().log10()).collect(),
            phase_deg: response.iter().map(|h| h.arg().to_degrees()).collect(),
            magnitude_band: Vec::new(),
            phase_band: Vec::new(),
            magnitude_bars: Vec::new(),
            phase_bars: Vec::new(),
            delay_s,
        }
    }

    /// Creates a curve that consists of points, with error bars of 1.96 standard errors where a standard error is
    /// known.
    pub fn of_points(points: &BodePoints, shade: Shade) -> Self {
        let ends = |values: &[Estimate]| {
            let bar = |v: &Estimate| {
                v.standard_error
                    .map_or((f64::NAN, f64::NAN), |s| (v.value - Z_95 * s, v.value + Z_95 * s))
            };
            values.iter().map(bar).collect()
        };
        Self {
            name: points.name.clone(),
            kind: LineKind::Points,
            shade,
            omega_rad_s: points.omega_rad_s.clone(),
            magnitude_db: points.magnitude_db.iter().map(|v| v.value).collect(),
            phase_deg: points.phase_deg.iter().map(|v| v.value).collect(),
            magnitude_band: Vec::new(),
            phase_band: Vec::new(),
            magnitude_bars: ends(&points.magnitude_db),
            phase_bars: ends(&points.phase_deg),
            delay_s: points.delay_s,
        }
    }

    fn curve(&self, y: Vec<f64>, band: Vec<(f64, f64)>, bars: Vec<(f64, f64)>) -> Curve {
        Curve {
            name: self.name.clone(),
            kind: self.kind,
            shade: self.shade,
            x: self.omega_rad_s.clone(),
            y,
            band,
            bars,
        }
    }

    fn magnitude(&self) -> Curve {
        self.curve(
            self.magnitude_db.clone(),
            self.magnitude_band.clone(),
            self.magnitude_bars.clone(),
        )
    }

    fn phase(&self) -> Curve {
        let pairs = self.omega_rad_s.iter().copied().zip(self.phase_deg.iter().copied());
        let pairs: Vec<(f64, f64)> = pairs.collect();
        let delay_s = if self.delay_s.is_finite() { self.delay_s } else { 0.0 };
        let unwrapped = unwrapped_deg(&pairs, delay_s);
        let turned: Vec<f64> = unwrapped.iter().zip(&pairs).map(|(to, (_, from))| to - from).collect();
        let moved = |ends: &[(f64, f64)]| -> Vec<(f64, f64)> {
            let pairs = ends.iter().zip(&turned);
            pairs.map(|((low, high), turn)| (low + turn, high + turn)).collect()
        };
        let (band, bars) = (moved(&self.phase_band), moved(&self.phase_bars));
        self.curve(unwrapped, band, bars)
    }
}

/// One column of Bode diagrams.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodeColumn {
    /// Title; empty for no title. `_` and `^` mark subscripts and superscripts of one character, or of several in
    /// braces.
    pub title: String,
    /// Curves of the column.
    pub curves: Vec<BodeCurve>,
}

/// Bode diagrams next to each other, with common ordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodeGrid {
    /// The columns. A figure with a single column has the width of a text column; a figure with several has the width
    /// of a page.
    pub columns: Vec<BodeColumn>,
}

/// Draws magnitude above phase, over a logarithmic frequency axis in rad/s, as one figure. `title` is the text for
/// screen readers.
pub fn bode_grid(id: &str, title: &str, grid: &BodeGrid) -> String {
    let row = |name: &str, unit: &str, of: fn(&BodeCurve) -> Curve| -> Vec<CurvePanel> {
        let panel = |column: &BodeColumn| CurvePanel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            curves: column.curves.iter().map(of).collect(),
            ..CurvePanel::default()
        };
        grid.columns.iter().map(panel).collect()
    };
    let mut panels = row("magnitude", "dB", BodeCurve::magnitude);
    panels.extend(row("phase", "deg", BodeCurve::phase));
    let titles: Vec<String> = grid.columns.iter().map(|c| c.title.clone()).collect();
    let titled = titles.iter().any(|t| !t.is_empty());
    let curve_grid = CurveGrid {
        panels,
        columns: grid.columns.len(),
        titles: if titled { titles } else { Vec::new() },
        abscissa: "frequency \u{3c9} (rad/s)".to_owned(),
        logarithmic_abscissa: true,
        shared_ordinates: true,
    };
    curves(id, title, &curve_grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delayed(delay_s: f64) -> BodeCurve {
        let omega: Vec<f64> = (1..=60).map(f64::from).collect();
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| Complex64::from_polar(10.0, -delay_s * w))
            .collect();
        BodeCurve::of_response("d", LineKind::Line, Shade::of_method(0), &omega, &response, delay_s)
    }

    #[test]
    fn phase_band_is_unwrapped_with_the_phase() {
        let mut curve = delayed(0.3);
        curve.phase_band = curve.phase_deg.iter().map(|p| (p - 5.0, p + 7.0)).collect();
        let phase = curve.phase();
        for (k, w) in curve.omega_rad_s.iter().enumerate() {
            let expected = -(0.3 * w).to_degrees();
            assert!((phase.y[k] - expected).abs() < 1e-9);
            assert!((phase.band[k].0 - expected + 5.0).abs() < 1e-9);
            assert!((phase.band[k].1 - expected - 7.0).abs() < 1e-9);
        }
        assert!(curve.magnitude().y.iter().all(|m| (m - 20.0).abs() < 1e-12));
    }

    #[test]
    fn error_bars_are_unwrapped_with_the_phase() {
        let curve = delayed(0.3);
        let estimate = |value: &f64| Estimate {
            value: *value,
            standard_error: Some(2.0),
        };
        let points = BodePoints {
            name: "H".to_owned(),
            omega_rad_s: curve.omega_rad_s.clone(),
            magnitude_db: curve.magnitude_db.iter().map(estimate).collect(),
            phase_deg: curve.phase_deg.iter().map(estimate).collect(),
            delay_s: 0.3,
        };
        let phase = BodeCurve::of_points(&points, Shade::of_method(0)).phase();
        for (k, w) in points.omega_rad_s.iter().enumerate() {
            let expected = -(0.3 * w).to_degrees();
            assert!((phase.y[k] - expected).abs() < 1e-9);
            assert!((phase.bars[k].0 - expected + 2.0 * Z_95).abs() < 1e-9);
            assert!((phase.bars[k].1 - expected - 2.0 * Z_95).abs() < 1e-9);
        }
    }

    #[test]
    fn three_columns_are_drawn_even_for_invalid_input() {
        let column = |curve| BodeColumn {
            title: "m^0 = 1".to_owned(),
            curves: vec![curve],
        };
        let mut broken = delayed(f64::NAN);
        broken.magnitude_db.truncate(3);
        let zero = BodeCurve::of_response(
            "",
            LineKind::Truth,
            Shade::of_method(1),
            &[0.0, 1.0],
            &[Complex64::new(0.0, 0.0); 2],
            0.0,
        );
        let grid = BodeGrid {
            columns: vec![column(delayed(0.1)), column(broken), column(zero)],
        };
        let svg = bode_grid("b", "t", &grid);
        assert!(svg.contains("viewBox=\"0 0 840 ") && !svg.contains("NaN"));
        assert_eq!(svg.matches("= 1<").count(), 3);
        assert_eq!(svg, bode_grid("b", "t", &grid));
        assert!(bode_grid("b", "t", &BodeGrid::default()).ends_with("</svg>"));
    }
}
