//! What the estimate owes to the choice of a noise model.
//!
//! In a closed loop the prediction error method is biased by as much as the noise model is wrong
//! (L. Ljung, *System Identification*, 1999, section 13.4: by the part of the spectrum of e that
//! the remnant makes, times what the noise model misses), and the scatter between runs does not show
//! it, since all runs share it. The remnant of people is no autoregression of any order. How wrong
//! the chosen one may be shows where others are put in its place: the same form is fitted with
//! autoregressions of a quarter, half and all of the highest order, and with an ARMA model of the
//! orders that a sum of a drift, a broad band and a resonance has when it is sampled (4, 5). Each
//! difference is taken for a bias and enters the covariance by its square, as the difference to the
//! fit at the lines does, which stands in place of all of them where an excitation was recorded.

use super::{
    noise::{NoiseProducts, hannan_rissanen},
    prediction::{NoiseOrders, Prediction},
    prediction_fit::PredictionFit,
};
use crate::criterion::Workspace;

/// Orders (nc, nd) of the ARMA model.
const MIXED: NoiseOrders = (4, 5);
/// Iterations in which a rival need not converge: it stands for a size.
const SEARCH: (usize, f64) = (25, 1e-6);

/// Coordinates of the operators of the same form with other noise models.
pub(super) fn rivals(
    prediction: &Prediction<'_>,
    fit: &PredictionFit<'_>,
    highest: usize,
    workspace: &mut Workspace,
) -> Vec<Vec<f64>> {
    let layout = fit.layout();
    let own: NoiseOrders = (layout.nc, layout.nd);
    let mut orders: Vec<NoiseOrders> = vec![(0, highest / 4), (0, highest / 2), (0, highest), MIXED];
    orders.retain(|&(nc, nd)| (nc, nd) != own && nd > 0 && nd <= highest && nc <= highest);
    orders.dedup();
    let elements = layout.operator_elements();
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
