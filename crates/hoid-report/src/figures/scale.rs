//! Conversion of values to positions between the axes of a panel, linear or logarithmic.

use super::{frame::Area, style};

/// Conversion of values to positions between the axes of a panel.
pub struct Scale {
    pub area: Area,
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub log_x: bool,
    pub log_y: bool,
}

impl Scale {
    /// True if the value lies within the range of the abscissa.
    pub fn has_x(&self, x: f64) -> bool {
        (self.x.0..=self.x.1).contains(&x)
    }

    /// True if the value has a position on the ordinate or beyond its ends.
    pub fn has_y(&self, y: f64) -> bool {
        style::is_drawable(y) && (y > 0.0 || !self.log_y)
    }

    pub fn clamp_to_axis(&self, y: f64) -> f64 {
        y.clamp(self.y.0, self.y.1)
    }

    /// Limits a value far beyond the axes. The path is clipped at the axes, but without the limit values such as 1e300
    /// would be written to the file.
    pub fn limit_to_axes(&self, y: f64) -> f64 {
        let (low, high) = self.y;
        let span = high - low;
        match self.log_y {
            true => y.clamp(low / 10.0, high * 10.0),
            false => y.clamp(low - span, high + span),
        }
    }

    pub fn map_x(&self, x: f64) -> f64 {
        self.area.left + self.area.width * relative_position(x, self.x, self.log_x)
    }

    pub fn map_y(&self, y: f64) -> f64 {
        self.area.bottom() - self.area.height * relative_position(y, self.y, self.log_y)
    }
}

fn relative_position(value: f64, (low, high): (f64, f64), logarithmic: bool) -> f64 {
    match logarithmic {
        true => (value / low).ln() / (high / low).ln(),
        false => (value - low) / (high - low),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_mapped_to_coordinates() {
        let area = Area {
            left: 10.0,
            top: 20.0,
            width: 100.0,
            height: 50.0,
        };
        let scale = Scale {
            area,
            x: (0.0, 4.0),
            y: (1.0, 100.0),
            log_x: false,
            log_y: true,
        };
        assert_eq!(scale.map_x(1.0), 35.0);
        assert!((scale.map_y(10.0) - 45.0).abs() < 1e-12);
        assert_eq!(
            (
                scale.clamp_to_axis(1e3),
                scale.limit_to_axes(1e9),
                scale.limit_to_axes(0.5)
            ),
            (100.0, 1e3, 0.5)
        );
        assert!(scale.has_x(4.0) && !scale.has_x(f64::NAN) && !scale.has_x(-1.0));
        assert!(scale.has_y(1e9) && !scale.has_y(0.0) && !scale.has_y(f64::INFINITY));
    }
}
