//! A start from the low-passed record: few samples, and a loss with few minima.
//!
//! Input and output pass the same moving average over K samples and are taken every K samples; the system between them is, at
//! low frequencies, the same with its poles raised to the power K. There the search runs to its end from each of a few poles
//! of the grid for about 1/K of the cost, and the poles of the minimum that it finds, taken back by the K-th root, start the
//! search on the record itself. The delay becomes a fraction of a sample, so that B gets one coefficient more.
//!
//! Only a start: where the system is fast beside K samples it is a bad one, and others are asked as well.

use hoid_model::{Complex64, Orders, SampleTime, polynomial, polynomial_model::monic};

use crate::{
    prediction_error::{Criterion, Data, InitialState, Workspace, first_residual},
    search::{SearchMethod, SearchOptions, minimise},
    starts,
};

/// Samples that each record keeps at least.
const SAMPLES_LEFT: usize = 800;
/// Largest K.
const LARGEST_FACTOR: usize = 8;
/// Coefficients of D that a start needs at most.
const LARGEST_ND: usize = 2;
/// Poles of the grid from which the search runs.
const SEARCHED: usize = 2;

/// `|ln z|` of a pole of the averaged record below which it lies well inside what the average leaves (its Nyquist frequency
/// is pi).
const SLOW: f64 = 1.3;

/// What the averaged record proposes.
#[derive(Debug, Default)]
pub(crate) struct Proposals {
    /// Polynomials F, best first; none where the records are short or the model has no poles in F alone.
    pub f: Vec<Vec<f64>>,
    /// True when all poles of the best one are slow beside the average, so that it says nearly all that the record does.
    pub complete: bool,
}

/// Proposals for F.
pub(crate) fn propose(criterion: &Criterion<'_>, sample_time: SampleTime, workspace: &mut Workspace) -> Proposals {
    let shortest = criterion.data.iter().map(|d| d.u.len()).min().unwrap_or(0);
    let factor = (shortest / SAMPLES_LEFT).min(LARGEST_FACTOR);
    let o = criterion.orders;
    let Ok(coarse) = SampleTime::new(sample_time.s() * factor as f64) else {
        return Proposals::default();
    };
    if factor < 2 || o.nf == 0 || o.na > 0 {
        return Proposals::default();
    }
    let slow: Vec<(Vec<f64>, Vec<f64>)> = criterion
        .data
        .iter()
        .map(|d| (averaged(d.e, factor), averaged(d.u, factor)))
        .collect();
    let orders = Orders {
        nb: o.nb + 1,
        nd: (o.nc + o.nd).min(LARGEST_ND),
        nf: o.nf,
        nk: o.nk / factor,
        ..Orders::default()
    };
    let first = first_residual(&orders, InitialState::Estimate);
    let low = Criterion {
        orders,
        data: slow.iter().map(|(e, u)| Data { e, u }).collect(),
        initial: InitialState::Estimate,
        first,
        weights: None,
    };
    if low
        .data
        .iter()
        .any(|d| d.u.len() <= first + orders.parameters() + orders.nf)
    {
        return Proposals::default();
    }
    let options = SearchOptions {
        method: SearchMethod::LevenbergMarquardt,
        max_iterations: 30,
        tolerance: 1e-6,
    };
    let mut minima: Vec<(f64, Vec<f64>)> = Vec::new();
    for start in starts::from_grid(&low, coarse, SEARCHED, workspace) {
        let known = minima.iter().map(|m| m.0).reduce(f64::min);
        if let Some(minimum) = minimise(&low, start.theta, &options, known, workspace)
            && let Some(f) = root_of_poles(&minimum.theta[orders.parameters() - orders.nf..], factor)
        {
            minima.push((minimum.at.sum_of_squares, f));
        }
    }
    minima.sort_by(|a, b| a.0.total_cmp(&b.0));
    let f: Vec<Vec<f64>> = minima
        .into_iter()
        .map(|(_, f)| f)
        .filter(|f| hoid_core::stability::roots_inside(f, 1.0))
        .collect();
    let slow = |f: &Vec<f64>| {
        polynomial::roots(&monic(f)).is_some_and(|z| z.iter().all(|z| z.ln().norm() * (factor as f64) < SLOW))
    };
    Proposals {
        complete: f.first().is_some_and(slow),
        f,
    }
}

/// Means of consecutive groups of samples; a remainder at the end is left out.
fn averaged(x: &[f64], factor: usize) -> Vec<f64> {
    let scale = 1.0 / factor as f64;
    x.chunks_exact(factor)
        .map(|group| group.iter().sum::<f64>() * scale)
        .collect()
}

/// The polynomial whose roots are the principal K-th roots; `None` where a root has none that is real with it (on the closed
/// negative axis).
fn root_of_poles(f: &[f64], factor: usize) -> Option<Vec<f64>> {
    let k = factor as f64;
    let roots: Option<Vec<Complex64>> = polynomial::roots(&monic(f))?
        .into_iter()
        .map(|z| {
            let usable = z.norm() > 1e-6 && (z.re > 0.0 || z.im.abs() > 1e-9 * z.norm());
            usable.then(|| Complex64::from_polar(z.norm().powf(1.0 / k), z.arg() / k))
        })
        .collect();
    let coefficients = polynomial::from_roots(&roots?);
    (coefficients.len() == f.len() + 1).then(|| coefficients[1..].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_of_the_poles_undoes_their_power() {
        let poles = [
            Complex64::new(0.95, 0.06),
            Complex64::new(0.95, -0.06),
            Complex64::new(0.8, 0.0),
        ];
        let f = polynomial::from_roots(&poles);
        let slow = polynomial::from_roots(&poles.map(|z| z.powu(8)));
        let back = root_of_poles(&slow[1..], 8).unwrap();
        for (a, b) in back.iter().zip(&f[1..]) {
            assert!((a - b).abs() < 1e-9);
        }
        // A pole on the negative axis and one at the origin have no root that is a model.
        assert!(root_of_poles(&[0.5], 8).is_none());
        assert!(root_of_poles(&[-0.5, 0.0], 8).is_none());
    }

    #[test]
    fn averages_leave_the_remainder_out() {
        assert_eq!(averaged(&[1.0, 3.0, 5.0, 7.0, 9.0], 2), [2.0, 6.0]);
        assert!(averaged(&[1.0], 2).is_empty());
    }
}
