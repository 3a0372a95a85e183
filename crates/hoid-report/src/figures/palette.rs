//! The colours of all figures: the hue represents the method, the shade its level (noise, sample time, memory length),
//! and black the true values.
//!
//! The hues are those of Okabe and Ito (*Color Universal Design*, 2008). The shades of one hue are evenly spaced in
//! lightness `L*` (CIE 1976), light for the lowest level and dark for the highest, so their order is preserved in
//! greyscale. Where points have markers, each level has its own marker.

use super::style::MODEL_COLOURS;

/// Lightness of the lowest of several levels; `MIN_LIGHTNESS` is the lightness of the highest level.
const MAX_LIGHTNESS: f64 = 76.0;
const MIN_LIGHTNESS: f64 = 22.0;

/// Shape of the markers of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkerShape {
    Circle,
    Square,
    Up,
    Diamond,
    Down,
}

/// Method and level, which determine the colour of a curve or box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shade {
    /// Index of the method, which determines the hue: 0 (ARX) is blue, 1 (BJ) vermillion.
    pub method: usize,
    /// Index of the level, counted from the lowest, which determines the lightness.
    pub level: usize,
    /// Number of levels; with fewer than two, the colour is the hue itself.
    pub levels: usize,
}

impl Shade {
    /// The hue of a method without levels.
    pub fn of_method(method: usize) -> Self {
        Self {
            method,
            level: 0,
            levels: 1,
        }
    }

    /// The marker of the level.
    pub(super) fn mark(self) -> MarkerShape {
        const MARKS: [MarkerShape; 5] = [
            MarkerShape::Circle,
            MarkerShape::Square,
            MarkerShape::Up,
            MarkerShape::Diamond,
            MarkerShape::Down,
        ];
        MARKS[self.level % MARKS.len()]
    }

    /// The colour as `#rrggbb`.
    pub fn colour(self) -> String {
        shade(self.method, self.level, self.levels)
    }
}

/// The colour `#rrggbb` of a level of a method; a level beyond the last has the colour of the last.
pub fn shade(method: usize, level: usize, levels: usize) -> String {
    let hue = MODEL_COLOURS[method % MODEL_COLOURS.len()];
    if levels < 2 {
        return hue.to_owned();
    }
    let share = level.min(levels - 1) as f64 / (levels - 1) as f64;
    let wanted = MAX_LIGHTNESS + share * (MIN_LIGHTNESS - MAX_LIGHTNESS);
    let hue = channels(hue);
    let end = if wanted > lightness(hue) { 255.0 } else { 0.0 };
    let mixed = |part: f64| hue.map(|c| c + part * (end - c));
    // Lightness is monotonic in the fraction of white or black that is mixed in.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let too_far = (lightness(mixed(middle)) > wanted) == (end > 0.0);
        if too_far {
            high = middle;
        } else {
            low = middle;
        }
    }
    let [r, g, b] = mixed(low).map(|c| c.round() as u8);
    format!("#{r:02X}{g:02X}{b:02X}")
}

/// True if white text has more contrast than black text on a background `#rrggbb`. The two contrasts are equal at about
/// `L*` = 50.
pub fn is_dark(colour: &str) -> bool {
    lightness(channels(colour)) < 50.0
}

/// The red, green and blue channels of `#rrggbb`; zero for a channel that is not a hexadecimal number.
fn channels(colour: &str) -> [f64; 3] {
    let part = |i: usize| {
        let digits = colour.get(1 + 2 * i..3 + 2 * i).unwrap_or("00");
        u8::from_str_radix(digits, 16).map_or(0.0, f64::from)
    };
    [part(0), part(1), part(2)]
}

/// CIE 1976 lightness `L*` of an sRGB colour, 0 to 100.
fn lightness(channels: [f64; 3]) -> f64 {
    let [r, g, b] = channels.map(|c| {
        let c = c / 255.0;
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    });
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    if y > 0.008856 {
        116.0 * y.cbrt() - 16.0
    } else {
        903.3 * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_decreases_evenly_with_the_level() {
        for method in 0..MODEL_COLOURS.len() {
            for levels in [2, 3, 4, 7] {
                let of = |level| lightness(channels(&shade(method, level, levels)));
                let step = (MIN_LIGHTNESS - MAX_LIGHTNESS) / (levels - 1) as f64;
                for level in 1..levels {
                    // Rounding of the channels to integers changes L* by up to 0.4.
                    assert!(
                        (of(level) - of(level - 1) - step).abs() < 0.8,
                        "{method} {level} {levels}"
                    );
                }
            }
        }
    }

    #[test]
    fn single_level_has_the_base_colour() {
        assert_eq!(shade(0, 0, 1), MODEL_COLOURS[0]);
        assert_eq!(shade(7, 3, 0), MODEL_COLOURS[1]);
        assert_eq!(shade(1, 9, 3), shade(1, 2, 3));
        assert_eq!(Shade::of_method(1).colour(), MODEL_COLOURS[1]);
    }

    #[test]
    fn lightness_of_white_black_and_mid_grey() {
        assert!((lightness([255.0; 3]) - 100.0).abs() < 1e-3);
        assert_eq!(lightness([0.0; 3]), 0.0);
        // L* of sRGB 119 is 50.03.
        assert!((lightness([119.0; 3]) - 50.03).abs() < 0.01);
        assert!(is_dark("#000000") && !is_dark("#FFFFFF") && is_dark("x"));
    }
}
