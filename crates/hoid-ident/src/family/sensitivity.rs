//! Effect of the choice of a noise model on the estimate.
//!
//! In a closed loop an error of the noise model biases the prediction error method (L. Ljung, *System Identification*,
//! 1999, section 13.4: by the part of the spectrum of e that is due to the remnant, times the error of the noise
//! model), and the scatter between runs does not show it, since all runs share it. The remnant of people is not an
//! autoregression of any order. The size of the error of the chosen model is estimated by replacing it: the same form
//! is fitted with autoregressions of a quarter, half and all of the highest order, and with an ARMA model of the orders
//! of a sampled sum of a drift, a broad band and a resonance (4, 5). Each difference is taken as a bias and enters the
//! covariance by its square, like the difference to the fit at the lines if an excitation was recorded. That fit is
//! used for coordinates that the lines determine; for the others, which its prior determines, the other noise models
//! are used: for each element by itself, since the response in the band of manual control, and with it crossover and
//! margin, is known from the lines.
//!
//! **Without lines** the differences do not show the whole bias: if e is mainly remnant, above the band of the forcing
//! function, all noise models share most of the bias. Their squares count one and a half times, and the neuromuscular
//! system has an additional variance. Both numbers, and the largest share of the prior with lines, were set on 160
//! virtual people and confirmed on 160 others; the page *Error bars of people* has the coverage on a third set.

use hoid_model::operator_family::Coordinate;

use super::{
    noise::{NoiseProducts, hannan_rissanen},
    prediction::{NoiseOrders, Prediction},
    prediction_fit::PredictionFit,
};
use crate::criterion::Workspace;

/// Orders (nc, nd) of the ARMA model.
const MIXED: NoiseOrders = (4, 5);
/// Share of the prior in the fit at the lines above which other noise models are used too.
pub(super) const LARGEST_SHARE_AT_LINES: f64 = 0.25;
/// Additional relative weight of the squared differences without lines.
pub(super) const MORE_WITHOUT_LINES: f64 = 0.5;
/// Standard deviations for parameters without lines that the other fits do not show.
pub(super) const UNSEEN_WITHOUT_LINES: [(Coordinate, f64); 2] =
    [(Coordinate::LogOmega, 0.12), (Coordinate::LogZeta, 0.2)];
/// Limits of the search of a rival, which need not converge: only the size of the difference is used.
const SEARCH: (usize, f64) = (25, 1e-6);

/// Returns the coordinates of the operators of the same form with other noise models; empty if there is no noise.
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
