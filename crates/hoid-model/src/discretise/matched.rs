//! The matched method: poles and zeros are mapped by `z = e^{s Ts}`.

use num_complex::Complex64;

use crate::{ContinuousTransferFunction, polynomial};

/// Maps poles and zeros by `z = e^{s Ts}` and returns the numerator and the denominator in descending powers of z.
/// `None` if the roots cannot be found.
pub(super) fn matched_pole_zero(h: &ContinuousTransferFunction, ts: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let poles = polynomial::roots(h.den())?;
    let leading = h.num()[0];
    if leading == 0.0 {
        return Some((vec![0.0], mapped_polynomial(&poles, ts)));
    }
    let zeros = polynomial::roots(h.num())?;
    let at_infinity = poles.len() - zeros.len();
    let gain = leading * static_ratio(&zeros, ts) / static_ratio(&poles, ts);
    let mut num = mapped_polynomial(&zeros, ts);
    if at_infinity > 0 {
        for _ in 1..at_infinity {
            num = polynomial::product(&num, &[0.5, 0.5]);
        }
        num.insert(0, 0.0);
    }
    Some((num.iter().map(|c| gain * c).collect(), mapped_polynomial(&poles, ts)))
}

/// Returns `prod (z - e^{p Ts})` over the roots p, in descending powers of z.
fn mapped_polynomial(roots: &[Complex64], ts: f64) -> Vec<f64> {
    polynomial::from_roots(&roots.iter().map(|p| (p * ts).exp()).collect::<Vec<_>>())
}

/// `prod p / (e^{p Ts} - 1)` over the roots p: the factors `s - p` at s = 0, divided by their images `z - e^{p Ts}` at
/// z = 1.
fn static_ratio(roots: &[Complex64], ts: f64) -> f64 {
    let ratio = |p: &Complex64| {
        let z = p * ts;
        if z.norm() < 1e-8 {
            return (1.0 - z / 2.0) / ts;
        }
        // The real part of e^z - 1 is computed without cancellation for small z.
        let sine = (z.im / 2.0).sin();
        let real = z.re.exp_m1() * z.im.cos() - 2.0 * sine * sine;
        p / Complex64::new(real, z.re.exp() * z.im.sin())
    };
    roots.iter().map(ratio).product::<Complex64>().re
}
