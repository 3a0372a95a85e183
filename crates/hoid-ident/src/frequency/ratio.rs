//! A ratio of sums over runs, `H = sum a_i / sum b_i`, and its standard error.
//!
//! To first order `dH = sum (a_i - H b_i) / sum b_i` with independent terms, so the variance is
//! `sigma^2 = n/(n-1) sum |a_i - H b_i|^2 / |sum b_i|^2`. A region without linearisation follows from the mean of
//! `a_i - H b_i`, which has the expectation zero only at the true H: n times its squared modulus over the sample
//! variance has the F distribution with 2 and 2(n - 1) degrees of freedom for circular normal errors. The values of H
//! that F does not exclude at a given level form a disc if the denominator differs from zero at this level (E. C.
//! Fieller, J. Royal Statistical Society B 16 (1954) 175-185, for complex ratios). The standard error of a quantity
//! computed from several ratios comes from the jackknife over runs, `sigma^2 = (n-1)/n sum (y_(i) - mean)^2`, where
//! y_(i) is the value without run i (B. Efron, *The Jackknife, the Bootstrap and Other Resampling Plans*, 1982, chapter
//! 3).

use hoid_model::{Complex64, uncertainty::Estimate};
use hoid_numerics::statistics::{self, sample_variance, sum_of_squared_deviations};

/// Terms of the numerator and the denominator, one pair for each run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ratio(pub Vec<(Complex64, Complex64)>);

impl Ratio {
    fn numerator_and_denominator(&self, without: Option<usize>) -> (Complex64, Complex64) {
        let zero = Complex64::new(0.0, 0.0);
        let kept = self.0.iter().enumerate().filter(|(i, _)| Some(*i) != without);
        kept.fold((zero, zero), |(a, b), (_, term)| (a + term.0, b + term.1))
    }

    /// Returns H from all runs, or from all runs except one.
    pub fn value(&self, without: Option<usize>) -> Complex64 {
        let (a, b) = self.numerator_and_denominator(without);
        a / b
    }

    /// Returns the ratio `a_i/b_i` of each run.
    pub fn run_ratios(&self) -> Vec<Complex64> {
        self.0.iter().map(|(a, b)| a / b).collect()
    }

    /// Returns the standard error sigma; `None` for one run.
    pub fn standard_error(&self) -> Option<f64> {
        let n = self.0.len() as f64;
        let (a, b) = self.numerator_and_denominator(None);
        let h = a / b;
        let squares: f64 = self.0.iter().map(|(a, b)| (a - h * b).norm_sqr()).sum();
        (n > 1.0).then(|| (n / (n - 1.0) * squares).sqrt() / b.norm())
    }

    /// Returns the centre and radius of the disc that contains the true ratio with this probability; `None` for one
    /// run, or if the region is unbounded.
    pub fn confidence_disc(&self, probability: f64) -> Option<(Complex64, f64)> {
        let n = self.0.len() as f64;
        let (a, b) = self.numerator_and_denominator(None);
        // Quantile of F(2, 2(n - 1)) in closed form.
        let level = (n - 1.0) * ((1.0 - probability).powf(-1.0 / (n - 1.0)) - 1.0);
        let scale = n * level / (n - 1.0);
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, Complex64::new(0.0, 0.0));
        for (a_i, b_i) in &self.0 {
            let (a_i, b_i) = (a_i - a / n, b_i - b / n);
            aa += a_i.norm_sqr();
            bb += b_i.norm_sqr();
            ab += a_i * b_i.conj();
        }
        // The condition |A - H B|^2 <= scale sum |a_i - H b_i - mean|^2 is p |H|^2 - 2 Re(H* q) + r <= 0.
        let p = b.norm_sqr() - scale * bb;
        let q = a * b.conj() - scale * ab;
        let r = a.norm_sqr() - scale * aa;
        let square = (q.norm_sqr() - p * r) / (p * p);
        (n > 1.0 && p > 0.0 && square.is_finite()).then(|| (q / p, square.max(0.0).sqrt()))
    }
}

/// Returns a value with its standard error from the jackknife. There is no standard error if there is only one run, or
/// if a value computed without one of the runs is missing.
pub(super) fn jackknife(value: f64, without: &[Option<f64>]) -> Estimate {
    let known: Vec<f64> = without.iter().copied().flatten().collect();
    let n = without.len();
    if n < 2 || known.len() < n {
        return Estimate::fixed(value);
    }
    Estimate::with_variance(value, sum_of_squared_deviations(&known) * (n as f64 - 1.0) / n as f64)
}

/// Returns the mean of values with its standard error, computed from their scatter; there is no standard error for a
/// single value.
pub(super) fn mean(values: &[f64]) -> Estimate {
    let value = statistics::mean(values);
    match standard_deviation(values) {
        Some(s) => Estimate::with_variance(value, s * s / values.len() as f64),
        None => Estimate::fixed(value),
    }
}

/// Returns the standard deviation of values with the divisor n - 1; `None` for fewer than two values.
pub(super) fn standard_deviation(values: &[f64]) -> Option<f64> {
    (values.len() > 1).then(|| sample_variance(values).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratio_with_equal_denominators_is_the_mean() {
        let values = [1.0, 2.0, 4.0, 4.5];
        let terms = |b: f64| {
            values
                .iter()
                .map(|v| (Complex64::new(0.0, v * b), Complex64::new(b, 0.0)))
                .collect()
        };
        let (ratio, expected) = (Ratio(terms(3.0)), mean(&values));
        assert!((ratio.value(None) - Complex64::new(0.0, expected.value)).norm() < 1e-15);
        let error = expected.standard_error.unwrap();
        assert!((ratio.standard_error().unwrap() - error).abs() < 1e-15);
        // For a mean, the jackknife equals the classical formula.
        let without: Vec<Option<f64>> = (0..4).map(|i| Some(ratio.value(Some(i)).im)).collect();
        assert!((jackknife(expected.value, &without).standard_error.unwrap() - error).abs() < 1e-15);
        assert_eq!(jackknife(1.0, &[Some(1.0), None]).standard_error, None);
        // For a complex mean, |dH|^2 <= F sigma^2: F(2, 6) exceeds 5.143 with a probability of 5 %.
        let (centre, radius) = ratio.confidence_disc(0.95).unwrap();
        assert!((centre - ratio.value(None)).norm() < 1e-14 && (radius / error - 5.143_f64.sqrt()).abs() < 1e-4);
        let zero = Complex64::new(0.0, 0.0);
        let vague = Ratio(vec![
            (zero + 1.0, zero + 1.0),
            (zero + 2.0, zero - 0.9),
            (zero + 1.5, zero + 0.3),
        ]);
        assert_eq!(vague.confidence_disc(0.95), None);
        let one = Ratio(vec![(Complex64::new(1.0, 0.0), Complex64::new(2.0, 0.0))]);
        assert_eq!((one.standard_error(), one.confidence_disc(0.95)), (None, None));
        assert_eq!(mean(&[2.0]), Estimate::fixed(2.0));
    }
}
