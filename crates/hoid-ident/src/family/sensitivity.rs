//! Effect of the choice of a noise model on the estimate.
//!
//! In a closed loop an error in the noise model biases the prediction error method: the bias is proportional to this
//! error and to the part of the spectrum of e that is due to the remnant (L. Ljung, *System Identification*, 1999,
//! section 13.4). The scatter between runs does not show this bias, since all runs share it. The remnant of people is
//! not an autoregression of any order. To estimate the bias, the same form is fitted with other noise models:
//! autoregressions of half and all of the highest order, and an ARMA model with the orders (4, 5) of a sampled sum of a
//! drift, a broad-band signal and a resonance. Each difference from such a fit is treated as a bias, and its square is
//! added to the covariance. If there is a fit at the lines, the difference from this fit is used instead. For
//! coordinates that the prior determines in the fit at the lines, the other noise models are used as well. The
//! differences from them then enlarge the errors of single elements only, since the lines determine the response in the
//! band of manual control, and thus the crossover and the phase margin.
//!
//! With little noise, both intersample behaviours of the error may fit. They differ by `sin(x)/x`, which a lead can
//! replace, so the parameters differ by more than their errors. If the records do not show the behaviour, the
//! difference from the fit with the other one is also treated as a bias.
//!
//! **Without lines** the differences show the bias only if the noise models span the time in which the operator
//! responds, so the highest order spans half a second ([`super::options`]): with at most 24 samples, 0.24 s at 100 Hz,
//! all noise models shared most of the bias. They still share the bias at low frequencies and above the band of the
//! forcing function, where e consists mainly of remnant. The squared differences are therefore multiplied by 1.5, and
//! the neuromuscular system has an additional variance. Both numbers, and the largest prior share with lines, were
//! chosen for 160 virtual people and confirmed for 160 others; the page *Error bars of people* reports the coverage.

use hoid_model::operator_family::Coordinate;

use super::{
    noise::{NoiseProducts, hannan_rissanen},
    prediction::{NoiseOrders, PredictionProblem},
    prediction_fit::PredictionFit,
};
use crate::criterion::Workspace;

/// Orders (nc, nd) of the ARMA model.
const ARMA_ORDERS: NoiseOrders = (4, 5);
/// Prior share in the fit at the lines above which other noise models are also used.
pub(super) const LARGEST_PRIOR_SHARE_AT_LINES: f64 = 0.25;
/// Weight of the squared differences that is added to one if there are no lines.
pub(super) const EXTRA_WEIGHT_WITHOUT_LINES: f64 = 0.5;
/// Additional standard deviations of parameters if there are no lines, for the bias that fits with other noise models
/// do not show.
pub(super) const EXTRA_DEVIATIONS_WITHOUT_LINES: [(Coordinate, f64); 2] =
    [(Coordinate::LogOmega, 0.12), (Coordinate::LogZeta, 0.2)];
/// Maximum number of steps and tolerance of the search with another noise model. The search need not converge, since
/// only the size of the difference is used.
const SEARCH_LIMITS: (usize, f64) = (25, 1e-6);

/// Returns the elements of eta before the noise model for fits of the same form with other noise models, and with the
/// other intersample behaviour if both fit; empty if there is no noise.
pub(super) fn alternative_fits(
    prediction: &PredictionProblem<'_>,
    fit: &PredictionFit<'_>,
    highest: usize,
    workspace: &mut Workspace,
) -> Vec<Vec<f64>> {
    if prediction.noise_free_share().is_some() {
        return Vec::new();
    }
    let layout = fit.layout();
    let own: NoiseOrders = (layout.nc, layout.nd);
    let mut orders: Vec<NoiseOrders> = vec![(0, highest / 2), (0, highest), ARMA_ORDERS];
    orders.retain(|&(nc, nd)| (nc, nd) != own && nd > 0 && nd <= highest && nc <= highest);
    orders.dedup();
    let elements = layout.noise_offset();
    let start = layout.coordinates_of(fit.eta(), 0);
    let Ok(series) = prediction.unexplained_output((layout.form, layout.neuromuscular), &start, workspace) else {
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
        if let Some(found) = prediction.refit(fit, (nc, nd), &noise, SEARCH_LIMITS, workspace) {
            others.push(found[..elements].to_vec());
        }
    }
    let of_course = prediction
        .other_intersample
        .iter()
        .find(|(form, _)| *form == layout.form);
    others.extend(of_course.map(|(_, coordinates)| layout.common_eta(coordinates, &[])));
    others
}
