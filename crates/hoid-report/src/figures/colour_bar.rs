//! Colours that represent the values of a map, and the colour bar next to it.
//!
//! The default colours are viridis (Smith and van der Walt, 2015), with evenly spaced lightness. Differences have the
//! diverging colours of Harrower and Brewer (2003), from red over white at zero to blue, whose ends are equally dark.

use kuva::{
    prelude::ColorMap,
    render::render::{Scene, TextAnchor},
};

use super::{
    axes::{tick, tick_step},
    draw,
    labels::label_markup,
    style::{BLACK, TEXT_SIZE},
};

/// Space for the colour bar at the right of the panels; `BAR_WIDTH` is the width of the bar and `STEP_COUNT` the number
/// of its colour steps.
pub const BAR_SPACE: f64 = 72.0;
const BAR_WIDTH: f64 = 12.0;
const STEP_COUNT: usize = 64;
/// Smallest distance between the ticks of the colour bar.
const MIN_TICK_SPACING: f64 = 30.0;

/// Colour map of the cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MapColours {
    /// From dark for the smallest value to light for the largest value.
    #[default]
    Sequential,
    /// White at zero; the range extends equally far to both sides of zero.
    Diverging,
}

/// Colour map with the range of its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    pub low: f64,
    pub high: f64,
    pub colours: MapColours,
}

impl ColourScale {
    /// The colour `#rrggbb` of a value; values outside the range have the colour of the nearest end.
    pub fn colour(&self, value: f64) -> String {
        let share = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        let map = match self.colours {
            MapColours::Sequential => ColorMap::Viridis,
            MapColours::Diverging => ColorMap::RedBlue,
        };
        let (r, g, b) = map.map_rgb(share).unwrap_or_default();
        format!("#{r:02X}{g:02X}{b:02X}")
    }

    /// Ticks of a colour bar of this height, at least three if possible: the first tick in units of the spacing, the
    /// number of ticks, and the spacing.
    fn ticks(&self, height: f64) -> (f64, usize, f64) {
        let mut most = (height / MIN_TICK_SPACING).max(2.0);
        loop {
            let step = tick_step(self.high - self.low, most);
            let first = (self.low / step - 1e-9).ceil();
            let last = (self.high / step + 1e-9).floor();
            let many = (last - first + 1.0).clamp(0.0, 20.0) as usize;
            if many >= 3 || most > 16.0 {
                return (first, many, step);
            }
            most *= 1.5;
        }
    }

    /// Draws a colour bar with ticks and the name of the quantity at the right edge of the figure.
    pub fn add_bar(&self, scene: &mut Scene, top: f64, bottom: f64, name: &str) {
        let left = scene.width - BAR_SPACE + 2.0;
        let height = bottom - top;
        let step = height / STEP_COUNT as f64;
        for k in 0..STEP_COUNT {
            let share = (k as f64 + 0.5) / STEP_COUNT as f64;
            let value = self.low + share * (self.high - self.low);
            let colour = self.colour(value);
            let corner = (left, bottom - step * (k + 1) as f64);
            scene.add(draw::rectangle(
                corner,
                (BAR_WIDTH, step),
                &colour,
                Some((&colour, 0.4)),
            ));
        }
        scene.add(draw::rectangle(
            (left, top),
            (BAR_WIDTH, height),
            "none",
            Some((BLACK, 0.8)),
        ));
        let (first, many, ticks) = self.ticks(height);
        for k in 0..many {
            let value = (first + k as f64) * ticks;
            let y = bottom - height * (value - self.low) / (self.high - self.low);
            scene.add(draw::line(
                (left + BAR_WIDTH, y),
                (left + BAR_WIDTH + 4.0, y),
                BLACK,
                1.0,
                None,
            ));
            let at = left + BAR_WIDTH + 7.0;
            scene.add(draw::text(
                at,
                y + 4.5,
                tick(value, ticks),
                TEXT_SIZE,
                TextAnchor::Start,
                None,
            ));
        }
        // The name is vertical, so a subscript extends further to the right.
        let x = scene.width - 9.0;
        scene.add(draw::centred_text(
            x,
            top + 0.5 * height,
            label_markup(name),
            Some(-90.0),
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bar_has_at_least_three_ticks() {
        for colours in [MapColours::Sequential, MapColours::Diverging] {
            for (low, high) in [
                (-4.9, 4.9),
                (-0.99, 0.99),
                (0.1, 0.3),
                (-2e-9, 3e-9),
                (17.0, 1e6),
                (0.0, 1.0),
            ] {
                for height in [78.0, 104.0, 400.0] {
                    let scale = ColourScale { low, high, colours };
                    let (first, many, step) = scale.ticks(height);
                    let last = (first + (many - 1) as f64) * step;
                    assert!((3..12).contains(&many), "{low} {high} {height}: {many}");
                    assert!(first * step >= low - 1e-9 * step && last <= high + 1e-9 * step);
                    assert!(height / (high - low) * step > TEXT_SIZE.into(), "numbers apart");
                }
            }
        }
    }
}
