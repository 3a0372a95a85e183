//! Effect of the choice of a noise model on the estimate.
//!
//! In a closed loop the prediction error method is biased by as much as the noise model is wrong (L. Ljung, *System
//! Identification*, 1999, section 13.4: by the part of the spectrum of e that the remnant makes, times what the noise
//! model misses), and the scatter between runs does not show it, since all runs share it. The remnant of people is not
//! an autoregression of any order. How wrong the chosen one may be shows where others are put in its place: the same
//! form is fitted with autoregressions of a quarter, half and all of the highest order, and with an ARMA model of the
//! orders that a sum of a drift, a broad band and a resonance has when it is sampled (4, 5). Each difference is taken
//! for a bias and enters the covariance by its square, as the difference to the fit at the lines does where an
//! excitation was recorded. That fit speaks for what the lines determine; for the rest, which is its prior, the other
//! noise models speak: for each element by itself, since the response in the band of manual control, and with it
//! crossover and margin, is known from the lines.
//!
//! **Without lines** they do not determine all: where e is nearly the remnant alone, above the band of the forcing
//! function, all noise models share most of the bias. Their squares count one and a half times, and the neuromuscular
//! system has a variance in addition. Both numbers, and the largest share of the prior with lines, were set on 160
//! virtual people and held on 160 others; the page *Error bars of people* has the coverage on a third set.

use hoid_model::operator_family::Coordinate;

use super::{
    noise::{NoiseProducts, hannan_rissanen},
    prediction::{NoiseOrders, Prediction},
    prediction_fit::PredictionFit,
};
use crate::criterion::Workspace;

/// Orders (nc, nd) of the ARMA model.
const MIXED: NoiseOrders = (4, 5);
/// Share of the prior in the fit at the lines from which on other noise models speak in addition.
pub(super) const LARGEST_SHARE_AT_LINES: f64 = 0.25;
/// Amount by which the squares of the differences count more without lines.
pub(super) const MORE_WITHOUT_LINES: f64 = 0.5;
/// Standard deviations for parameters that no other fit shows without lines.
pub(super) const UNSEEN_WITHOUT_LINES: [(Coordinate, f64); 2] =
    [(Coordinate::LogOmega, 0.12), (Coordinate::LogZeta, 0.2)];
/// Iterations in which a rival need not converge: it represents a size.
const SEARCH: (usize, f64) = (25, 1e-6);

/// Coordinates of the operators of the same form with other noise models; none if there is no noise.
pub(super) fn rivals(
    prediction: &Prediction<'_>,
    fit: &PredictionFit<'_>,
    highest: usize,
    workspace: &mut Workspace,
) -> Vec<Vec<f64>> {
    if prediction.noise_free().is_some() {
        return Vec::new();
    }
    let layout = fit.layout();
    let own: NoiseOrders = (layout.nc, layout.nd);
    let mut orders: Vec<NoiseOrders> = vec![(0, highest / 4), (0, highest / 2), (0, highest), MIXED];
    orders.retain(|&(nc, nd)| (nc, nd) != own && nd > 0 && nd <= highest && nc <= highest);
    orders.dedup();
    let elements = layout.noise_begins();
    let start = layout.coordinates_of(fit.eta(), 0);
    let Ok(series) = prediction.unexplained((layout.form, layout.neuromuscular), &start, workspace) else {
        return Vec::new();
    };
    let mut others = Vec::new();
    for (nc, nd) in orders {
        let noise = if nc == 0 {
            NoiseProducts::new(&series, nd).fit(nd).map(|a| a.d)
        } else {
            hannan_rissanen(&series, (nc, nd), highest)
        };
        let Some(noise) = noise else { continue };
        if let Some(found) = prediction.refit(fit, (nc, nd), &noise, SEARCH, workspace) {
            others.push(found[..elements].to_vec());
        }
    }
    others
}
