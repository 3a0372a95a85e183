//! All tables and figures, in the order of the thesis.

use crate::experiment::RecordedPeople;

use super::{averages, bias, experiment, extensions, item::Item, orders, responses, simulation_setup, starts, traces};

/// All tables and figures, in the order of the thesis.
pub fn items() -> Vec<Item> {
    let mut all = simulation_setup::items();
    all.extend(bias::items());
    all.extend(orders::items());
    all.extend(responses::items());
    all.extend(starts::items());
    all.extend(traces::items());
    all.extend(averages::items());
    all.extend(experiment::items());
    all.extend(extensions::items());
    sort_items(all)
}

/// The tables and figures of the experiment with recorded people, in the order of the thesis.
pub(super) fn recorded_items(people: RecordedPeople) -> Vec<Item> {
    sort_items(experiment::recorded_items(people))
}

fn sort_items(mut all: Vec<Item>) -> Vec<Item> {
    all.sort_by_cached_key(|item| sort_key(&item.name));
    all
}

/// Sort key: tables, then the figures of the article, then the figures of the appendices by number, then all others.
fn sort_key(name: &str) -> (u8, String, u32, String) {
    let number = |text: &str| text.parse::<f64>().map_or(0, |n| (10.0 * n) as u32);
    let parts = |text: &str| {
        let (n, more) = text.split_once('-').unwrap_or((text, ""));
        (number(n), more.to_owned())
    };
    if let Some((n, more)) = name.strip_prefix("table-").map(parts) {
        return (0, String::new(), n, more);
    }
    if let Some((n, more)) = name.strip_prefix("fig-").map(parts) {
        return (1, String::new(), n, more);
    }
    match name.split_once('.') {
        Some((letter, n)) => {
            let (n, more) = n.split_once('-').unwrap_or((n, ""));
            (2, letter.to_owned(), n.parse().unwrap_or(0), more.to_owned())
        }
        None => (3, String::new(), 0, name.to_owned()),
    }
}
