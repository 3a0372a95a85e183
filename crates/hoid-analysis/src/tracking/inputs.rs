//! Orders, delays and role of the inputs of a tracked model with two inputs, from text.

use hoid_ident::{NamedOrders, family::SeenChannel, several_inputs::InputOrders};
use hoid_model::Structure;
use hoid_track::{Method, RequestedInput};

use crate::{
    AnalysisError,
    several_inputs::{parse_roles, parse_seen_channels, several_inputs},
};

/// Returns the orders of the model of the first input and the further input, from text such as
/// `nb=2,1,nf=2,2,nd=1` and `29,12`: one number for both inputs, or one for each. Orders that are not given are those
/// of an operator. A method that starts itself needs no delays, and has a preview.
///
/// # Errors
/// [`AnalysisError::Options`] for more than two inputs, without delays of polynomials, and for invalid orders or roles.
pub fn two_inputs(
    method: &Method,
    structure: Option<Structure>,
    orders: &str,
    nk: Option<&str>,
    inputs: &[String],
    role: &str,
) -> Result<(NamedOrders, RequestedInput), AnalysisError> {
    let options = |reason: String| AnalysisError::Options { reason };
    let [_, further] = inputs else {
        return Err(options(format!(
            "found {} inputs; a recursive method tracks the responses to at most two, with the error first",
            inputs.len()
        )));
    };
    if !method.supports_further_input() {
        return Err(options(format!(
            "the method {method} tracks the response to one input; use adaptive, rls or rpem for {further}"
        )));
    }
    let is_typed = |name: &str| {
        orders
            .split(',')
            .any(|part| part.trim().starts_with(&format!("{name}=")))
    };
    let has_delays = nk.is_some() || is_typed("nk");
    let starts_itself = method.is_self_starting();
    if !has_delays && !starts_itself {
        return Err(options(
            "the delays are missing: with two inputs, give nk for each in samples, such as 29,12; hoid identify with \
             the same inputs reports the delays"
                .to_owned(),
        ));
    }
    let structure = structure.unwrap_or_else(|| method.default_structure());
    let model = several_inputs(structure, orders, nk, inputs)?;
    let [(_, first), (_, second)] = model.inputs.as_slice() else {
        return Err(options("expected two different inputs".to_owned()));
    };
    let InputOrders { nb, nf, nk } = *first;
    let all = [
        ("na", model.na),
        ("nb", nb),
        ("nc", model.nc),
        ("nd", model.nd),
        ("nf", nf),
        ("nk", nk),
    ];
    // A method that starts itself has its own defaults.
    let is_given = |name: &str| !starts_itself || is_typed(name) || name == "nk" && has_delays;
    let all = all.into_iter().filter(|(name, _)| is_given(name));
    let named = all.map(|(name, n)| (name.to_owned(), n..=n)).collect();
    let names = std::slice::from_ref(further);
    let seen = match starts_itself {
        true => parse_seen_channels(names, role)?.remove(0),
        false => SeenChannel::new(further.clone(), parse_roles(names, role)?[0]),
    };
    if seen.forms != seen.role.forms() {
        return Err(options(format!(
            "role: found {seen}; a recursion has gains instead of a form: drop /{}",
            seen.forms[0]
        )));
    }
    let further = RequestedInput {
        channel: further.clone(),
        role: seen.role,
        preview_s: seen.preview_s,
        coefficients: [second.nb, second.nf],
        nk: has_delays.then_some(second.nk),
    };
    Ok((named, further))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn of(orders: &str, nk: Option<&str>, inputs: &[&str]) -> Result<(NamedOrders, RequestedInput), String> {
        let inputs: Vec<String> = inputs.iter().map(|name| (*name).to_owned()).collect();
        two_inputs(&Method::rpem(), None, orders, nk, &inputs, "").map_err(|error| error.to_string())
    }

    #[test]
    fn each_input_has_its_orders_and_delay() {
        let (orders, further) = of("nb=2,1,nf=2,nd=2", Some("29,12"), &["e", "r"]).unwrap();
        assert_eq!(
            (&orders["nb"], &orders["nf"], &orders["nd"], &orders["nk"]),
            (&(2..=2), &(2..=2), &(2..=2), &(29..=29))
        );
        assert_eq!((further.coefficients, further.nk), ([1, 2], Some(12)));
        assert_eq!(further.channel, "r");
        // The orders of an operator are the default, and nk may be one of the orders.
        let (orders, further) = of("nk=9", None, &["e", "r"]).unwrap();
        assert_eq!((&orders["nb"], &orders["nd"]), (&(2..=2), &(1..=1)));
        assert_eq!((further.coefficients, further.nk), ([2, 2], Some(9)));
    }

    #[test]
    fn default_tracker_needs_no_orders_and_has_a_preview() {
        let of = |orders: &str, nk: Option<&str>, role: &str| {
            let inputs = ["e", "r"].map(str::to_owned);
            two_inputs(&Method::adaptive(), None, orders, nk, &inputs, role).map_err(|error| error.to_string())
        };
        let (orders, further) = of("", None, "r=feedforward:0.25").unwrap();
        assert!(orders.is_empty());
        assert_eq!((further.preview_s, further.nk), (0.25, None));
        assert_eq!(further.coefficients, [2, 2]);
        let (orders, further) = of("nd=8", Some("20,10"), "").unwrap();
        assert_eq!(
            (&orders["nd"], &orders["nk"], further.nk),
            (&(8..=8), &(20..=20), Some(10))
        );
        assert!(
            of("", None, "r=feedforward/derivative")
                .unwrap_err()
                .contains("drop /derivative")
        );
        let inputs = ["e", "r"].map(str::to_owned);
        let refused = two_inputs(&Method::rpem(), None, "nk=9", None, &inputs, "r=feedforward:0.25");
        assert!(refused.unwrap_err().to_string().contains("preview"));
    }

    #[test]
    fn missing_or_extra_numbers_are_refused() {
        assert!(of("nb=2", None, &["e", "r"]).unwrap_err().contains("nk"));
        assert!(
            of("nb=2,1,3", Some("9"), &["e", "r"])
                .unwrap_err()
                .contains("3 numbers for 2 inputs")
        );
        assert!(of("", Some("9"), &["e", "r", "y"]).unwrap_err().contains("3 inputs"));
        assert!(of("", Some("0.1s"), &["e", "r"]).unwrap_err().contains("nk"));
    }
}
