//! Tests whether the recorded loop has the controlled element given by the user.
//!
//! In a loop with the element `P = B/A`, target r and disturbance d, `e = r - P (u + d)`. In terms of the Fourier
//! coefficients of a record, which need not be periodic,
//!
//! `A(s) E = C(s) R - B(s) e^{-s delta} h(s) (U + kappa D) + T(s)`, `s = j omega`,
//!
//! with the hold `h = e^{-s Ts/2} sinc(omega Ts/2)` of u between its samples and a polynomial T for the difference
//! between the initial and the final states (R. Pintelon and J. Schoukens, *System Identification: A Frequency Domain
//! Approach*, 2012, section 6.3.2). The equation is linear in the coefficients of A, B, C, `B kappa` and T, which are
//! found by least squares at the frequencies of manual control. The delay is scanned, with the same delay for d as for
//! u and, in case only u was recorded late, without a delay for d. Rows are divided by `B h` of the previous iteration,
//! so a residual is equivalent to a disturbance at u (C. K. Sanathanan and J. Koerner, IEEE Trans. Automatic Control 8
//! (1963) 56-58), and weighted by the smoothed spectrum of the residuals.
//!
//! | file | contents |
//! |---|---|
//! | `spectra` | Fourier coefficients, and the exogenous channels of the loop |
//! | `equations` | the least-squares fit of an element |
//!
//! If a disturbance was not recorded, the person responds to it, so u is not independent of it. The element is
//! therefore assessed only if the recorded signals explain all but [`MAX_UNEXPLAINED_SHARE`] of the power, as they do
//! if all signals of the loop were recorded. C is free, since it equals A only if e is not scaled.

mod equations;
mod spectra;

use hoid_model::{Complex64, ContinuousTransferFunction, Finding, Record};

use equations::ElementFit;
use spectra::{ExogenousChannels, MAX_FREQUENCIES, Spectra};

/// Largest unexplained share of the power, expressed as a disturbance at u, for which the element is assessed.
const MAX_UNEXPLAINED_SHARE: f64 = 0.02;
/// The same without a recorded target or disturbance. If one exists, e and u are then related at its frequencies by the
/// inverse of the person's response, which an element can imitate.
const MAX_UNEXPLAINED_WITHOUT_EXCITATION: f64 = 1e-3;
/// Share of the power that remains unexplained for exact data because the delay is scanned in steps; smaller
/// differences between elements do not count.
const EXACT_DATA_SHARE: f64 = 1e-4;
/// Unexplained share up to which the given element is accepted: the power of a response that differs by
/// [`MAX_RESPONSE_DIFFERENCE`].
const MAX_UNEXPLAINED_BY_GIVEN: f64 = 0.01;
/// Ratio of the unexplained shares of the given and of the identified element up to which the given element is
/// accepted. Without a recorded target, for example, neither element explains the power of the target.
const MAX_RATIO_TO_IDENTIFIED: f64 = 4.0;
/// Frequencies at which two elements are compared, rad/s: the range in which people close their loops.
const COMPARED_FREQUENCIES_RAD_S: [f64; 7] = [0.5, 0.75, 1.1, 1.6, 2.4, 3.6, 5.4];
/// Largest difference between the logarithms of two responses that count as equal: 10 % of the gain or 6 deg.
const MAX_RESPONSE_DIFFERENCE: f64 = 0.1;
/// Largest delay in samples for which e and u count as aligned: a recorder may store one of them a sample before or
/// after the other.
const MAX_ALIGNED_DELAY_SAMPLES: f64 = 1.5;
/// Largest number of poles of a given element that can be tested.
const MAX_POLES: usize = 4;

/// The controlled element identified from a recorded loop.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedElement {
    /// Element through which e responds to u, with the delay of the given element.
    pub element: ContinuousTransferFunction,
    /// Delay of the machine beyond that of the given element, s; negative if u was recorded late.
    pub delay_s: f64,
    /// Share of the power that the element does not explain, expressed as a disturbance at u.
    pub unexplained_share: f64,
    /// Frequency in rad/s at which the response of the element differs most from the given element, apart from the
    /// delay, and the ratio of the two responses at this frequency.
    pub difference: (f64, Complex64),
    /// Largest delay for which e and u count as aligned, s.
    max_aligned_delay_s: f64,
}

impl RecordedElement {
    /// True if the identified element has the same response as the given element, apart from a delay.
    pub fn matches_given(&self) -> bool {
        self.difference.1.ln().norm() <= MAX_RESPONSE_DIFFERENCE
    }

    /// Returns a warning if the element is not the given element, or if e and u are not aligned.
    pub fn finding(&self, given: &ContinuousTransferFunction) -> Option<Finding> {
        let (omega, ratio) = self.difference;
        let late = 1e3 * self.delay_s;
        let beyond = match self.delay_s.abs() > self.max_aligned_delay_s {
            true if late > 0.0 => format!(" with an additional delay of {late:.0} ms"),
            true => format!(" with u recorded {:.0} ms late", -late),
            false => String::new(),
        };
        let loop_lost = "the crossover and the phase margin do not apply to the recorded loop";
        let message = match (self.matches_given(), beyond.is_empty()) {
            (true, true) => return None,
            (true, false) => format!("the recorded element is {given}{beyond}: {loop_lost}"),
            (false, _) => format!(
                "the recorded element is {}{beyond}, not {given}: at {omega} rad/s the recorded gain is {} \
                 times the given gain and the phase differs by {:+.0} deg; {loop_lost}",
                self.element,
                round_to_three_digits(ratio.norm()),
                ratio.arg().to_degrees()
            ),
        };
        Some(Finding::warning("controlled-element", message))
    }
}

/// Identifies the controlled element from closed-loop records. `None` if the records do not determine it because
/// signals of the loop are missing or the records are too short. `excitation` is the name of a channel with a target or
/// a disturbance.
pub fn recorded_element(
    records: &[Record],
    given: &ContinuousTransferFunction,
    excitation: Option<&str>,
) -> Option<RecordedElement> {
    let (m, n) = (given.num().len() - 1, given.den().len() - 1);
    let sample_time_s = records.first()?.sample_time().s();
    if n > MAX_POLES || records.iter().any(|record| record.input_channel().is_none()) {
        return None;
    }
    let exogenous = ExogenousChannels::of(records, excitation);
    let mut spectra = Vec::new();
    let mut frequencies = 0;
    for record in records {
        if frequencies < MAX_FREQUENCIES {
            let found = Spectra::of(record, &exogenous)?;
            frequencies += found.omega.len();
            spectra.push(found);
        }
    }
    // The candidates, in ascending complexity: one pole, two poles without or with a zero, the given orders, and the
    // given orders with one more pole.
    let mut orders = vec![(0, 1), (0, 2), (1, 2), (m, n.max(1)), (m, n + 1)];
    orders.sort_by_key(|&(m, n)| (m + n, n));
    orders.dedup();
    let fits: Vec<ElementFit> = orders
        .iter()
        .filter_map(|&(m, n)| ElementFit::of(&spectra, m, n, sample_time_s))
        .collect();
    let most = match exogenous.is_empty() {
        true => MAX_UNEXPLAINED_WITHOUT_EXCITATION,
        false => MAX_UNEXPLAINED_SHARE,
    };
    let least = fits
        .iter()
        .map(|fit| fit.unexplained_share)
        .fold(f64::INFINITY, f64::min);
    let chosen = fits
        .into_iter()
        .find(|fit| fit.unexplained_share <= 2.0 * least + EXACT_DATA_SHARE)
        .filter(|fit| fit.unexplained_share <= most)?;
    let aligned_s = MAX_ALIGNED_DELAY_SAMPLES * sample_time_s;
    // A zero with a delay, or a slow pole, can look like another element in the band of manual control. The test
    // therefore asks whether the given element explains the record.
    if let Some((delay_s, unexplained)) = chosen.of_given(&spectra, given, aligned_s)
        && unexplained <= MAX_UNEXPLAINED_BY_GIVEN.max(MAX_RATIO_TO_IDENTIFIED * chosen.unexplained_share)
    {
        return Some(RecordedElement {
            element: given.clone(),
            delay_s,
            unexplained_share: unexplained,
            difference: (COMPARED_FREQUENCIES_RAD_S[0], Complex64::ONE),
            max_aligned_delay_s: aligned_s,
        });
    }
    let element = transfer_function(&chosen, given.delay_s())?;
    let ratio = |omega: f64| (omega, element.response(omega) / given.response(omega));
    let difference = COMPARED_FREQUENCIES_RAD_S
        .map(ratio)
        .into_iter()
        .filter(|(_, ratio)| ratio.ln().norm().is_finite())
        .max_by(|a, b| a.1.ln().norm().total_cmp(&b.1.ln().norm()))?;
    Some(RecordedElement {
        delay_s: chosen.delay_s - given.delay_s(),
        unexplained_share: chosen.unexplained_share,
        element,
        difference,
        max_aligned_delay_s: aligned_s,
    })
}

/// Returns the fitted element with this delay, without terms that are negligible at the frequencies compared.
fn transfer_function(fit: &ElementFit, delay_s: f64) -> Option<ContinuousTransferFunction> {
    let without_small = |p: &[f64]| -> Vec<f64> {
        let sizes = |omega: f64| {
            p.iter()
                .rev()
                .enumerate()
                .map(move |(i, c)| c.abs() * omega.powi(i as i32))
        };
        let matters = |i: usize| {
            [COMPARED_FREQUENCIES_RAD_S[0], COMPARED_FREQUENCIES_RAD_S[6]]
                .into_iter()
                .any(|omega| {
                    let largest = sizes(omega).fold(0.0, f64::max);
                    sizes(omega).nth(i).is_some_and(|size| size > 0.02 * largest)
                })
        };
        let last = p.len() - 1;
        let kept = p
            .iter()
            .enumerate()
            .map(|(i, c)| if matters(last - i) { *c } else { 0.0 });
        kept.map(round_to_three_digits).collect()
    };
    let found = ContinuousTransferFunction::new(&without_small(&fit.num), &without_small(&fit.den));
    found.and_then(|found| found.with_delay(delay_s)).ok()
}

/// Rounds to three significant digits, which are sufficient for a test.
fn round_to_three_digits(value: f64) -> f64 {
    if value == 0.0 {
        return value;
    }
    let unit = 10f64.powf(value.abs().log10().floor() - 2.0);
    // If the unit is below one, a quotient of integers avoids trailing decimal digits.
    if unit < 1.0 {
        (value / unit).round() / (1.0 / unit).round()
    } else {
        (value / unit).round() * unit
    }
}

#[cfg(test)]
#[path = "recorded_element/tests.rs"]
mod tests;
