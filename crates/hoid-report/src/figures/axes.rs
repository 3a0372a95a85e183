//! Ticks and ranges of the axes of panels. Tick labels have as many digits as the tick spacing requires.

use std::sync::Arc;

use kuva::prelude::{Layout, TickFormat};

use super::style;

/// Smallest distance between the ticks of an ordinate, in units of the figure; `MIN_LABELLED_DECADE_HEIGHT` is the
/// smallest height of a decade with labels at 2 and 5.
const MIN_TICK_SPACING: f64 = 16.0;
const MIN_LABELLED_DECADE_HEIGHT: f64 = 48.0;
/// Spacings of phase ticks, deg.
const PHASE_STEPS: [f64; 6] = [15.0, 30.0, 45.0, 90.0, 180.0, 360.0];
/// Smallest width of a decade with labels at 2 and 5 on a logarithmic abscissa.
const MIN_LABELLED_DECADE_WIDTH: f64 = 95.0;
/// Width of a tick label with the space to its neighbour.
const TICK_WIDTH: f64 = 34.0;
/// Smallest number that the library draws on a logarithmic axis.
const MIN_LOG_VALUE: f64 = 1e-10;

/// Tick spacing of 1, 2 or 5 times a power of ten that gives at most `most` intervals.
pub fn tick_step(span: f64, most: f64) -> f64 {
    let least = span / most;
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|s| *s >= least);
    step.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(span)
}

/// Label of a tick with as many digits as the tick spacing `step` requires.
pub fn tick(value: f64, step: f64) -> String {
    let place = step.log10().floor();
    let value = (value / step).round() * step;
    if value == 0.0 {
        return "0".to_owned();
    }
    if (-4.0..5.0).contains(&place) {
        let decimals = (-place).max(0.0) as usize;
        return format!("{value:.decimals$}");
    }
    let digits = (value.abs().log10().floor() - place).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$e}")
}

/// Returns the layout with ticks for an ordinate of this height; the ticks have numbers if `labelled` is true. If the
/// unit is `deg`, the tick spacing of a wide range is one of `PHASE_STEPS`.
pub fn with_ordinate(
    layout: Layout,
    (low, high): (f64, f64),
    unit: &str,
    logarithmic: bool,
    height: f64,
    labelled: bool,
) -> Layout {
    if logarithmic {
        let decades = (high / low).log10();
        let all = decades < 1.02 || height / decades > MIN_LABELLED_DECADE_HEIGHT;
        let format = move |v: f64| match labelled && (all || is_power_of_ten(v)) {
            true => log_tick(v, (low, high)),
            false => String::new(),
        };
        return layout
            .with_log_y()
            .with_y_tick_format(TickFormat::Custom(Arc::new(format)));
    }
    let most = height / MIN_TICK_SPACING;
    let of_circle = PHASE_STEPS.into_iter().find(|s| (high - low) / s <= most);
    let step = match of_circle {
        Some(step) if unit == "deg" && high - low > PHASE_STEPS[0] => step,
        _ => tick_step(high - low, most),
    };
    let format = move |v: f64| if labelled { tick(v, step) } else { String::new() };
    layout
        .with_y_tick_step(step)
        .with_y_tick_format(TickFormat::Custom(Arc::new(format)))
}

/// An ordinate that is linear up to a limit and logarithmic beyond it, on both sides of zero, for positive and negative
/// numbers that differ by orders of magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SymmetricLogAxis {
    /// Limit of the linear part; the linear part has the height of one decade on either side of zero.
    pub linear_limit: f64,
}

impl SymmetricLogAxis {
    /// Height of a value, in decades.
    pub fn height(self, value: f64) -> f64 {
        let share = value / self.linear_limit;
        match share.abs() {
            size if size <= 1.0 => share,
            size => (1.0 + size.log10()).copysign(share),
        }
    }

    /// Returns the value at an integer height in decades.
    fn value(self, height: f64) -> f64 {
        match height.abs() {
            0.0 => 0.0,
            decades => (self.linear_limit * 10f64.powf(decades - 1.0)).copysign(height),
        }
    }

    /// Returns the layout with ticks at the integer decades of a range, on axes that are `height` units high.
    pub fn with_ordinate(self, layout: Layout, (low, high): (f64, f64), height: f64) -> Layout {
        let step = ((high - low) * MIN_TICK_SPACING / height).ceil().max(1.0);
        let range = (self.linear_limit, self.value(low.abs().max(high.abs())));
        let format = move |h: f64| match self.value(h.round()) {
            0.0 => "0".to_owned(),
            value if value < 0.0 => format!("-{}", log_tick(-value, range)),
            value => log_tick(value, range),
        };
        layout
            .with_y_tick_step(step)
            .with_y_tick_format(TickFormat::Custom(Arc::new(format)))
    }
}

/// Returns the layout with the ticks of an abscissa of this width.
pub fn with_abscissa(layout: Layout, (low, high): (f64, f64), logarithmic: bool, width: f64) -> Layout {
    if logarithmic {
        let decades = (high / low).log10();
        let all = decades < 1.02 || width / decades > MIN_LABELLED_DECADE_WIDTH;
        let format = move |v: f64| match all || is_power_of_ten(v) {
            true => log_tick(v, (low, high)),
            false => String::new(),
        };
        return layout
            .with_log_x()
            .with_x_tick_format(TickFormat::Custom(Arc::new(format)));
    }
    let step = tick_step(high - low, (width / TICK_WIDTH).max(2.0));
    let format = move |v: f64| tick(v, step);
    layout
        .with_x_tick_step(step)
        .with_x_tick_format(TickFormat::Custom(Arc::new(format)))
}

/// Range of a logarithmic axis that contains these values, with ends at 1, 2 or 5 times a power of ten. The range is
/// 0.1 to 1 if no value can be drawn.
pub fn log_range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let drawable = values
        .into_iter()
        .filter(|v| style::is_drawable(*v) && *v >= MIN_LOG_VALUE);
    let start = (f64::INFINITY, 0.0_f64);
    let (low, high) = drawable.fold(start, |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return (0.1, 1.0);
    }
    let (from, to) = (round_to_one_two_five(low, false), round_to_one_two_five(high, true));
    if to > from * 1.5 {
        (from, to)
    } else {
        (from / 2.0, to * 2.0)
    }
}

/// Label of a tick on a logarithmic axis with this range. The labels of one axis are either all decimal numbers or all
/// powers of ten.
pub fn log_tick(value: f64, (low, high): (f64, f64)) -> String {
    if low > 0.999e-3 && high < 1e6 {
        return crate::numbers::format_plain(value);
    }
    format!("{value:.0e}")
}

pub fn is_power_of_ten(value: f64) -> bool {
    let exponent = value.log10();
    (exponent - exponent.round()).abs() < 1e-6
}

/// The nearest 1, 2 or 5 times a power of ten that is at least (`up`) or at most this value.
pub fn round_to_one_two_five(value: f64, up: bool) -> f64 {
    const ONE_TWO_FIVE: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
    let power = 10f64.powf(value.log10().floor());
    let rest = value / power;
    let mark = if up {
        ONE_TWO_FIVE.into_iter().find(|m| *m >= rest * (1.0 - 1e-9))
    } else {
        ONE_TWO_FIVE.into_iter().rev().find(|m| *m <= rest * (1.0 + 1e-9))
    };
    power * mark.unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tick_labels_resolve_their_step() {
        assert_eq!(tick_step(1.0, 5.2), 0.2);
        assert_eq!(tick(0.1 + 0.2, 0.1), "0.3");
        assert_eq!(tick(1e-17, 0.1), "0");
        assert_eq!(tick(1.25e-5, 5e-7), "1.25e-5");
        assert_eq!(tick(3e7, 1e7), "3e7");
        assert_eq!(round_to_one_two_five(0.003, false), 0.002);
        assert!((round_to_one_two_five(0.0051, true) - 0.01).abs() < 1e-12);
        assert_eq!(log_tick(0.02, (0.01, 1e4)), "0.02");
        assert_eq!(log_tick(0.02, (1e-5, 1.0)), "2e-2");
        assert_eq!(log_tick(1e-5, (1e-5, 1.0)), "1e-5");
    }

    #[test]
    fn symmetric_log_axis_is_continuous_and_invertible() {
        let bent = SymmetricLogAxis { linear_limit: 10.0 };
        assert_eq!(
            [-1000.0, -10.0, -5.0, 0.0, 10.0, 100.0].map(|v| bent.height(v)),
            [-3.0, -1.0, -0.5, 0.0, 1.0, 2.0]
        );
        assert!((bent.height(10.0 + 1e-9) - 1.0).abs() < 1e-9, "no step where it bends");
        for height in [-3.0, -1.0, 0.0, 1.0, 4.0] {
            assert_eq!(bent.height(bent.value(height)), height);
        }
    }

    #[test]
    fn logarithmic_ranges_cover_their_values() {
        assert_eq!(log_range([0.03, 7.0, -1.0, 0.0, f64::NAN]), (0.02, 10.0));
        assert_eq!(log_range([1.0]), (0.5, 2.0));
        assert_eq!(log_range([-1.0, f64::INFINITY]), (0.1, 1.0));
    }
}
