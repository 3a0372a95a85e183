//! Tests whether u responds to a target that was recorded but is not an input of the fit.
//!
//! A person who sees the target follows it even without an error: a fit with one input then finds neither the response
//! to the error nor the loop that the person closes ([`crate::family::SeenChannel`]). Each channel with the name of a
//! target is tried as a second input, as a gain and with its derivatives, in addition to the forms of the fit. A warning
//! is raised if the best of these models explains far more than chance. The operator may take each form that has a
//! weight in the averages: a form that differs slightly from the person would look like a response to the target.
//!
//! **Sticks with a dead zone.** If only the target excites the loop, the part of e that follows the target is larger
//! than the rest of e. A dead zone has different gains for small and for large signals (the describing function of A.
//! Gelb and W. E. Vander Velde, *Multiple-Input Describing Functions*, 1968), so the gain for the part of e that
//! follows the target differs from the gain for the rest of e, which looks like a response to the target. If u
//! [rests](StickRest) like the signal of such a stick, the finding is a note with both explanations.

use hoid_model::{Finding, Form, Record, numbers::format_p_value};

use crate::{
    family::{ChannelFit, ChannelRole, FamilyEstimator, FamilyFit, SeenChannel},
    faults::StickRest,
    frequency::COMMON_EXCITATIONS,
};

/// Names of channels that may hold a displayed target.
pub(super) const TARGET_CHANNELS: [&str; 4] = ["r", "f_t", "target", "reference"];
/// p-value below which a response to the target is reported. The first value applies if target and disturbance have
/// separate lines, the second if only the target excites the loop: in that case an error in the form of the fit looks
/// like a response to the target.
const P_VALUE_LIMITS: [f64; 2] = [1e-2, 1e-7];

/// Returns a finding for each recorded target to which u responds.
pub fn family_findings(estimator: &FamilyEstimator, fit: &FamilyFit, records: &[Record]) -> Vec<Finding> {
    let is_recorded = |name: &&str| records.iter().all(|record| record.other_channel(name).is_some());
    let found = |name: &str| {
        let (found, apart) = response_to(
            estimator,
            fit,
            records,
            SeenChannel::new(name, ChannelRole::Feedforward),
        )?;
        let chance = found.p_value;
        (chance < P_VALUE_LIMITS[usize::from(!apart)])
            .then(|| response_finding(name, chance, !apart && has_rest(records)))
    };
    TARGET_CHANNELS
        .into_iter()
        .filter(is_recorded)
        .filter_map(found)
        .collect()
}

/// Returns the response to a channel in addition to the inputs of a fit, with the forms and the noise orders of the fit,
/// and whether the excitation lines distinguish the channel from e. `None` if the fit has little noise or several
/// inputs. A channel that cannot be an input, such as a constant channel, also gives `None`: it is no evidence against
/// the fit.
pub fn response_to(
    estimator: &FamilyEstimator,
    fit: &FamilyFit,
    records: &[Record],
    channel: SeenChannel,
) -> Option<(ChannelFit, bool)> {
    if fit.little_noise || !estimator.channels.is_empty() {
        return None;
    }
    let (nc, nd) = fit.noise_orders;
    // Without a named excitation, the lines of every recorded excitation count, and a disturbance distinguishes the
    // channel from e.
    let is_common = |name: &String| *name == channel.name || COMMON_EXCITATIONS.contains(&name.as_str());
    let again = FamilyEstimator {
        excitation: estimator.excitation.clone().filter(|name| !is_common(name)),
        forms: fit.weighed.iter().map(|form| form.form).collect(),
        nc: nc..=nc,
        nd: Some(nd..=nd),
        intersample: fit.intersample,
        ..estimator.clone()
    };
    let channel = SeenChannel {
        forms: vec![Form::Gain, Form::Derivative, Form::DerivativeLead],
        ..channel
    };
    again.test_response(records, channel).ok()
}

/// True if u of one of the records rests like the signal of a stick with a dead zone.
fn has_rest(records: &[Record]) -> bool {
    records.iter().any(|record| StickRest::of(record.output()).is_some())
}

fn response_finding(name: &str, p_value: f64, nonlinear: bool) -> Finding {
    let chance = format_p_value(p_value);
    if nonlinear {
        return Finding::note(
            "other-input",
            format!(
                "u follows {name} more closely than the response to the error explains ({chance}): a stick \
                 with a dead zone can cause this; if the person saw {name}, add --input {name}"
            ),
        );
    }
    Finding::warning(
        "other-input",
        format!(
            "u responds to {name} as well as to the error ({chance}): with one input, the response to the \
             error, the crossover and the margins are wrong; add --input {name}"
        ),
    )
}
