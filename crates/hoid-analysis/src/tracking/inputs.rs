//! Orders, delays and role of the inputs of a tracked model with two inputs, from text.

use hoid_ident::{NamedOrders, several_inputs::InputOrders};
use hoid_model::Structure;
use hoid_track::{Method, TrackedInput};

use crate::{
    AnalysisError,
    several_inputs::{parse_roles, several_inputs},
};

/// Returns the orders of the model of the first input and the further input, from text such as
/// `nb=2,1,nf=2,2,nd=1` and `29,12`: one number for both inputs, or one for each. Orders that are not given are those
/// of an operator.
///
/// # Errors
/// [`AnalysisError::Options`] for more than two inputs, without delays, and for invalid orders or roles.
pub fn two_inputs(
    method: &Method,
    structure: Option<Structure>,
    orders: &str,
    nk: Option<&str>,
    inputs: &[String],
    role: &str,
) -> Result<(NamedOrders, TrackedInput), AnalysisError> {
    let options = |reason: String| AnalysisError::Options { reason };
    let [_, further] = inputs else {
        return Err(options(format!(
            "found {} inputs; a recursive method tracks the responses to at most two, with the error first",
            inputs.len()
        )));
    };
    if !method.supports_further_input() {
        return Err(options(format!(
            "the method {method} tracks the response to one input; use rls or rpem for {further}"
        )));
    }
    if nk.is_none() && !orders.split(',').any(|part| part.trim().starts_with("nk=")) {
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
    let named = all.into_iter().map(|(name, n)| (name.to_owned(), n..=n)).collect();
    let role = parse_roles(std::slice::from_ref(further), role)?;
    let further = TrackedInput {
        channel: further.clone(),
        role: role.first().copied().unwrap_or_default(),
        orders: *second,
    };
    Ok((named, further))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn of(orders: &str, nk: Option<&str>, inputs: &[&str]) -> Result<(NamedOrders, TrackedInput), String> {
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
        assert_eq!(further.orders, InputOrders { nb: 1, nf: 2, nk: 12 });
        assert_eq!(further.channel, "r");
        // The orders of an operator are the default, and nk may be one of the orders.
        let (orders, further) = of("nk=9", None, &["e", "r"]).unwrap();
        assert_eq!((&orders["nb"], &orders["nd"]), (&(2..=2), &(1..=1)));
        assert_eq!(further.orders, InputOrders { nb: 2, nf: 2, nk: 9 });
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
