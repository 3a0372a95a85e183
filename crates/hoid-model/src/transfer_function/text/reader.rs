//! Recursive descent parser for an expression in s ([`super`]).

use super::{coefficients::EXAMPLES, ratio::Ratio};

/// Highest accepted degree; a polynomial of higher degree is probably a typing error, and its roots are dominated by
/// rounding.
const HIGHEST_DEGREE: usize = 50;
/// Largest depth of nested parentheses.
const MAX_DEPTH: usize = 50;

/// Parser with the remaining characters and the current depth of parentheses.
pub(super) struct Reader {
    signs: Vec<char>,
    position: usize,
    depth: usize,
}

impl Reader {
    pub fn new(text: &str) -> Self {
        // Text copied from papers may contain typographic characters.
        let plain = |sign| match sign {
            '\u{2212}' | '\u{2013}' => '-',
            '\u{b7}' | '\u{d7}' | '\u{22c5}' => '*',
            'S' => 's',
            other => other,
        };
        Self {
            signs: text.chars().map(plain).collect(),
            position: 0,
            depth: 0,
        }
    }

    /// Returns the next character that is not a blank, without consuming it.
    fn peek(&mut self) -> Option<char> {
        while self.signs.get(self.position).is_some_and(|sign| sign.is_whitespace()) {
            self.position += 1;
        }
        self.signs.get(self.position).copied()
    }

    fn accept(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.position += usize::from(found);
        found
    }

    fn expected_error<T>(&mut self, expected: &str) -> Result<T, String> {
        let found = match self.peek() {
            Some(sign) => format!("{sign:?}"),
            None => "the end".to_owned(),
        };
        Err(format!(
            "at character {} there is {found}, expected {expected}; {EXAMPLES}",
            self.position + 1
        ))
    }

    pub fn expression(mut self) -> Result<Ratio, String> {
        if self.peek().is_none() {
            return Err(format!("it is empty; {EXAMPLES}"));
        }
        let all = self.sum()?;
        match self.peek() {
            None => Ok(all),
            Some(')') => self.expected_error("a '(' before this ')'"),
            Some('=' | 'z' | 'p' | 'x') => self.expected_error("an expression in s only"),
            Some(_) => self.expected_error("a number, s, a parenthesis, or one of + - * / ^"),
        }
    }

    fn sum(&mut self) -> Result<Ratio, String> {
        let mut sum = self.product()?;
        loop {
            let start = self.position;
            let sign = match self.peek() {
                Some('+') => 1.0,
                Some('-') => -1.0,
                _ => return Ok(sum),
            };
            self.position += 1;
            let term = self.product()?;
            let Some(total) = sum.plus(&term, sign) else {
                self.position = start;
                return self.expected_error("one delay, as a factor of the whole function: 5exp(-0.1s)/(s+1)");
            };
            sum = self.check_ratio(total, start)?;
        }
    }

    fn product(&mut self) -> Result<Ratio, String> {
        let mut product = self.factor()?;
        let mut divided = false;
        loop {
            let start = self.position;
            match self.peek() {
                Some('*') => {
                    self.position += 1;
                    divided = false;
                    product = product.times(&self.factor()?);
                }
                Some('/') => {
                    self.position += 1;
                    divided = true;
                    self.peek();
                    let at = self.position;
                    let by = self.factor()?;
                    if by.is_zero() {
                        return Err(format!("it divides by zero at character {}; {EXAMPLES}", at + 1));
                    }
                    product = product.times(&by.inverse());
                }
                Some(sign) if may_be_in_number(sign) => {
                    return self.expected_error("'^' or '*' before a number: s^2 or s*2");
                }
                Some('s' | '(' | 'e') => {
                    if divided {
                        return self.expected_error(
                            "'*' or parentheses, because this may or may not be part of the divisor: 1/(s(s+6)) \
                             divides by both factors, 1/s*(s+6) by s only",
                        );
                    }
                    product = product.times(&self.power()?);
                }
                _ => return Ok(product),
            }
            product = self.check_ratio(product, start)?;
        }
    }

    fn factor(&mut self) -> Result<Ratio, String> {
        let mut sign = 1.0;
        loop {
            if self.accept('-') {
                sign = -sign;
            } else if !self.accept('+') {
                break;
            }
        }
        Ok(self.power()?.times(&Ratio::of(&[sign])))
    }

    fn power(&mut self) -> Result<Ratio, String> {
        let base = self.atom()?;
        if !self.accept('^') {
            return Ok(base);
        }
        self.peek();
        let start = self.position;
        let negative = self.accept('-');
        self.peek();
        let from = self.position;
        while self.signs.get(self.position).is_some_and(char::is_ascii_digit) {
            self.position += 1;
        }
        let digits: String = self.signs[from..self.position].iter().collect();
        let expected = format!("a whole number up to {HIGHEST_DEGREE} as power");
        let whole = digits.parse::<usize>().ok().filter(|n| *n <= HIGHEST_DEGREE);
        let fraction = self.signs.get(self.position).is_some_and(|sign| *sign == '.');
        let Some(n) = whole.filter(|_| !fraction) else {
            self.position = start;
            return self.expected_error(&expected);
        };
        if negative && base.is_zero() {
            return Err(format!("it divides by zero at character {}; {EXAMPLES}", start + 1));
        }
        let base = if negative { base.inverse() } else { base };
        let mut power = Ratio::of(&[1.0]);
        for _ in 0..n {
            power = self.check_ratio(power.times(&base), start)?;
        }
        Ok(power)
    }

    fn atom(&mut self) -> Result<Ratio, String> {
        match self.peek() {
            Some('s') => {
                self.position += 1;
                Ok(Ratio::of(&[1.0, 0.0]))
            }
            Some('(') => self.parentheses(),
            Some('e') => self.delay(),
            Some(sign) if may_be_in_number(sign) => self.number(),
            _ => self.expected_error("a number, s or '('"),
        }
    }

    fn parentheses(&mut self) -> Result<Ratio, String> {
        let opened = self.position + 1;
        self.position += 1;
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(format!(
                "more than {MAX_DEPTH} parentheses are nested at character {opened}; {EXAMPLES}"
            ));
        }
        let inside = self.sum()?;
        if !self.accept(')') {
            return self.expected_error(&format!("')' for the '(' at character {opened}"));
        }
        self.depth -= 1;
        Ok(inside)
    }

    /// Parses `exp(-0.1s)` or `e^(-0.1s)`.
    fn delay(&mut self) -> Result<Ratio, String> {
        const EXPECTED: &str = "exp(-0.1s), a delay in s";
        let start = self.position;
        let rest = &self.signs[start..];
        let length = if rest.starts_with(&['e', 'x', 'p']) { 3 } else { 1 };
        self.position += length;
        if (length == 1 && !self.accept('^')) || self.peek() != Some('(') {
            self.position = start;
            return self.expected_error(EXPECTED);
        }
        let exponent = self.parentheses()?;
        let slope = match (exponent.num.as_slice(), exponent.den.as_slice()) {
            ([slope, constant], [by]) if *constant == 0.0 && exponent.delay_s == 0.0 => Some(slope / by),
            _ => None,
        };
        let Some(slope) = slope.filter(|v| v.is_finite()) else {
            self.position = start;
            return self.expected_error(EXPECTED);
        };
        Ok(Ratio {
            delay_s: -slope,
            ..Ratio::of(&[1.0])
        })
    }

    fn number(&mut self) -> Result<Ratio, String> {
        let start = self.position;
        let signs = &self.signs;
        let digits = |from: usize| signs[from..].iter().take_while(|sign| sign.is_ascii_digit()).count();
        let mut end = start + digits(start);
        if signs.get(end) == Some(&'.') {
            end += 1 + digits(end + 1);
        }
        // An e that is not followed by digits belongs to a delay.
        if matches!(signs.get(end), Some('e' | 'E')) {
            let sign = usize::from(matches!(signs.get(end + 1), Some('+' | '-')));
            let exponent = digits((end + 1 + sign).min(signs.len()));
            if exponent > 0 {
                end += 1 + sign + exponent;
            }
        }
        let text: String = signs[start..end].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.position = end;
                Ok(Ratio::of(&[value]))
            }
            _ => self.expected_error("a finite number"),
        }
    }

    /// Checks that an intermediate result is finite and of a reasonable degree.
    fn check_ratio(&mut self, ratio: Ratio, at: usize) -> Result<Ratio, String> {
        if ratio.num.len().max(ratio.den.len()) > HIGHEST_DEGREE + 1 {
            self.position = at;
            return self.expected_error(&format!("a degree of at most {HIGHEST_DEGREE}"));
        }
        if ratio.num.iter().chain(&ratio.den).any(|c| !c.is_finite()) {
            self.position = at;
            return self.expected_error("coefficients within the range of floating point");
        }
        Ok(ratio)
    }
}

fn may_be_in_number(sign: char) -> bool {
    sign.is_ascii_digit() || sign == '.'
}
