//! Starting values and orders of the noise model: an autoregression of the part of u that the operator does not
//! explain.
//!
//! `v(t) = -d_1 v(t-1) - ... - d_nd v(t-nd) + eps(t)` is fitted by least squares over all records together (the
//! covariance method). All orders use the same sums of products, which start in each record at the sample that the
//! highest order permits. The order minimises Akaike's criterion `n ln V + 2 nd`: the remnant of people is not an
//! autoregression of any order, and the bias of the operator depends on how well the noise model predicts (R. Shibata,
//! *Annals of Statistics* 8 (1980) 147-164).

use crate::linalg::{
    gram::Gram,
    least_squares::solve_symmetric,
    products::{LaggedColumn, gram},
};

/// Largest modulus of a root of C in a starting value.
const MAX_ROOT_MODULUS: f64 = 0.999;
/// Factor by which larger roots are moved inwards, and maximum number of times that this is done.
const ROOT_SHRINK_FACTOR: f64 = 0.98;
const MAX_SHRINKS: usize = 200;

/// Coefficients d of an autoregression, and its loss.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Autoregression {
    pub d: Vec<f64>,
    pub loss: f64,
}

/// Cost of a coefficient in the criterion `n ln V`: 2 (Akaike) or `ln n` (Schwarz).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Penalty {
    Akaike,
    Schwarz,
}

/// Sums of products of v and its past, `sum v(t-i) v(t-j)` for i, j from 0 to the highest order.
pub(crate) struct NoiseProducts {
    highest: usize,
    count: usize,
    products: Gram,
}

impl NoiseProducts {
    /// Computes the sums of products of these series up to the order `highest`.
    pub fn new(series: &[Vec<f64>], highest: usize) -> Self {
        let mut products = Gram::new(highest + 1);
        let mut count = 0;
        for v in series.iter().filter(|v| v.len() > highest) {
            count += v.len() - highest;
            let lagged = (0..=highest).map(|lag| LaggedColumn {
                values: &v[highest - lag..v.len() - lag],
                is_shift_of_previous: lag > 0,
            });
            products.add_all(&gram(&lagged.collect::<Vec<_>>()));
        }
        Self {
            highest,
            count,
            products,
        }
    }

    /// Returns the autoregression of this order; `None` if the normal equations are singular or no residual is left.
    pub fn fit(&self, order: usize) -> Option<Autoregression> {
        let power = self.products.at(0, 0);
        if self.count == 0 || power <= 0.0 {
            return None;
        }
        let (gram, past) = self.products.system(1..order + 1, 0);
        let a = if order == 0 {
            Vec::new()
        } else {
            solve_symmetric(&gram, &past)?
        };
        let explained: f64 = a.iter().zip(&past).map(|(a, p)| a * p).sum();
        let loss = (power - explained) / self.count as f64;
        (loss > 0.0).then(|| Autoregression {
            d: a.iter().map(|a| -a).collect(),
            loss,
        })
    }

    /// Returns the autoregression of this order or, if it does not exist, of the highest possible lower order, padded
    /// with zeros. For a smooth, noise-free v fewer coefficients predict v to rounding accuracy, and higher orders do
    /// not exist.
    pub fn fit_up_to(&self, order: usize) -> Option<Autoregression> {
        let mut found = (0..=order).rev().find_map(|order| self.fit(order))?;
        found.d.resize(order, 0.0);
        Some(found)
    }

    /// Returns the order with the smallest value of the criterion; `None` if no autoregression exists.
    pub fn best_order(&self, orders: impl Iterator<Item = usize>, penalty: Penalty) -> Option<usize> {
        let n = self.count as f64;
        let of_one = match penalty {
            Penalty::Akaike => 2.0,
            Penalty::Schwarz => n.ln(),
        };
        let value = |order: usize| Some((n * self.fit(order)?.loss.ln() + of_one * order as f64, order));
        let best = orders
            .filter(|o| *o <= self.highest)
            .filter_map(value)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, order)| order)
    }
}

/// Returns starting values `[c.., d..]` of an ARMA noise model: a long autoregression estimates the innovations, and v
/// is regressed on its own past and on the past innovations (E. J. Hannan and J. Rissanen, *Biometrika* 69 (1982)
/// 81-94). If C is not invertible, its roots are moved inwards, `c_k rho^k`.
pub(crate) fn hannan_rissanen(series: &[Vec<f64>], (nc, nd): (usize, usize), long: usize) -> Option<Vec<f64>> {
    let d = NoiseProducts::new(series, long).fit(long)?.d;
    let q = nc + nd;
    let mut products = Gram::new(q + 1);
    for v in series {
        let past = |t: usize| (0..long).map(|k| d[k] * v[t - k - 1]).sum::<f64>();
        let innovation: Vec<f64> = (0..v.len())
            .map(|t| if t < long { 0.0 } else { v[t] + past(t) })
            .collect();
        for t in long + nc.max(nd)..v.len() {
            let x: Vec<f64> = (1..=nc)
                .map(|k| innovation[t - k])
                .chain((1..=nd).map(|k| -v[t - k]))
                .chain([v[t]])
                .collect();
            products.add(|i| x[i]);
        }
    }
    let (gram, right) = products.system(0..q, q);
    let mut found = solve_symmetric(&gram, &right)?;
    // The coefficients c_k rho^k multiply all roots of C by rho.
    for _ in 0..MAX_SHRINKS {
        if hoid_core::stability::roots_inside(&found[..nc], MAX_ROOT_MODULUS) {
            return Some(found);
        }
        let mut factor = 1.0;
        for c in &mut found[..nc] {
            factor *= ROOT_SHRINK_FACTOR;
            *c *= factor;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(n: usize) -> Vec<f64> {
        let mut state = 3_u64;
        let mut uniform = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut v = vec![0.0, 0.0];
        for t in 2..n {
            v.push(1.5 * v[t - 1] - 0.7 * v[t - 2] + uniform());
        }
        v
    }

    #[test]
    fn autoregression_and_its_order_are_found() {
        let all = [series(4000), series(3000)];
        let products = NoiseProducts::new(&all, 8);
        let fit = products.fit(2).unwrap();
        // The standard errors are about 0.7/sqrt(7000).
        assert!(
            (fit.d[0] + 1.5).abs() < 0.03 && (fit.d[1] - 0.7).abs() < 0.03,
            "{fit:?}"
        );
        assert!((fit.loss - 1.0 / 12.0).abs() < 0.01);
        // With this many samples Akaike's criterion does not select too low an order, and excess coefficients reduce
        // the loss only slightly.
        let order = products.best_order(0..=8, Penalty::Akaike).unwrap();
        let gained = 1.0 - products.fit(order).unwrap().loss / fit.loss;
        assert!(order >= 2 && gained < 0.003, "{order} {gained}");
    }

    #[test]
    fn arma_model_is_found_by_two_regressions() {
        // The series is a moving average of the one above: v = w + 0.6 w(t-1), where w is the autoregression.
        let w = series(8000);
        let v: Vec<f64> = (1..w.len()).map(|t| w[t] + 0.6 * w[t - 1]).collect();
        let found = hannan_rissanen(&[v], (1, 2), 24).unwrap();
        // The standard errors are about 0.01.
        for (value, truth) in found.iter().zip([0.6, -1.5, 0.7]) {
            assert!((value - truth).abs() < 0.05, "{found:?}");
        }
        assert_eq!(hannan_rissanen(&[vec![0.0; 90]], (1, 2), 24), None);
        assert_eq!(hannan_rissanen(&[vec![1.0; 5]], (1, 2), 24), None);
    }

    #[test]
    fn smooth_series_is_fitted_with_full_order() {
        let v: Vec<f64> = (0..400).map(|t| (0.1 * f64::from(t)).sin()).collect();
        let products = NoiseProducts::new(&[v], 24);
        let found = products.fit_up_to(24).unwrap();
        assert!(
            found.d.len() == 24 && found.loss > 0.0 && found.loss < 1e-12,
            "{found:?}"
        );
    }

    #[test]
    fn zero_and_short_series_give_no_model() {
        let none = NoiseProducts::new(&[vec![0.0; 50]], 4);
        assert_eq!(
            (none.best_order(0..=4, Penalty::Akaike), none.fit_up_to(4)),
            (None, None)
        );
        assert_eq!(NoiseProducts::new(&[vec![1.0; 3]], 4).fit(1), None);
    }
}
