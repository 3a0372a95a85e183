//! Orders, ranges and named numbers as they are typed.

use std::{collections::BTreeMap, fmt, ops::RangeInclusive};

use hoid::ident::{Constraint, NamedOrders, Prior};
use hoid::model::{MAX_DELAY, MAX_ORDER, SampleTime};

use crate::error::CliError;

/// `N` or `LO..HI` (both ends included).
pub fn parse_range(text: &str) -> Result<RangeInclusive<usize>, String> {
    let number = |part: &str| {
        part.trim()
            .parse::<usize>()
            .map_err(|_| format!("{part:?} is no whole number of zero or more; write N or LO..HI"))
    };
    match text.split_once("..") {
        None => number(text).map(|n| n..=n),
        Some((low, high)) => {
            let (low, high) = (number(low)?, number(high.trim_start_matches('='))?);
            if low > high {
                return Err(format!(
                    "the range {low}..{high} is empty; write the smaller number first"
                ));
            }
            Ok(low..=high)
        }
    }
}

/// A delay as typed: of b0 in samples, or the dead time in s.
#[derive(Debug, Clone, PartialEq)]
pub enum DelayRange {
    Samples(RangeInclusive<usize>),
    Seconds(f64, f64),
}

impl fmt::Display for DelayRange {
    /// As it was given.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Samples(range) if range.start() == range.end() => write!(f, "{} samples", range.start()),
            Self::Samples(range) => write!(f, "{}..{} samples", range.start(), range.end()),
            Self::Seconds(low, high) if low == high => write!(f, "{low} s"),
            Self::Seconds(low, high) => write!(f, "{low}..{high} s"),
        }
    }
}

impl DelayRange {
    /// The delay that was typed, by --nk or by --delay: of those one is given.
    pub fn given(nk: Option<&Self>, delay_s: Option<(f64, f64)>) -> Option<Self> {
        nk.cloned().or(delay_s.map(|(low, high)| Self::Seconds(low, high)))
    }

    /// The line of printed settings, where it was given in s.
    pub fn setting(&self) -> Option<(String, String)> {
        matches!(self, Self::Seconds(..)).then(|| ("delay".to_owned(), self.to_string()))
    }

    /// nk of both ends: tau_e = (nk - 1) Ts.
    pub fn samples(&self, sample_time: SampleTime) -> RangeInclusive<usize> {
        match self {
            Self::Samples(range) => range.clone(),
            Self::Seconds(low, high) => sample_time.nk(*low)..=sample_time.nk(*high),
        }
    }

    /// Both ends in s; none of samples.
    pub fn seconds(&self) -> Option<(f64, f64)> {
        match self {
            Self::Samples(_) => None,
            Self::Seconds(low, high) => Some((*low, *high)),
        }
    }
}

/// `N` or `LO..HI` in samples, or with an s behind one or both ends in seconds.
pub fn parse_delay(text: &str) -> Result<DelayRange, String> {
    if !text.trim_end().ends_with('s') {
        return parse_range(text)
            .map(DelayRange::Samples)
            .map_err(|e| format!("{e}, or seconds as 0.28s"));
    }
    let wrong = || format!("{text:?} is no delay; write samples (29, 20..40) or seconds (0.28s, 0.1s..0.4s)");
    let seconds = |part: &str| {
        let part = part.trim();
        part.strip_suffix('s').unwrap_or(part).trim_end().to_owned()
    };
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    parse_seconds(&format!("{}..{}", seconds(low), seconds(high)))
        .map(|(low, high)| DelayRange::Seconds(low, high))
        .map_err(|_| wrong())
}

/// A delay in s: `0.28`, or `LO..HI`.
pub fn parse_seconds(text: &str) -> Result<(f64, f64), String> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|s| s.is_finite() && *s >= 0.0);
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    match number(low).zip(number(high)) {
        Some((low, high)) if low <= high => Ok((low, high)),
        _ => Err(format!(
            "{text:?} is no delay in s; write one of 0 s or more, as .28, or LO..HI with LO <= HI, as 0.1..0.4"
        )),
    }
}

/// Most samples ahead of a prediction that is judged.
const MOST_AHEAD: usize = 1_000_000;

/// A number of samples ahead.
pub fn parse_horizon(text: &str) -> Result<usize, String> {
    let samples = text.trim().parse().ok().filter(|k| (1..=MOST_AHEAD).contains(k));
    samples.ok_or_else(|| format!("{text:?} is no number of samples ahead; write 1 to {MOST_AHEAD}"))
}

/// `name=value,name=value`.
pub fn parse_pairs(text: &str) -> Result<Vec<(String, String)>, String> {
    text.split(',')
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .map(|part| {
            let (name, value) = part
                .split_once('=')
                .ok_or_else(|| format!("{part:?} has no '='; write name=value,name=value"))?;
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        })
        .collect()
}

/// `name=number,name=number`.
pub fn parse_numbers(text: &str) -> Result<Vec<(String, f64)>, String> {
    parse_pairs(text)?
        .into_iter()
        .map(|(name, value)| match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok((name, number)),
            _ => Err(format!("{name}={value}: expected a finite number")),
        })
        .collect()
}

/// The orders that were typed; a delay in seconds is none of them yet.
pub fn named_orders(orders: Option<&str>, nk: Option<&DelayRange>) -> Result<NamedOrders, CliError> {
    let mut all = NamedOrders::new();
    for (name, value) in parse_pairs(orders.unwrap_or_default()).map_err(CliError::Usage)? {
        if name == "nk" && nk.is_some() {
            return Err(CliError::Usage(
                "nk is given twice, by --orders and by --nk; drop one".to_owned(),
            ));
        }
        let range = parse_range(&value).map_err(|e| CliError::Usage(format!("--orders {name}: {e}")))?;
        all.insert(name, range);
    }
    if let Some(DelayRange::Samples(nk)) = nk {
        all.insert("nk".to_owned(), nk.clone());
    }
    for (name, range) in &all {
        let most = match name.as_str() {
            "nk" => MAX_DELAY,
            "na" | "nb" | "nc" | "nd" | "nf" => MAX_ORDER,
            _ => {
                return Err(CliError::Usage(format!(
                    "--orders: there is no order {name}; expected na, nb, nc, nd, nf or nk"
                )));
            }
        };
        if *range.end() > most {
            return Err(CliError::Usage(format!(
                "{name} = {}: at most {most} is possible; give a smaller number or range",
                range.end()
            )));
        }
    }
    Ok(all)
}

/// `name=value` pairs of an option, each turned into what it means.
fn named<T>(
    option: &str,
    text: Option<&str>,
    parse: impl Fn(&str) -> Option<T>,
    expected: &str,
) -> Result<BTreeMap<String, T>, CliError> {
    let mut all = BTreeMap::new();
    for (name, value) in parse_pairs(text.unwrap_or_default()).map_err(|e| CliError::Usage(format!("{option}: {e}")))? {
        let parsed =
            parse(&value).ok_or_else(|| CliError::Usage(format!("{option} {name}={value}: expected {expected}")))?;
        if all.insert(name.clone(), parsed).is_some() {
            return Err(CliError::Usage(format!("{option}: {name} is given twice")));
        }
    }
    Ok(all)
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite())
}

/// Constraints from `--fix name=value` and `--bound name=low..high`.
pub fn constraints(fix: Option<&str>, bound: Option<&str>) -> Result<BTreeMap<String, Constraint>, CliError> {
    let end = |text: &str, open: f64| if text.is_empty() { Some(open) } else { finite(text) };
    let between = |text: &str| {
        let (low, high) = text.split_once("..")?;
        let (low, high) = (end(low, f64::NEG_INFINITY)?, end(high, f64::INFINITY)?);
        (low <= high).then_some(Constraint::Between(low, high))
    };
    let mut all = named("--fix", fix, |v| finite(v).map(Constraint::Fixed), "a finite number")?;
    for (name, limits) in named(
        "--bound",
        bound,
        between,
        "LOW..HIGH with LOW <= HIGH, either end may be left open",
    )? {
        if all.insert(name.clone(), limits).is_some() {
            return Err(CliError::Usage(format!("{name} is both fixed and bounded; drop one")));
        }
    }
    Ok(all)
}

/// Guesses with their weights from `name=value:weight`.
pub fn priors(text: Option<&str>) -> Result<BTreeMap<String, Prior>, CliError> {
    let guess = |text: &str| {
        let (value, weight) = text.split_once(':')?;
        Some(Prior {
            value: finite(value)?,
            weight: finite(weight).filter(|w| *w >= 0.0)?,
        })
    };
    named(
        "--coefficient-prior",
        text,
        guess,
        "VALUE:WEIGHT with a weight that is not negative",
    )
}

/// A start from `f1=..,b0=..`, each coefficient once.
pub fn start(text: &str) -> Result<BTreeMap<String, f64>, CliError> {
    let mut start = BTreeMap::new();
    for (name, value) in parse_numbers(text).map_err(|e| CliError::Usage(format!("--start: {e}")))? {
        if start.insert(name.clone(), value).is_some() {
            return Err(CliError::Usage(format!("--start: {name} is given twice")));
        }
    }
    Ok(start)
}

#[cfg(test)]
mod tests {
    #[test]
    fn delays_as_typed() {
        let ts = SampleTime::new(0.01).unwrap();
        let nk = |text: &str| parse_delay(text).unwrap().samples(ts);
        assert_eq!((nk("29"), nk("0.28s"), nk(" 0.28 s")), (29..=29, 29..=29, 29..=29));
        assert_eq!(
            (nk("20..40"), nk("0.1s..0.4s"), nk("0.1..0.4s")),
            (20..=40, 11..=41, 11..=41)
        );
        for bad in ["", "s", "0.28", "-0.1s", "0.4s..0.1s", "NaNs", "infs", "0.2ms", "a..bs"] {
            assert!(parse_delay(bad).is_err(), "{bad}");
        }
    }

    use super::*;

    #[test]
    fn ranges_as_typed() {
        assert_eq!(parse_range("29").unwrap(), 29..=29);
        assert_eq!(parse_range("20..40").unwrap(), 20..=40);
        assert_eq!(parse_range("20..=40").unwrap(), 20..=40);
        for bad in ["", "x", "-1", "5..4", "1..", "1.5"] {
            assert!(parse_range(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn orders_as_typed() {
        let some = named_orders(Some("nd=2, nc=1..3"), Some(&DelayRange::Samples(29..=29))).unwrap();
        assert_eq!(
            (&some["nd"], &some["nc"], &some["nk"]),
            (&(2..=2), &(1..=3), &(29..=29))
        );
        assert!(named_orders(None, None).unwrap().is_empty());
        assert!(named_orders(Some("nx=2"), None).is_err());
        for twice in [DelayRange::Samples(3..=3), DelayRange::Seconds(0.2, 0.3)] {
            assert!(named_orders(Some("nk=2"), Some(&twice)).is_err());
        }
    }

    #[test]
    fn constraints_and_guesses_as_typed() {
        let all = constraints(Some("d1=-0.85"), Some("b0=0..0.2, f2=..0.99,f1=-2..")).unwrap();
        assert_eq!(all["d1"], Constraint::Fixed(-0.85));
        assert_eq!(all["b0"], Constraint::Between(0.0, 0.2));
        assert_eq!(all["f2"], Constraint::Between(f64::NEG_INFINITY, 0.99));
        assert_eq!(all["f1"], Constraint::Between(-2.0, f64::INFINITY));
        for (fix, bound) in [
            ("d1=x", ""),
            ("d1=1,d1=2", ""),
            ("", "b0=2..1"),
            ("", "b0=3"),
            ("b0=1", "b0=0..2"),
        ] {
            assert!(constraints(Some(fix), Some(bound)).is_err(), "{fix} {bound}");
        }
        assert_eq!(priors(Some("f1=-1.9:0.5")).unwrap()["f1"].weight, 0.5);
        for bad in ["f1=-1.9", "f1=-1.9:-1", "f1=:1"] {
            assert!(priors(Some(bad)).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_start_names_each_coefficient_once() {
        assert_eq!(start("f1=-1.9,b0=.04").unwrap()["f1"], -1.9);
        for bad in ["f1=1,f1=2", "f1=abc", "f1"] {
            assert!(start(bad).is_err(), "{bad}");
        }
    }
}
