//! Labels and ticks of the panels over time: subscripts, and as many digits as a step needs.

use super::style;

/// Stand in the text of labels for the begin and end of a subscript and the end of the label; they become tags.
const SUB: char = '\u{e000}';
const BACK: char = '\u{e001}';
const END: char = '\u{e002}';

const MOST_TICKS: f64 = 5.2;

/// Name and unit of a panel; several names are separated by commas. [`tagged`] completes it in the finished figure.
pub fn panel_label(name: &str, unit: &str) -> String {
    let names: Vec<String> = name.split(", ").map(symbol).collect();
    let unit = match unit {
        "" => String::new(),
        unit => format!(" ({})", plain(unit)),
    };
    // What follows a subscript stands in a tag of its own, which ends with the label.
    let name = names.join(", ");
    let ends = END.to_string().repeat(name.matches(BACK).count());
    style::label(&format!("{name}{unit}{ends}"))
}

/// A figure with the tags of its subscripts.
pub fn tagged(svg: &str) -> String {
    svg.replace(&format!("{BACK} ("), "</tspan><tspan dy=\"-3\" dx=\"4\">(")
        .replace(SUB, "<tspan dy=\"3\" font-size=\"10\">")
        .replace(BACK, "</tspan><tspan dy=\"-3\">")
        .replace(END, "</tspan>")
}

/// Text without the characters that become tags.
pub fn plain(text: &str) -> String {
    text.replace([SUB, BACK, END], "")
}

/// A parameter with its subscript; other text as it is.
fn symbol(name: &str) -> String {
    let (letter, sub) = match name {
        "K_e" => ("K", "e"),
        "T_L" => ("T", "L"),
        "K_e_dot" => ("K", "\u{117}"),
        "omega_nm" => ("\u{3c9}", "nm"),
        "zeta_nm" => ("\u{3b6}", "nm"),
        "tau_e" => ("\u{3c4}", "e"),
        other => match other.char_indices().nth(1).map(|(at, _)| other.split_at(at)) {
            Some((letter, digits)) if digits.bytes().all(|b| b.is_ascii_digit()) => (letter, digits),
            _ => return plain(other),
        },
    };
    format!("{letter}{SUB}{sub}{BACK}")
}

/// Step of 1, 2 or 5 times a power of ten that gives few enough ticks.
pub fn tick_step(span: f64) -> f64 {
    let least = span / MOST_TICKS;
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|s| *s >= least);
    step.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(span)
}

/// A tick with the digits that its step needs.
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

pub fn log_tick(value: f64) -> String {
    if (1e-3..1e5).contains(&value) {
        return crate::numbers::plain(value);
    }
    format!("{value:.0e}")
}

pub fn is_power_of_ten(value: f64) -> bool {
    let exponent = value.log10();
    (exponent - exponent.round()).abs() < 1e-6
}

/// The next of 1, 2, 5 times a power of ten, downwards or upwards.
pub fn one_two_five(value: f64, up: bool) -> f64 {
    const MARKS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
    let power = 10f64.powf(value.log10().floor());
    let rest = value / power;
    let mark = if up {
        MARKS.into_iter().find(|m| *m >= rest * (1.0 - 1e-9))
    } else {
        MARKS.into_iter().rev().find(|m| *m <= rest * (1.0 + 1e-9))
    };
    power * mark.unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_tell_their_step_apart() {
        assert_eq!(tick_step(1.0), 0.2);
        assert_eq!(tick(0.1 + 0.2, 0.1), "0.3");
        assert_eq!(tick(1e-17, 0.1), "0");
        assert_eq!(tick(1.25e-5, 5e-7), "1.25e-5");
        assert_eq!(tick(3e7, 1e7), "3e7");
        assert_eq!(one_two_five(0.003, false), 0.002);
        assert!((one_two_five(0.0051, true) - 0.01).abs() < 1e-12);
        assert_eq!(log_tick(0.02), "0.02");
        assert_eq!(log_tick(1e-5), "1e-5");
    }
}
