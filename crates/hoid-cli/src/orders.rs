//! Parsing of orders and start values for `hoid track` and `hoid stream`.

use std::collections::BTreeMap;

use hoid::ident::{
    NamedOrders,
    order_selection::check_order,
    settings::{DelayRange, Value, parse_named_pairs},
};

use crate::error::CliError;

/// Returns the orders given by `--orders`. A delay given by `--nk` is checked, but is not part of the result.
pub fn named_orders(orders: Option<&str>, nk: Option<&DelayRange>) -> Result<NamedOrders, CliError> {
    let read = orders.filter(|text| !text.trim().is_empty()).map(NamedOrders::read);
    let all = match read {
        None => NamedOrders::new(),
        Some(read) => read.map_err(|expected| CliError::Usage(format!("--orders: expected {expected}")))?,
    };
    if all.contains_key("nk") && nk.is_some() {
        return Err(CliError::Usage(
            "nk is given twice, by --orders and by --nk; drop one".to_owned(),
        ));
    }
    if let Some(DelayRange::Samples(nk)) = nk {
        check_order("nk", nk).map_err(|error| CliError::Usage(format!("--{error}")))?;
    }
    for (name, range) in &all {
        check_order(name, range).map_err(|error| CliError::Usage(format!("--{error}")))?;
    }
    Ok(all)
}

/// Parses `name=number,name=number`; each name may occur only once.
pub fn parse_numbers(text: &str) -> Result<Vec<(String, f64)>, String> {
    parse_named_pairs(text)
        .map_err(|expected| format!("expected {expected}"))?
        .into_iter()
        .map(|(name, value)| match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok((name, number)),
            _ => Err(format!("{name}={value}: expected a finite number")),
        })
        .collect()
}

/// Parses start values such as `f1=..,b0=..`; each coefficient may occur only once.
pub fn parse_start(text: &str) -> Result<BTreeMap<String, f64>, CliError> {
    let numbers = parse_numbers(text).map_err(|reason| CliError::Usage(format!("--start: {reason}")))?;
    Ok(numbers.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_parsed() {
        let some = named_orders(Some("nd=2, nc=1..3"), Some(&DelayRange::Samples(29..=29))).unwrap();
        assert_eq!((&some["nd"], &some["nc"]), (&(2..=2), &(1..=3)));
        assert!(named_orders(None, Some(&DelayRange::Samples(9..=usize::MAX))).is_err());
        assert!(named_orders(None, None).unwrap().is_empty());
        assert!(named_orders(Some("nx=2"), None).is_err());
        for twice in [DelayRange::Samples(3..=3), DelayRange::Seconds(0.2, 0.3)] {
            assert!(named_orders(Some("nk=2"), Some(&twice)).is_err());
        }
    }

    #[test]
    fn start_names_each_coefficient_once() {
        assert_eq!(parse_start("f1=-1.9,b0=.04").unwrap()["f1"], -1.9);
        for bad in ["f1=1,f1=2", "f1=abc", "f1"] {
            assert!(parse_start(bad).is_err(), "{bad}");
        }
    }
}
