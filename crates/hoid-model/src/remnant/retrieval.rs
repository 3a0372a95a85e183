//! Time constant and gain from an estimated noise model, and their derivatives.

use super::discretisation::{MIN_TIME_CONSTANT_RATIO, RemnantDiscretisation, binomial};
use super::zoh_numerator::HIGHEST_ORDER;
use crate::{NotConvertible, SampleTime};

/// Time constant and gain retrieved from a noise model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetrievedRemnant {
    /// Time constant T_n in s.
    pub t_n_s: f64,
    /// Gain K_n.
    pub k_n: f64,
}

/// Retrieves T_n and K_n from the noise polynomial `1 + d[0] q^-1 + ... + d[m-1] q^-m` and the standard deviation of
/// the innovation.
///
/// # Errors
/// [`NotConvertible::NotFinite`] for coefficients that are not finite; [`NotConvertible::NotARemnantFilter`] if m is
/// not 1 to 4, if a coefficient has the wrong sign or implies a pole outside (0, 1), or if T_n is negligible compared
/// with a sample.
pub fn retrieve(
    d: &[f64],
    innovation_sd: f64,
    sample_time: SampleTime,
    how: RemnantDiscretisation,
) -> Result<RetrievedRemnant, NotConvertible> {
    let poles = implied_poles(d, innovation_sd)?;
    let t_n_s = mean_time_constant(&poles, sample_time, how)?;
    let (unit, _) = how.innovation_sd(d.len(), sample_time.s() / t_n_s);
    Ok(RetrievedRemnant {
        t_n_s,
        k_n: innovation_sd / unit,
    })
}

/// Returns the Jacobian of `[T_n in s, K_n]` (rows) with respect to `[d_1, ..., d_m, sigma']` (columns) at the result
/// of [`retrieve`].
///
/// # Errors
/// As [`retrieve`].
pub fn retrieval_jacobian(
    d: &[f64],
    innovation_sd: f64,
    sample_time: SampleTime,
    how: RemnantDiscretisation,
) -> Result<[Vec<f64>; 2], NotConvertible> {
    let poles = implied_poles(d, innovation_sd)?;
    let (order, ts) = (d.len(), sample_time.s());
    let t_n_s = mean_time_constant(&poles, sample_time, how)?;
    let a = ts / t_n_s;
    let (unit, log_derivative) = how.innovation_sd(order, a);
    // The factor a/T_n comes from a = Ts/T_n: da/dT_n = -a/T_n.
    let gain_by_time = innovation_sd / unit * log_derivative * a / t_n_s;
    let mut time: Vec<f64> = Vec::with_capacity(order + 1);
    for (i, (&alpha, &d)) in poles.iter().zip(d).enumerate() {
        let (_, by_pole) = how.time_constant(alpha);
        time.push(ts * by_pole * alpha / ((i + 1) as f64 * d) / order as f64);
    }
    let mut gain: Vec<f64> = time.iter().map(|t| gain_by_time * t).collect();
    time.push(0.0);
    gain.push(1.0 / unit);
    Ok([time, gain])
}

/// Returns the poles alpha, one implied by each coefficient of D.
fn implied_poles(d: &[f64], innovation_sd: f64) -> Result<Vec<f64>, NotConvertible> {
    let order = d.len();
    let refuse = |reason: String| NotConvertible::NotARemnantFilter { order, reason };
    if !(1..=HIGHEST_ORDER).contains(&order) {
        return Err(refuse("the order must be 1, 2, 3 or 4".to_owned()));
    }
    let not_finite = |name: String, value| NotConvertible::NotFinite { name, value };
    if let Some(i) = d.iter().position(|v| !v.is_finite()) {
        return Err(not_finite(format!("d{}", i + 1), d[i]));
    }
    if !innovation_sd.is_finite() {
        return Err(not_finite("sigma'".to_owned(), innovation_sd));
    }
    if innovation_sd < 0.0 {
        let found = format!("the standard deviation of the innovation is {innovation_sd}, expected zero or more");
        return Err(refuse(found));
    }
    let mut poles = Vec::with_capacity(order);
    for i in 1..=order {
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        let power = sign * d[i - 1] / binomial(order, i);
        if power <= 0.0 {
            let expected = if sign > 0.0 { "positive" } else { "negative" };
            return Err(refuse(format!("d{i} = {:.6}, expected a {expected} number", d[i - 1])));
        }
        let alpha = power.powf(1.0 / i as f64);
        if alpha >= 1.0 {
            return Err(refuse(format!(
                "d{i} = {:.6} implies a pole at z = {alpha:.6}, expected a pole between 0 and 1",
                d[i - 1]
            )));
        }
        poles.push(alpha);
    }
    Ok(poles)
}

fn mean_time_constant(
    poles: &[f64],
    sample_time: SampleTime,
    how: RemnantDiscretisation,
) -> Result<f64, NotConvertible> {
    let sum: f64 = poles.iter().map(|&alpha| how.time_constant(alpha).0).sum();
    let samples = sum / poles.len() as f64;
    if samples < MIN_TIME_CONSTANT_RATIO {
        return Err(NotConvertible::NotARemnantFilter {
            order: poles.len(),
            reason: format!("T_n would be {samples:e} samples: the noise is white"),
        });
    }
    Ok(sample_time.s() * samples)
}
