//! Ranges as typed by users: integers for a search, and delays in samples or in seconds.

use std::{fmt, ops::RangeInclusive, str::FromStr};

use hoid_model::SampleTime;

use super::{kind::Kind, value::Value};

/// `N` or `LO..HI`, including both ends.
impl Value for RangeInclusive<usize> {
    const KIND: Kind = Kind::Counts;

    fn read(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<usize>().ok();
        let ends = match text.split_once("..") {
            None => number(text).map(|n| (n, n)),
            Some((low, high)) => number(low).zip(number(high.trim_start_matches('='))),
        };
        match ends {
            Some((low, high)) if low <= high => Ok(low..=high),
            Some(_) => Err("a range LO..HI with LO <= HI".to_owned()),
            None => Err("a nonnegative whole number, or LO..HI".to_owned()),
        }
    }

    fn text(&self) -> Option<String> {
        Some(match self.start() == self.end() {
            true => self.start().to_string(),
            false => format!("{}..{}", self.start(), self.end()),
        })
    }

    fn numbers(&self) -> Vec<f64> {
        vec![*self.start() as f64, *self.end() as f64]
    }
}

/// A non-negative number, or `LO..HI` of such numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberOrSpan(pub f64, pub f64);

impl Value for NumberOrSpan {
    const KIND: Kind = Kind::NumberOrSpan;

    fn read(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let (low, high) = text.split_once("..").unwrap_or((text, text));
        match number(low).zip(number(high)) {
            Some((low, high)) if low <= high => Ok(Self(low, high)),
            _ => Err("a number, such as .28, or LO..HI with LO <= HI, such as 0.1..0.4".to_owned()),
        }
    }

    fn text(&self) -> Option<String> {
        Some(match self.0 == self.1 {
            true => self.0.to_string(),
            false => format!("{}..{}", self.0, self.1),
        })
    }

    fn numbers(&self) -> Vec<f64> {
        vec![self.0, self.1]
    }
}

/// A delay as given by the user: nk in samples, or tau_e in seconds.
#[derive(Debug, Clone, PartialEq)]
pub enum DelayRange {
    /// Smallest and largest nk.
    Samples(RangeInclusive<usize>),
    /// Smallest and largest tau_e, s.
    Seconds(f64, f64),
}

impl DelayRange {
    /// Returns `nk`, the delay in samples, or, if it is missing, `delay_s`, the delay in seconds.
    pub fn from_options(nk: Option<&Self>, delay_s: Option<NumberOrSpan>) -> Option<Self> {
        nk.cloned()
            .or(delay_s.map(|NumberOrSpan(low, high)| Self::Seconds(low, high)))
    }

    /// Returns the range of nk; a delay tau_e in seconds gives nk = tau_e/Ts + 1.
    pub fn nk_range(&self, sample_time: SampleTime) -> RangeInclusive<usize> {
        match self {
            Self::Samples(range) => range.clone(),
            Self::Seconds(low, high) => sample_time.nk(*low)..=sample_time.nk(*high),
        }
    }
}

impl fmt::Display for DelayRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Samples(range) => write!(f, "{} samples", range.text().unwrap_or_default()),
            Self::Seconds(low, high) => write!(f, "{} s", NumberOrSpan(*low, *high).text().unwrap_or_default()),
        }
    }
}

/// `N` or `LO..HI` in samples; in seconds if one or both ends are followed by `s`.
impl Value for DelayRange {
    const KIND: Kind = Kind::Delay;

    fn read(text: &str) -> Result<Self, String> {
        if !text.trim_end().ends_with('s') {
            let samples = RangeInclusive::read(text).map(Self::Samples);
            return samples.map_err(|expected| format!("{expected}, or seconds such as 0.28s"));
        }
        let expected = || "samples (29, 20..40) or seconds (0.28s, 0.1s..0.4s)".to_owned();
        let seconds = |part: &str| {
            let part = part.trim();
            part.strip_suffix('s').unwrap_or(part).trim_end().to_owned()
        };
        let (low, high) = text.split_once("..").unwrap_or((text, text));
        match NumberOrSpan::read(&format!("{}..{}", seconds(low), seconds(high))) {
            Ok(NumberOrSpan(low, high)) if low >= 0.0 => Ok(Self::Seconds(low, high)),
            _ => Err(expected()),
        }
    }

    fn text(&self) -> Option<String> {
        match self {
            Self::Samples(range) => range.text(),
            Self::Seconds(low, high) if low == high => Some(format!("{low}s")),
            Self::Seconds(low, high) => Some(format!("{low}s..{high}s")),
        }
    }
}

impl FromStr for DelayRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::read(text).map_err(|expected| format!("{text:?} is not a delay; write {expected}"))
    }
}

impl FromStr for NumberOrSpan {
    type Err = String;

    /// Parses one nonnegative number, or two as `LO..HI`.
    fn from_str(text: &str) -> Result<Self, String> {
        let read = Self::read(text).map_err(|expected| format!("{text:?}: expected {expected}"))?;
        match read.0 >= 0.0 {
            true => Ok(read),
            false => Err(format!("{text:?}: expected a nonnegative number")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_text_is_parsed() {
        type Counts = RangeInclusive<usize>;
        assert_eq!(Counts::read("29"), Ok(29..=29));
        assert_eq!(Counts::read("20..40"), Ok(20..=40));
        assert_eq!(Counts::read("20..=40"), Ok(20..=40));
        for bad in ["", "x", "-1", "5..4", "1..", "1.5"] {
            assert!(Counts::read(bad).is_err(), "{bad}");
        }
        assert_eq!(NumberOrSpan::read(".28"), Ok(NumberOrSpan(0.28, 0.28)));
        assert_eq!(NumberOrSpan::read("0.1..0.4"), Ok(NumberOrSpan(0.1, 0.4)));
        for bad in ["", "s", "0.4..0.1", "NaN", "inf", "0.28s"] {
            assert!(NumberOrSpan::read(bad).is_err(), "{bad}");
        }
        assert!("-0.1".parse::<NumberOrSpan>().is_err());
    }

    #[test]
    fn delay_range_text_is_parsed() {
        let ts = SampleTime::new(0.01).unwrap();
        let nk = |text: &str| DelayRange::read(text).unwrap().nk_range(ts);
        assert_eq!((nk("29"), nk("0.28s"), nk(" 0.28 s")), (29..=29, 29..=29, 29..=29));
        assert_eq!(
            (nk("20..40"), nk("0.1s..0.4s"), nk("0.1..0.4s")),
            (20..=40, 11..=41, 11..=41)
        );
        for bad in ["", "s", "0.28", "-0.1s", "0.4s..0.1s", "NaNs", "infs", "0.2ms", "a..bs"] {
            assert!(DelayRange::read(bad).is_err(), "{bad}");
        }
        for text in ["29", "20..40", "0.28s", "0.1s..0.4s"] {
            assert_eq!(DelayRange::read(text).unwrap().text().as_deref(), Some(text));
        }
    }
}
