//! The noise model of the exactly held remnant as a function of T_n, with its derivatives.
//!
//! `K_n/(T_n s + 1)^m`, driven by one normal deviate of unit variance per sample, has the innovation form `C/D eps`
//! with `D = (1 - p q^-1)^m`, `p = e^{-Ts/T_n}`, and `sigma = K_n g(T_n)`; C is the monic spectral factor of the
//! numerator of the zero-order hold ([`crate::remnant`]). The derivatives follow from `dp/dT_n = p Ts/T_n^2` and from
//! the derivative `-N_a/N_zeta` of a zero zeta of the numerator N with respect to `a = Ts/T_n`; the derivative of zeta
//! also gives the derivative of its mirror image `1/conj zeta`.

use crate::{
    ModelError, SampleTime,
    remnant::{FactoredNumerator, RemnantFilter, denominator},
};

/// C, D and `g = sigma/K_n` of the innovation form, and their derivatives with respect to T_n.
#[derive(Debug, Clone, PartialEq)]
pub struct RemnantNoise {
    /// Coefficients `[c1, ..., c_{m-1}]` of C.
    pub c: Vec<f64>,
    /// Coefficients `[d1, ..., dm]` of D.
    pub d: Vec<f64>,
    /// Standard deviation of the innovation for K_n = 1.
    pub gain: f64,
    /// Derivatives of c with respect to T_n, 1/s.
    pub c_slope: Vec<f64>,
    /// Derivatives of d with respect to T_n, 1/s.
    pub d_slope: Vec<f64>,
    /// Derivative of `ln g` with respect to T_n, 1/s.
    pub log_gain_slope: f64,
}

/// Returns the innovation form for the time constant T_n in s and the order m; m = 0 is white noise, without
/// coefficients and with g = 1.
///
/// # Errors
/// [`ModelError::OutOfRange`] if m is above 4, or T_n (which m = 0 does not use) is not between 1e-9 and 1e9 samples.
pub fn remnant_noise(time_constant_s: f64, order: usize, sample_time: SampleTime) -> Result<RemnantNoise, ModelError> {
    if order == 0 {
        return Ok(RemnantNoise {
            c: Vec::new(),
            d: Vec::new(),
            gain: 1.0,
            c_slope: Vec::new(),
            d_slope: Vec::new(),
            log_gain_slope: 0.0,
        });
    }
    let a = RemnantFilter {
        gain: 1.0,
        time_constant_s,
        order,
    }
    .time_constant_ratio(sample_time)?;
    let held = FactoredNumerator::new(order, a);
    let a_slope = -a / time_constant_s;
    let d = denominator(order, (-a).exp());
    // If the filter is fast, some zeros vanish; C is then padded with zero coefficients.
    let padded = |p: &[f64], factor: f64| -> Vec<f64> {
        (1..order).map(|i| factor * p.get(i).copied().unwrap_or(0.0)).collect()
    };
    Ok(RemnantNoise {
        c: padded(&held.c, 1.0),
        c_slope: padded(&held.c_derivative, a_slope),
        // The derivatives follow since d_i is proportional to p^i, and p = e^-a.
        d_slope: (1..=order).map(|i| -(i as f64) * d[i] * a_slope).collect(),
        d: d[1..].to_vec(),
        gain: held.innovation_sd,
        log_gain_slope: held.log_derivative * a_slope,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::remnant::RemnantDiscretisation;

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    const TIME_CONSTANTS_S: [f64; 6] = [0.06, 0.003, 0.0004, 0.012, 0.5, 20.0];

    #[test]
    fn remnant_noise_agrees_with_the_filter_noise_model() {
        for m in 1..=4 {
            for t_n in TIME_CONSTANTS_S {
                let ours = remnant_noise(t_n, m, ts()).unwrap();
                let filter = RemnantFilter::new(0.3, t_n, m).unwrap();
                let known = filter.noise_model(ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
                assert_eq!((ours.c.len(), ours.d.len()), (m - 1, m));
                assert_eq!(ours.c[..known.c.len() - 1], known.c[1..]);
                assert_eq!(ours.d, known.d[1..]);
                assert!((0.3 * ours.gain / known.innovation_sd - 1.0).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn second_order_spectrum_matches_closed_form() {
        // The hold of 1/(T_n s + 1)^2 has n_1 = 1 - p - a p and n_2 = p (p - 1 + a), and sigma^2 C C* must equal N N*.
        let a: f64 = 1.0 / 6.0;
        let p = (-a).exp();
        let (n1, n2) = (1.0 - p - a * p, p * (p - 1.0 + a));
        let ours = remnant_noise(0.06, 2, ts()).unwrap();
        let g2 = ours.gain * ours.gain;
        assert!((g2 * (1.0 + ours.c[0] * ours.c[0]) / (n1 * n1 + n2 * n2) - 1.0).abs() < 1e-12);
        assert!((g2 * ours.c[0] / (n1 * n2) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn slopes_agree_with_finite_differences() {
        for m in 1..=4 {
            for t_n in TIME_CONSTANTS_S {
                let exact = remnant_noise(t_n, m, ts()).unwrap();
                let h = 1e-5 * t_n;
                let (up, down) = (
                    remnant_noise(t_n + h, m, ts()).unwrap(),
                    remnant_noise(t_n - h, m, ts()).unwrap(),
                );
                let pairs = [
                    (&exact.c_slope, &up.c, &down.c),
                    (&exact.d_slope, &up.d, &down.d),
                    (&vec![exact.log_gain_slope], &vec![up.gain.ln()], &vec![down.gain.ln()]),
                ];
                for (slope, up, down) in pairs {
                    for ((s, u), d) in slope.iter().zip(up).zip(down) {
                        let difference = (u - d) / (2.0 * h);
                        // Coefficients up to 6 have a rounding error of 1e-16 (1e-14 for the zeros of m = 4), which is
                        // divided by h; the truncation error is (h/T_n)^2.
                        let bound = 2e-8 * difference.abs() + 5e-14 / h;
                        assert!((s - difference).abs() < bound, "m {m} T_n {t_n}: {s} and {difference}");
                    }
                }
            }
        }
    }

    #[test]
    fn white_noise_has_unit_gain_and_bad_filters_are_refused() {
        let white = remnant_noise(f64::NAN, 0, ts()).unwrap();
        assert!(white.c.is_empty() && white.d.is_empty() && white.gain == 1.0);
        for (t_n, m) in [(0.06, 5), (0.0, 1), (-0.1, 2), (f64::NAN, 1), (1e-100, 3), (1e100, 3)] {
            assert!(remnant_noise(t_n, m, ts()).is_err(), "{t_n} {m}");
        }
    }
}
