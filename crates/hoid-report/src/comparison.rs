//! The figure of a comparison of conditions or groups.

use hoid_design::compare::{Comparison, Mean, PersonEstimate, Quantity};

use crate::figures::{PeopleGrid, PeoplePanel, people_by_condition};

/// Name of a quantity in a figure: the symbol of a parameter, the description of any other quantity.
fn name(quantity: &Quantity) -> String {
    match quantity {
        Quantity::Parameter(_) | Quantity::OfInput { .. } => quantity.to_string(),
        other => other.sentence_name(),
    }
}

/// Draws the estimates of each person by condition, with the means and their intervals, in one panel for each quantity.
pub fn comparison_figure(comparison: &Comparison) -> String {
    let mut places: Vec<(&str, &str)> = Vec::new();
    let mut people: Vec<&str> = Vec::new();
    for e in &comparison.estimates {
        let place = (e.condition.as_str(), e.group.as_str());
        if !places.contains(&place) {
            places.push(place);
        }
        if !people.contains(&e.subject.as_str()) {
            people.push(&e.subject);
        }
    }
    let panel = |quantity: &Quantity| {
        let at = |subject: &str, (condition, group): (&str, &str)| {
            let is = |e: &&PersonEstimate| {
                (&e.quantity, e.subject.as_str(), e.condition.as_str(), e.group.as_str())
                    == (quantity, subject, condition, group)
            };
            let found = comparison.estimates.iter().find(is)?;
            Some((found.value, found.standard_error))
        };
        let mean = |(condition, group): (&str, &str)| {
            let is = |m: &&Mean| (&m.quantity, m.condition.as_str(), m.group.as_str()) == (quantity, condition, group);
            let found = comparison.means.iter().find(is)?;
            Some((found.estimate.value, found.estimate.interval))
        };
        PeoplePanel {
            name: name(quantity),
            unit: quantity.unit().to_owned(),
            people: people
                .iter()
                .map(|who| places.iter().map(|place| at(who, *place)).collect())
                .collect(),
            means: places.iter().map(|place| mean(*place)).collect(),
        }
    };
    let place = |(condition, group): &(&str, &str)| match group.is_empty() {
        true => (*condition).to_owned(),
        false => format!("{condition}, {group}"),
    };
    let grid = PeopleGrid {
        panels: comparison.quantities().into_iter().map(panel).collect(),
        people: people.iter().map(|who| (*who).to_owned()).collect(),
        categories: places.iter().map(place).collect(),
        abscissa: String::new(),
    };
    let title = format!(
        "{}: people by condition, and the mean over people with its 95 % interval",
        comparison.group
    );
    people_by_condition("people", &title, &grid)
}
