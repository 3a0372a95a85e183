//! Functions common to methods in physical parameters that use the noise model of a batch fit: validation of the
//! options, and T_L from the gains.

use hoid_ident::IdentError;
use hoid_track::{
    StartSource,
    building::{OPERATOR_PARAMETER_COUNT, Setup, check_delay, check_operator_orders, invalid_option},
};

/// Largest order of the noise model.
pub(crate) const MAX_ND: usize = 8;

/// Checks the requirements of a method that models how the person changes.
///
/// # Errors
/// [`IdentError::BadOption`] if the orders, the delay or the start do not suit a method that models how the person
/// changes.
pub(crate) fn check_model_of_change(name: &str, setup: &Setup) -> Result<(), IdentError> {
    check_operator_orders(name, setup)?;
    check_delay(&setup.orders)?;
    let o = &setup.orders;
    if !(o.nc == 0 && o.nd <= MAX_ND) {
        return Err(invalid_option(
            &format!("the noise model of {name}"),
            format!("nc={},nd={}", o.nc, o.nd),
            "nc = 0 and nd of at most 8",
        ));
    }
    if !matches!(setup.start, StartSource::Span(_)) {
        return Err(invalid_option(
            &format!("the start of {name}"),
            "no batch fit".to_owned(),
            "the batch fit of a span, which provides the noise model and the covariance",
        ));
    }
    Ok(())
}

/// As [`check_model_of_change`], for a method that requires a noise model of order 1.
///
/// # Errors
/// [`IdentError::BadOption`] in addition if nd is not 1.
pub(crate) fn check_first_order(name: &str, setup: &Setup) -> Result<(), IdentError> {
    check_model_of_change(name, setup)?;
    match setup.orders.nd {
        1 => Ok(()),
        nd => Err(invalid_option(
            &format!("the noise model of {name}"),
            format!("nd={nd}"),
            "nd = 1",
        )),
    }
}

/// Returns T_L = K_e_dot/K_e and its variance to first order, from `d T_L = (d K_e_dot - T_L d K_e)/K_e`.
pub(crate) fn lead_time(
    eta: [f64; OPERATOR_PARAMETER_COUNT],
    c: &[[f64; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT],
) -> [f64; 2] {
    let t_l = eta[1] / eta[0];
    let of_ratio = c[1][1] - 2.0 * t_l * c[0][1] + t_l * t_l * c[0][0];
    [t_l, of_ratio.max(0.0) / (eta[0] * eta[0])]
}
