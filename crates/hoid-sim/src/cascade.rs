//! Exact zero-order hold of the cascade `1/(T_n s + 1)^m`, driven by noise that is held over each sample.
//!
//! The states are the outputs of the m first-order sections, `T_n z_1' = eps - z_1`, `T_n z_i' = z_{i-1} - z_i`. With
//! `h = Ts/T_n` the transition matrix is lower triangular Toeplitz with `e^-h h^k/k!` on diagonal k. The input enters
//! section k (counted from 0) with the factor `1 - e^-h sum_{j<=k} h^j/j!`, computed from its tail
//! `e^-h sum_{j>k} h^j/j!` to avoid cancellation.

use hoid_lanes::Number;

/// Highest order m of the remnant filter.
pub(crate) const HIGHEST_ORDER: usize = hoid_model::remnant::HIGHEST_ORDER;

/// Coefficients of the cascade for one sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cascade {
    order: usize,
    transition: [f64; HIGHEST_ORDER],
    input: [f64; HIGHEST_ORDER],
}

impl Cascade {
    /// Builds the cascade for `h = Ts/T_n > 0` and an order from 1 to [`HIGHEST_ORDER`].
    pub fn new(order: usize, h: f64) -> Self {
        let decay = (-h).exp();
        let mut transition = [0.0; HIGHEST_ORDER];
        let mut input = [0.0; HIGHEST_ORDER];
        let mut term = decay;
        for k in 0..order {
            transition[k] = term;
            term *= h / (k + 1) as f64;
            input[k] = if h < 2.0 {
                tail(term, k + 1, h)
            } else {
                1.0 - transition[..=k].iter().sum::<f64>()
            };
        }
        Self {
            order,
            transition,
            input,
        }
    }

    /// Returns the number of sections.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Advances the outputs of M sections by one sample, driven by `eps`.
    #[inline(always)]
    pub fn step<R: Number, const M: usize>(&self, z: [R; M], eps: R) -> [R; M] {
        let mut next = z;
        for i in 0..M {
            next[i] = eps.splat(self.input[i]) * eps;
            for j in 0..=i {
                next[i] = next[i] + eps.splat(self.transition[i - j]) * z[j];
            }
        }
        next
    }
}

/// Returns `sum over j >= first of term h^(j-first) first!/j!`, where `term` is the first term of the sum.
fn tail(mut term: f64, first: usize, h: f64) -> f64 {
    let mut sum = 0.0;
    for j in first..first + 40 {
        sum += term;
        term *= h / (j + 1) as f64;
    }
    sum
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        SampleTime,
        remnant::{RemnantDiscretisation, RemnantFilter},
    };

    use super::*;

    #[test]
    fn impulse_response_matches_the_exact_transfer_function() {
        for order in 1..=HIGHEST_ORDER {
            for (ts, t_n) in [(0.01, 0.06), (0.001, 0.06), (0.05, 0.02)] {
                let h = RemnantFilter::new(1.0, t_n, order)
                    .unwrap()
                    .discretise(SampleTime::new(ts).unwrap(), RemnantDiscretisation::ZeroOrderHold)
                    .unwrap();
                let cascade = Cascade::new(order, ts / t_n);
                let mut z = [0.0; HIGHEST_ORDER];
                let mut y: Vec<f64> = Vec::new();
                for t in 0..60_usize {
                    let eps = f64::from(u8::from(t == 0));
                    let ours = z[order - 1];
                    z = cascade.step(z, eps);
                    let mut theirs = h.num().get(t).copied().unwrap_or(0.0);
                    for (i, a) in h.den().iter().enumerate().skip(1).take(t) {
                        theirs -= a * y[t - i];
                    }
                    y.push(theirs);
                    // The recursion of order 4 amplifies rounding errors if its poles are nearly 1.
                    assert!(
                        (ours - theirs).abs() < 1e-10,
                        "m = {order}, h = {}, t = {t}: {ours} {theirs}",
                        ts / t_n
                    );
                }
            }
        }
    }

    #[test]
    fn static_gain_is_one() {
        for order in 1..=HIGHEST_ORDER {
            let cascade = Cascade::new(order, 0.5);
            let mut z = [0.0; HIGHEST_ORDER];
            for _ in 0..200 {
                z = cascade.step(z, 3.0);
            }
            assert!((z[order - 1] - 3.0).abs() < 1e-13);
        }
    }
}
