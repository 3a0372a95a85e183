//! Transfer functions in s as people write them, and back.
//!
//! Two notations are read. `NUM/DEN` with commas holds the coefficients by descending powers of s:
//! `90/1,6,0`. Everything else is an expression in s:
//!
//! ```text
//! sum     = product { (+ | -) product }
//! product = factor { (* | / | nothing) factor }
//! factor  = (+ | -) factor | power
//! power   = atom [ ^ whole number ]
//! atom    = number | s | ( sum ) | exp( -tau s )
//! ```
//!
//! so that `90/(s(s+6))`, `(2s+1)/(s^2+0.4s+1)` and `0.5(s+1)/s/(s+2)` are what they look like.
//! A number is written before what it multiplies (`s2` is `s^2` mistyped). What follows a divisor
//! without a sign in between is read one way by people and the other way by
//! programs (`90/s(s+6)`), and is refused with both remedies. Common factors of numerator and
//! denominator stay: `s/s^2` has a pole that it hides. A delay is a factor of the whole.

use std::{fmt, str::FromStr};

use super::ContinuousTransferFunction;
use crate::{ModelError, polynomial};

const EXAMPLES: &str = "write it as 90/(s(s+6)), or as 90/1,6,0 by descending powers of s";
/// Degree beyond which a denominator is a typing error, and beyond which its roots are rounding.
const HIGHEST_DEGREE: usize = 50;
/// Parentheses inside of parentheses.
const DEEPEST: usize = 50;

impl FromStr for ContinuousTransferFunction {
    type Err = ModelError;

    /// Reads `90/1,6,0`, `90/(s(s+6))`, `0.5(s+1)exp(-0.1s)/s^2`.
    ///
    /// ```
    /// # use hoid_model::ContinuousTransferFunction;
    /// let element: ContinuousTransferFunction = "90/(s(s+6))".parse()?;
    /// assert_eq!((element.num(), element.den()), (&[90.0][..], &[1.0, 6.0, 0.0][..]));
    /// # Ok::<(), hoid_model::ModelError>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelError::TransferFunction`] with the character at which the text stops being one, or
    /// with what is wrong with the whole: a numerator of higher degree than the denominator, a
    /// delay that is negative.
    fn from_str(text: &str) -> Result<Self, ModelError> {
        let read = if text.contains(',') {
            coefficients(text)
        } else {
            Reader::new(text).whole()
        };
        let refuse = |expected: String| ModelError::TransferFunction {
            found: format!("{text:?}"),
            expected,
        };
        let Ratio { num, den, delay_s } = read.map_err(refuse)?;
        Self::new(&num, &den)
            .and_then(|h| h.with_delay(delay_s))
            .map_err(|error| match error {
                ModelError::TransferFunction { expected, .. } => refuse(expected),
                ModelError::OutOfRange { found, .. } => refuse(format!(
                    "its delay is {found} s, expected zero or more: a delay of 0.1 s is exp(-0.1s)"
                )),
                other => other,
            })
    }
}

impl fmt::Display for ContinuousTransferFunction {
    /// As an expression in s that reads back as the same transfer function.
    ///
    /// ```
    /// # use hoid_model::ContinuousTransferFunction;
    /// let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0])?;
    /// assert_eq!(element.to_string(), "90/(s^2 + 6s)");
    /// # Ok::<(), hoid_model::ModelError>(())
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let terms = |p: &[f64]| p.iter().filter(|c| **c != 0.0).count();
        let delay = if self.delay_s > 0.0 {
            format!("exp(-{}s)", number(self.delay_s))
        } else {
            String::new()
        };
        let (num, den) = (polynomial_text(&self.num), polynomial_text(&self.den));
        let factor = !delay.is_empty() || self.den.len() > 1;
        match terms(&self.num) > 1 && factor {
            true => write!(f, "({num}){delay}")?,
            false => write!(f, "{num}{delay}")?,
        }
        match terms(&self.den) {
            _ if self.den.len() == 1 => Ok(()),
            1 => write!(f, "/{den}"),
            _ => write!(f, "/({den})"),
        }
    }
}

/// The shortest text that gives the same number back.
fn number(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// By descending powers, `s^2 + 6s - 1`.
fn polynomial_text(p: &[f64]) -> String {
    let mut text = String::new();
    for (c, power) in p.iter().zip((0..p.len()).rev()).filter(|(c, _)| **c != 0.0) {
        text.push_str(match (text.is_empty(), *c < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        });
        if c.abs() != 1.0 || power == 0 {
            text.push_str(&number(c.abs()));
        }
        match power {
            0 => {}
            1 => text.push('s'),
            _ => text.push_str(&format!("s^{power}")),
        }
    }
    if text.is_empty() { "0".to_owned() } else { text }
}

/// `90/1,6,0`.
fn coefficients(text: &str) -> Result<Ratio, String> {
    let Some((num, den)) = text.split_once('/') else {
        return Err(format!("it has commas but no '/'; {EXAMPLES}"));
    };
    let list = |part: &str, before: usize| -> Result<Vec<f64>, String> {
        let mut at = before;
        part.split(',')
            .map(|c| {
                let here = at + c.chars().take_while(|sign| sign.is_whitespace()).count() + 1;
                at += c.chars().count() + 1;
                let finite = |v: &f64| v.is_finite();
                c.trim().parse::<f64>().ok().filter(finite).ok_or_else(|| {
                    let found = if c.trim().is_empty() { "nothing" } else { c.trim() };
                    format!("at character {here} stands {found}, expected a coefficient (a number); {EXAMPLES}")
                })
            })
            .collect()
    };
    Ok(Ratio {
        num: list(num, 0)?,
        den: list(den, num.chars().count() + 1)?,
        delay_s: 0.0,
    })
}

/// `num/den e^{-s tau}` while it is read: not yet proper, its delay not yet positive.
#[derive(Debug, Clone, PartialEq)]
struct Ratio {
    num: Vec<f64>,
    den: Vec<f64>,
    delay_s: f64,
}

impl Ratio {
    fn of(num: &[f64]) -> Self {
        Self {
            num: num.to_vec(),
            den: vec![1.0],
            delay_s: 0.0,
        }
    }

    fn is_zero(&self) -> bool {
        self.num.iter().all(|c| *c == 0.0)
    }

    fn times(&self, other: &Self) -> Self {
        Self {
            num: polynomial::product(&self.num, &other.num),
            den: polynomial::product(&self.den, &other.den),
            delay_s: self.delay_s + other.delay_s,
        }
    }

    fn inverse(&self) -> Self {
        Self {
            num: self.den.clone(),
            den: self.num.clone(),
            delay_s: -self.delay_s,
        }
    }

    /// `self + sign other`; none where their delays differ.
    fn plus(&self, other: &Self, sign: f64) -> Option<Self> {
        if self.delay_s != other.delay_s {
            return None;
        }
        let (a, mut b, den) = if self.den == other.den {
            (self.num.clone(), other.num.clone(), self.den.clone())
        } else {
            (
                polynomial::product(&self.num, &other.den),
                polynomial::product(&other.num, &self.den),
                polynomial::product(&self.den, &other.den),
            )
        };
        b.iter_mut().for_each(|c| *c *= sign);
        let n = a.len().max(b.len());
        let at = |p: &[f64], i: usize| (i + p.len()).checked_sub(n).map_or(0.0, |k| p[k]);
        Some(Self {
            num: (0..n).map(|i| at(&a, i) + at(&b, i)).collect(),
            den,
            delay_s: self.delay_s,
        })
    }
}

/// The characters that are left, and how deep in parentheses they stand.
struct Reader {
    signs: Vec<char>,
    at: usize,
    depth: usize,
}

impl Reader {
    fn new(text: &str) -> Self {
        // Typographic signs come with text that is copied from papers.
        let plain = |sign| match sign {
            '\u{2212}' | '\u{2013}' => '-',
            '\u{b7}' | '\u{d7}' | '\u{22c5}' => '*',
            'S' => 's',
            other => other,
        };
        Self {
            signs: text.chars().map(plain).collect(),
            at: 0,
            depth: 0,
        }
    }

    /// The next sign that is no blank, which is not taken.
    fn next(&mut self) -> Option<char> {
        while self.signs.get(self.at).is_some_and(|sign| sign.is_whitespace()) {
            self.at += 1;
        }
        self.signs.get(self.at).copied()
    }

    fn takes(&mut self, wanted: char) -> bool {
        let found = self.next() == Some(wanted);
        self.at += usize::from(found);
        found
    }

    fn refuse<T>(&mut self, expected: &str) -> Result<T, String> {
        let found = match self.next() {
            Some(sign) => format!("{sign:?}"),
            None => "the end".to_owned(),
        };
        Err(format!(
            "at character {} stands {found}, expected {expected}; {EXAMPLES}",
            self.at + 1
        ))
    }

    fn whole(mut self) -> Result<Ratio, String> {
        if self.next().is_none() {
            return Err(format!("it is empty; {EXAMPLES}"));
        }
        let all = self.sum()?;
        match self.next() {
            None => Ok(all),
            Some(')') => self.refuse("no ')' that was not opened"),
            Some('=' | 'z' | 'p' | 'x') => self.refuse("an expression in s alone"),
            Some(_) => self.refuse("a number, s, a parenthesis, or one of + - * / ^"),
        }
    }

    fn sum(&mut self) -> Result<Ratio, String> {
        let mut sum = self.product()?;
        loop {
            let begin = self.at;
            let sign = match self.next() {
                Some('+') => 1.0,
                Some('-') => -1.0,
                _ => return Ok(sum),
            };
            self.at += 1;
            let term = self.product()?;
            let Some(total) = sum.plus(&term, sign) else {
                self.at = begin;
                return self.refuse("one delay, as a factor of the whole: 5exp(-0.1s)/(s+1)");
            };
            sum = self.checked(total, begin)?;
        }
    }

    fn product(&mut self) -> Result<Ratio, String> {
        let mut product = self.factor()?;
        let mut divided = false;
        loop {
            let begin = self.at;
            match self.next() {
                Some('*') => {
                    self.at += 1;
                    divided = false;
                    product = product.times(&self.factor()?);
                }
                Some('/') => {
                    self.at += 1;
                    divided = true;
                    self.next();
                    let at = self.at;
                    let by = self.factor()?;
                    if by.is_zero() {
                        return Err(format!("it divides by zero at character {}; {EXAMPLES}", at + 1));
                    }
                    product = product.times(&by.inverse());
                }
                Some(sign) if is_of_number(sign) => {
                    return self.refuse("a sign before a number: s^2 or s*2");
                }
                Some('s' | '(' | 'e') => {
                    if divided {
                        return self.refuse(
                            "a sign: after a divisor it is not clear whether it is divided by this too; \
                             1/(s(s+6)) divides by both, 1/s*(s+6) by s alone",
                        );
                    }
                    product = product.times(&self.power()?);
                }
                _ => return Ok(product),
            }
            product = self.checked(product, begin)?;
        }
    }

    fn factor(&mut self) -> Result<Ratio, String> {
        let mut sign = 1.0;
        loop {
            if self.takes('-') {
                sign = -sign;
            } else if !self.takes('+') {
                break;
            }
        }
        Ok(self.power()?.times(&Ratio::of(&[sign])))
    }

    fn power(&mut self) -> Result<Ratio, String> {
        let base = self.atom()?;
        if !self.takes('^') {
            return Ok(base);
        }
        self.next();
        let begin = self.at;
        let negative = self.takes('-');
        self.next();
        let from = self.at;
        while self.signs.get(self.at).is_some_and(char::is_ascii_digit) {
            self.at += 1;
        }
        let digits: String = self.signs[from..self.at].iter().collect();
        let expected = format!("a whole number up to {HIGHEST_DEGREE} as power");
        let whole = digits.parse::<usize>().ok().filter(|n| *n <= HIGHEST_DEGREE);
        let fraction = self.signs.get(self.at).is_some_and(|sign| *sign == '.');
        let Some(n) = whole.filter(|_| !fraction) else {
            self.at = begin;
            return self.refuse(&expected);
        };
        if negative && base.is_zero() {
            return Err(format!("it divides by zero at character {}; {EXAMPLES}", begin + 1));
        }
        let base = if negative { base.inverse() } else { base };
        let mut power = Ratio::of(&[1.0]);
        for _ in 0..n {
            power = self.checked(power.times(&base), begin)?;
        }
        Ok(power)
    }

    fn atom(&mut self) -> Result<Ratio, String> {
        match self.next() {
            Some('s') => {
                self.at += 1;
                Ok(Ratio::of(&[1.0, 0.0]))
            }
            Some('(') => self.parentheses(),
            Some('e') => self.delay(),
            Some(sign) if is_of_number(sign) => self.number(),
            _ => self.refuse("a number, s or '('"),
        }
    }

    fn parentheses(&mut self) -> Result<Ratio, String> {
        let opened = self.at + 1;
        self.at += 1;
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!(
                "more than {DEEPEST} parentheses stand inside of each other at character {opened}; {EXAMPLES}"
            ));
        }
        let inside = self.sum()?;
        if !self.takes(')') {
            return self.refuse(&format!("')' for the '(' at character {opened}"));
        }
        self.depth -= 1;
        Ok(inside)
    }

    /// `exp(-0.1s)` or `e^(-0.1s)`.
    fn delay(&mut self) -> Result<Ratio, String> {
        const EXPECTED: &str = "exp(-0.1s), a delay in s";
        let begin = self.at;
        let rest = &self.signs[begin..];
        let length = if rest.starts_with(&['e', 'x', 'p']) { 3 } else { 1 };
        self.at += length;
        if (length == 1 && !self.takes('^')) || self.next() != Some('(') {
            self.at = begin;
            return self.refuse(EXPECTED);
        }
        let exponent = self.parentheses()?;
        let slope = match (exponent.num.as_slice(), exponent.den.as_slice()) {
            ([slope, constant], [by]) if *constant == 0.0 && exponent.delay_s == 0.0 => Some(slope / by),
            _ => None,
        };
        let Some(slope) = slope.filter(|v| v.is_finite()) else {
            self.at = begin;
            return self.refuse(EXPECTED);
        };
        Ok(Ratio {
            delay_s: -slope,
            ..Ratio::of(&[1.0])
        })
    }

    fn number(&mut self) -> Result<Ratio, String> {
        let begin = self.at;
        let signs = &self.signs;
        let digits = |from: usize| signs[from..].iter().take_while(|sign| sign.is_ascii_digit()).count();
        let mut end = begin + digits(begin);
        if signs.get(end) == Some(&'.') {
            end += 1 + digits(end + 1);
        }
        // An e that no digits follow is the one of a delay.
        if matches!(signs.get(end), Some('e' | 'E')) {
            let sign = usize::from(matches!(signs.get(end + 1), Some('+' | '-')));
            let exponent = digits((end + 1 + sign).min(signs.len()));
            if exponent > 0 {
                end += 1 + sign + exponent;
            }
        }
        let text: String = signs[begin..end].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.at = end;
                Ok(Ratio::of(&[value]))
            }
            _ => self.refuse("a finite number"),
        }
    }

    /// What a step gives must stay a number, and of a degree that someone means.
    fn checked(&mut self, ratio: Ratio, at: usize) -> Result<Ratio, String> {
        if ratio.num.len().max(ratio.den.len()) > HIGHEST_DEGREE + 1 {
            self.at = at;
            return self.refuse(&format!("a degree of at most {HIGHEST_DEGREE}"));
        }
        if ratio.num.iter().chain(&ratio.den).any(|c| !c.is_finite()) {
            self.at = at;
            return self.refuse("coefficients within the range of floating point");
        }
        Ok(ratio)
    }
}

fn is_of_number(sign: char) -> bool {
    sign.is_ascii_digit() || sign == '.'
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> ContinuousTransferFunction {
        text.parse().unwrap()
    }

    fn reason(text: &str) -> String {
        text.parse::<ContinuousTransferFunction>().unwrap_err().to_string()
    }

    #[test]
    fn one_element_in_all_notations() {
        let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap();
        for text in [
            "90/1,6,0",
            " 90 / 1, 6, 0 ",
            "180/2,12,0",
            "90/(s(s+6))",
            "90/(s*(s+6))",
            "90/(s^2+6s)",
            "90/s/(s+6)",
            "9e1 / ( s * ( s + 6.0 ) )",
            "15/(s(s/6+1))",
            "--90/((s)((s+6)))",
            "90s^-1*(s+6)^-1",
            "90(s+6)^0/(S\u{b7}(S+6))",
            "100/(s^2+6s) \u{2212} 10/(s^2+6s)",
            "0.9e+2/(6s+s^2)",
        ] {
            let found = read(text);
            assert_eq!(found.num().len(), 1, "{text}");
            for (a, b) in found.den().iter().zip(element.den()) {
                // 1/6 has no exact binary digits.
                assert!((a - b).abs() < 1e-14, "{text}: {found:?}");
            }
            assert!(
                (found.num()[0] - 90.0).abs() < 1e-13 && found.delay_s() == 0.0,
                "{text}"
            );
        }
    }

    #[test]
    fn an_expression_is_what_it_evaluates_to() {
        let s = num_complex::Complex64::new(0.0, 1.7);
        let delay = (-0.1 * s).exp();
        for (text, expected) in [
            ("(2s+1)/(s^2+0.4s+1)", (2.0 * s + 1.0) / (s * s + 0.4 * s + 1.0)),
            ("1/s", 1.0 / s),
            ("5/(s^2)", 5.0 / (s * s)),
            ("0.5(s+1)/s/(s+2)", 0.5 * (s + 1.0) / s / (s + 2.0)),
            ("-.5s/(s+2.)^3", -0.5 * s / (s + 2.0).powi(3)),
            ("1/s - 1/(s+1)", 1.0 / s - 1.0 / (s + 1.0)),
            ("2+1/s", 2.0 + 1.0 / s),
            ("1/s*(s+6)", (s + 6.0) / s),
            ("2exp(-0.1s)/s", 2.0 * delay / s),
            ("2e^(-s/10)/s", 2.0 * delay / s),
            ("exp(-0.05s)^2*2/s", 2.0 * delay / s),
            ("2e-1exp(-0.1s)/s", 0.2 * delay / s),
            ("(exp(-0.1s) + exp(-0.1s)s)/s^2", delay * (1.0 + s) / (s * s)),
            ("7", s * 0.0 + 7.0),
            ("0/(s+1)", s * 0.0),
        ] {
            assert!((read(text).response(1.7) - expected).norm() < 1e-14, "{text}");
        }
    }

    #[test]
    fn what_is_shown_reads_back_the_same() {
        for text in [
            "90/1,6,0",
            "1/s",
            "5/s^2",
            "-3.25/1,0.1,0,0",
            "1,-0.30000000000000004/1,1e-9,1e30",
            "0/1,2",
            "(2s+1)exp(-0.123s)/(s^2+0.4s+1)",
            "-exp(-0.1s)",
            "(s+1)/(s+2)",
            "1e-300/(s+1e-5)",
            "2.5",
            "(s^3 - s)/(s^4 + 1)",
        ] {
            let one = read(text);
            let shown = one.to_string();
            assert_eq!(read(&shown), one, "{text} shown as {shown}");
        }
        assert_eq!(
            read("(2s+1)exp(-0.1s)/(s(s+6))").to_string(),
            "(2s + 1)exp(-0.1s)/(s^2 + 6s)"
        );
        assert_eq!(read("-1/s^2").to_string(), "-1/s^2");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        for (text, expected) in [
            ("", "it is empty"),
            ("  ", "it is empty"),
            ("s", "higher degree"),
            ("(s^2+1)/(s+1)", "higher degree"),
            ("1,0,0/1", "higher degree"),
            (
                "s2/(s+1)^3",
                "at character 2 stands '2', expected a sign before a number",
            ),
            ("1/0", "divides by zero at character 3"),
            ("1/(s-s)", "divides by zero at character 3"),
            ("1/0,0", "the denominator must not be zero"),
            ("0^-1", "divides by zero"),
            (
                "90/(s(s+6)",
                "at character 11 stands the end, expected ')' for the '(' at character 4",
            ),
            ("90/(s(s+6)))", "at character 12 stands ')'"),
            ("90/s(s+6)", "at character 5 stands '('"),
            ("1/2s", "at character 4 stands 's'"),
            ("90/(z+1)", "at character 5 stands 'z'"),
            ("90/s^0.5", "at character 6 stands '0', expected a whole number"),
            ("90/s^", "at character 6 stands the end"),
            ("90/s^99", "a whole number up to 50"),
            ("90*/s", "at character 4 stands '/'"),
            ("90/", "at character 4 stands the end"),
            ("1.2.3/s", "at character 4 stands '.'"),
            ("1e999/s", "a finite number"),
            ("1e200*1e200/s", "range of floating point"),
            ("NaN", "at character 1 stands 'N'"),
            ("NaN/1,0", "at character 1 stands NaN"),
            ("1/1,x,0", "at character 5 stands x"),
            ("1/1,,0", "at character 5 stands nothing"),
            ("1,2", "no '/'"),
            ("1/2/3,4", "at character 3 stands 2/3"),
            ("exp(-0.1)/s", "exp(-0.1s)"),
            ("exp(0.1s)/s", "delay is -0.1 s"),
            ("1/exp(-0.1s)", "delay is -0.1 s"),
            ("1/s+exp(-s)/s", "one delay"),
            ("e/s", "exp(-0.1s)"),
            ("(s^50)^50", "a degree of at most 50"),
            ("90 % s", "at character 4 stands '%'"),
        ] {
            let message = reason(text);
            assert!(message.contains(expected), "{text}: {message}");
        }
        assert!(reason("90/(s").contains("90/(s(s+6))"));
        assert!(reason(&"(".repeat(100_000)).contains("more than 50 parentheses"));
        assert!(reason(&"-".repeat(100_000)).contains("stands the end"));
    }
}
