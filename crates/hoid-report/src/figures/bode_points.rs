//! Points with error bars in a Bode diagram, for comparison of describing functions with the models fitted to the same
//! records.
//!
//! The phase of a point is known up to full turns. A point is drawn on the branch nearest to the first curve. If there
//! is no curve, the phase is unwrapped from point to point after the delay of the points is removed.

use hoid_ident::frequency::{DescribingFunction, unwrapped_deg};
use hoid_model::uncertainty::Estimate;
use kuva::render::render::Scene;

use super::{draw, scale::Scale};
use crate::numbers::Z_95;

const MARKER_RADIUS: f64 = 2.4;
/// Half of the width of an error bar's cap.
const CAP_HALF_WIDTH: f64 = 2.5;

/// Points of a frequency response.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodePoints {
    /// Name in the legend.
    pub name: String,
    /// Frequencies (rad/s) in ascending order.
    pub omega_rad_s: Vec<f64>,
    /// Magnitude in dB at each frequency, with its standard error if known. Non-finite values are omitted.
    pub magnitude_db: Vec<Estimate>,
    /// Phase in deg at each frequency, with its standard error if known; full turns may be added or missing.
    pub phase_deg: Vec<Estimate>,
    /// Delay removed while the phase is unwrapped (s); used only if there is no curve.
    pub delay_s: f64,
}

impl BodePoints {
    /// Creates the points of a describing function.
    pub fn of_describing_function(name: &str, h: &DescribingFunction) -> Self {
        Self {
            name: name.to_owned(),
            omega_rad_s: h.lines.iter().map(|l| l.omega_rad_s).collect(),
            magnitude_db: h.lines.iter().map(|l| l.magnitude_db()).collect(),
            phase_deg: h.lines.iter().map(|l| l.phase_deg()).collect(),
            delay_s: 0.0,
        }
    }

    /// The points with a finite magnitude, a finite phase, and a finite, positive frequency.
    pub(super) fn drawable_points(&self) -> Self {
        let n = self
            .omega_rad_s
            .len()
            .min(self.magnitude_db.len())
            .min(self.phase_deg.len());
        let sound = |k: &usize| {
            let w = self.omega_rad_s[*k];
            w.is_finite() && w > 0.0 && self.magnitude_db[*k].value.is_finite() && self.phase_deg[*k].value.is_finite()
        };
        let kept: Vec<usize> = (0..n).filter(sound).collect();
        Self {
            name: self.name.clone(),
            omega_rad_s: kept.iter().map(|k| self.omega_rad_s[*k]).collect(),
            magnitude_db: kept.iter().map(|k| self.magnitude_db[*k]).collect(),
            phase_deg: kept.iter().map(|k| self.phase_deg[*k]).collect(),
            delay_s: if self.delay_s.is_finite() { self.delay_s } else { 0.0 },
        }
    }

    /// Shifts the phases by full turns to the branch nearest to a curve, given as frequencies and phases in deg.
    pub(super) fn shift_to_branch_of(mut self, curve: Option<(&[f64], &[f64])>) -> Self {
        let pairs: Vec<(f64, f64)> = self
            .omega_rad_s
            .iter()
            .copied()
            .zip(self.phase_deg.iter().map(|p| p.value))
            .collect();
        let unwrapped = unwrapped_deg(&pairs, self.delay_s);
        for ((phase, &omega), alone) in self.phase_deg.iter_mut().zip(&self.omega_rad_s).zip(unwrapped) {
            phase.value = match curve.and_then(|(w, y)| interpolate(w, y, omega)) {
                Some(near) => phase.value + 360.0 * ((near - phase.value) / 360.0).round(),
                None => alone,
            };
        }
        self
    }

    /// Returns the values together with both ends of their error bars.
    pub(super) fn values_and_bar_ends(values: &[Estimate]) -> impl Iterator<Item = f64> + '_ {
        values.iter().flat_map(|v| {
            let half = bar_half_length(v);
            [v.value - half, v.value, v.value + half]
        })
    }

    /// Draws the points inside the axes and their bars of 1.96 standard errors, cut off at the axes.
    pub(super) fn draw(&self, scene: &mut Scene, scale: &Scale, values: &[Estimate], colour: &str) {
        let mut at = Vec::new();
        for (&omega, value) in self.omega_rad_s.iter().zip(values).filter(|(w, _)| scale.has_x(**w)) {
            let (x, half) = (scale.map_x(omega), bar_half_length(value));
            let (low, high) = (value.value - half, value.value + half);
            if high < scale.y.0 || low > scale.y.1 {
                continue;
            }
            if half > 0.0 {
                let place = |v: f64| scale.map_y(scale.clamp_to_axis(v));
                scene.add(draw::line((x, place(low)), (x, place(high)), colour, 1.0, None));
                for end in [low, high].into_iter().filter(|end| scale.clamp_to_axis(*end) == *end) {
                    scene.add(draw::line(
                        (x - CAP_HALF_WIDTH, place(end)),
                        (x + CAP_HALF_WIDTH, place(end)),
                        colour,
                        1.0,
                        None,
                    ));
                }
            }
            if scale.clamp_to_axis(value.value) == value.value {
                at.push((x, scale.map_y(value.value)));
            }
        }
        draw::points(scene, &at, MARKER_RADIUS, colour, None);
    }
}

fn bar_half_length(value: &Estimate) -> f64 {
    value.standard_error.map_or(0.0, |s| Z_95 * s).clamp(0.0, 1e6)
}

/// Interpolates linearly between the points of a curve and returns the value of the nearest end outside it; `None` if
/// the value is not finite.
fn interpolate(omega: &[f64], y: &[f64], at: f64) -> Option<f64> {
    let n = omega.len().min(y.len());
    let above = omega[..n].partition_point(|w| *w <= at);
    let value = match (above.checked_sub(1), above < n) {
        (Some(low), true) => {
            let part = (at - omega[low]) / (omega[above] - omega[low]);
            y[low] + part * (y[above] - y[low])
        }
        (Some(low), false) => y[low],
        (None, true) => y[above],
        (None, false) => return None,
    };
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(phase: &[f64]) -> BodePoints {
        BodePoints {
            name: "H".to_owned(),
            omega_rad_s: (1..=phase.len()).map(|k| k as f64).collect(),
            magnitude_db: vec![Estimate::fixed(0.0); phase.len()],
            phase_deg: phase.iter().map(|p| Estimate::fixed(*p)).collect(),
            delay_s: 0.0,
        }
    }

    #[test]
    fn phases_are_moved_to_the_branch_of_the_curve() {
        let joined = points(&[100.0, 60.0, -170.0]).shift_to_branch_of(Some((&[0.5, 3.5], &[-200.0, -600.0])));
        let phases: Vec<f64> = joined.phase_deg.iter().map(|p| p.value).collect();
        assert_eq!(phases, [-260.0, -300.0, -530.0]);
        let alone = points(&[-100.0, 170.0, 100.0]).shift_to_branch_of(None);
        let phases: Vec<f64> = alone.phase_deg.iter().map(|p| p.value).collect();
        assert_eq!(phases, [-100.0, -190.0, -260.0]);
    }

    #[test]
    fn invalid_points_are_omitted() {
        let mut broken = points(&[1.0, f64::NAN, 3.0, 4.0]);
        broken.omega_rad_s[0] = 0.0;
        broken.magnitude_db.truncate(3);
        assert_eq!(broken.drawable_points().omega_rad_s, [3.0]);
        assert_eq!(
            BodePoints::values_and_bar_ends(&[Estimate {
                value: 1.0,
                standard_error: Some(f64::INFINITY)
            }])
            .count(),
            3
        );
    }
}
