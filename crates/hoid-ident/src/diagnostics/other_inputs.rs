//! Whether u responds to a target that was recorded and is no input of the fit.
//!
//! A person who sees the target follows it also without an error: what a fit of one input finds is then neither their
//! response to the error nor the loop that they close ([`crate::family::SeenChannel`]). Each channel with the name of a
//! target is tried as a second input, in the forms of a gain and of its derivatives, with the form of the fit; the
//! doubt is raised where the best of them explains far more than chance.

use hoid_model::{Finding, Form, Record};

use crate::family::{ChannelRole, FamilyEstimator, FamilyFit, SeenChannel};

/// Names of channels that hold what may be shown.
const TARGETS: [&str; 4] = ["r", "f_t", "target", "reference"];
/// Probability of the response by chance: where target and disturbance have lines of their own, and where the target alone
/// excites the loop, so that what the form of the fit lacks looks like a response to the target.
const BY_CHANCE: [f64; 2] = [1e-2, 1e-7];

/// A doubt for each target that the person responds to.
pub fn of_family(estimator: &FamilyEstimator, fit: &FamilyFit, records: &[Record]) -> Vec<Finding> {
    if fit.little_noise || !estimator.channels.is_empty() {
        return Vec::new();
    }
    let (nc, nd) = fit.noise_orders;
    let again = FamilyEstimator {
        forms: vec![fit.form],
        nc: nc..=nc,
        nd: nd..=nd,
        intersample: fit.intersample,
        ..estimator.clone()
    };
    let is_recorded = |name: &&str| {
        records.iter().all(|record| {
            let is_signal = record.channels().take(2).any(|signal| signal.name == *name);
            !is_signal && record.channel(name).is_some()
        })
    };
    let found = |name: &str| {
        let channel = SeenChannel {
            forms: vec![Form::Gain, Form::Derivative, Form::DerivativeLead],
            ..SeenChannel::new(name, ChannelRole::Feedforward)
        };
        // A channel that cannot be an input, because it does not move, is no evidence against the fit.
        let (found, apart) = again.responds_to(records, channel).ok()?;
        (found.p_value < BY_CHANCE[usize::from(!apart)]).then(|| {
            Finding::doubt(
                "other-input",
                format!(
                    "u responds to {name} besides the error (p = {:.0e}): with one input the response to the error, crossover and \
                     margins are not those of the person; add --input {name}",
                    found.p_value
                ),
            )
        })
    };
    TARGETS.into_iter().filter(is_recorded).filter_map(found).collect()
}
