//! The gradient psi of the recursion in physical parameters compared with finite differences, and the tracked delay.
#![allow(clippy::unwrap_used)]

#[path = "../../hoid-core/tests/common/mod.rs"]
mod common;

use common::{Noise, box_jenkins, covariance, error_bars};
use hoid_core::{adaptation::Forgetting, covariance::Covariance, recursion::StablePolynomials, shape::AnyShape};
use hoid_survey::kernel::physical::{PhysicalModel, PhysicalRpem};

/// A Box-Jenkins model in physical parameters with one noise pole (and a zero), with or without the delay.
fn physical<const N: usize, const L: usize>(
    nc: usize,
    smallest_nk: Option<usize>,
    eta: [f64; N],
) -> PhysicalRpem<AnyShape, N, 4, L, Covariance<N>> {
    let mut bounds = [[f64::NEG_INFINITY, f64::INFINITY]; N];
    bounds[2] = [0.5, 100.0];
    bounds[3] = [0.02, 5.0];
    if smallest_nk.is_some() {
        bounds[4] = [0.01, 0.1];
    }
    let model = PhysicalModel {
        shape: AnyShape {
            nb: if smallest_nk.is_some() { 3 } else { 2 },
            nc,
            nd: 1,
            nf: 2,
            ..AnyShape::default()
        },
        smallest_nk,
        sample_time: 0.01,
        bounds,
        stable: StablePolynomials::Predictor,
    };
    PhysicalRpem::new(
        model,
        eta,
        covariance::<N>(1.0, Forgetting::Exponential { lambda: [1.0; N] }),
        error_bars::<N, 4>(1.0),
    )
    .unwrap()
}

#[test]
fn psi_is_the_negative_gradient_of_the_innovation() {
    fn check<const N: usize, const L: usize>(nc: usize, tracked: Option<usize>, eta: [f64; N], steps: [f64; N]) {
        let data = box_jenkins(300, 6, 0.02);
        let run = |eta: [f64; N]| {
            let mut recursion = physical::<N, L>(nc, tracked, eta);
            data.iter()
                .map(|&(x, u)| (recursion.step_without_update(x, u).innovation, *recursion.psi()))
                .collect::<Vec<_>>()
        };
        let at = run(eta);
        for i in 0..N {
            let shifted = |sign: f64| {
                let mut moved = eta;
                moved[i] += sign * steps[i];
                run(moved)
            };
            let (up, down) = (shifted(1.0), shifted(-1.0));
            let size = at.iter().map(|(_, psi)| psi[i].abs()).fold(0.0, f64::max);
            for t in 0..data.len() {
                let difference = -(up[t].0 - down[t].0) / (2.0 * steps[i]);
                assert!(
                    (at[t].1[i] - difference).abs() < 1e-5 * size,
                    "{i} at {t}: {} {difference}",
                    at[t].1[i]
                );
            }
        }
    }
    check::<6, 6>(
        1,
        None,
        [0.09, 0.036, 11.25, 0.35, 0.2, -0.8],
        [1e-6, 1e-6, 1e-4, 1e-5, 1e-6, 1e-6],
    );
    // The delay is not a whole number of samples, so the model is smooth at this point.
    check::<6, 16>(
        0,
        Some(2),
        [0.09, 0.036, 11.25, 0.35, 0.0437, -0.8],
        [1e-6, 1e-6, 1e-4, 1e-5, 1e-6, 1e-6],
    );
}

#[test]
fn response_is_continuous_across_whole_samples_of_delay() {
    let data = box_jenkins(400, 7, 0.0);
    let run = |tau: f64| {
        let mut recursion = physical::<6, 16>(0, Some(2), [0.09, 0.036, 11.25, 0.35, tau, -0.8]);
        data.iter()
            .map(|&(x, u)| recursion.step_without_update(x, u).innovation)
            .collect::<Vec<f64>>()
    };
    let (before, after) = (run(0.05 - 1e-9), run(0.05 + 1e-9));
    let largest = before
        .iter()
        .zip(&after)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(largest < 1e-6, "{largest:e}");
}

#[test]
fn delay_converges_from_four_samples_away() {
    let mut truth = physical::<6, 16>(0, Some(1), [0.09, 0.036, 11.25, 0.35, 0.0637, 0.0]);
    let mut noise = Noise(8);
    let mut recursion = physical::<6, 16>(0, Some(1), [0.07, 0.05, 9.0, 0.5, 0.02, -0.8]);
    let mut slow = 0.0;
    for _ in 0..40_000 {
        slow = 0.97 * slow + 0.3 * noise.next();
        // For u = 0, the innovation is the negative response of the true operator.
        let response = -truth.step_without_update(slow, 0.0).innovation;
        recursion.step(slow, response + 0.01 * noise.next());
    }
    let tau = recursion.eta()[4];
    assert!((tau - 0.0637).abs() < 0.002, "{:?}", recursion.eta());
}
