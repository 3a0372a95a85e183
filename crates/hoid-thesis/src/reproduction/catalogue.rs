//! All tables and figures, in the order of the text.

use super::{averages, bias, experiment, further, item::Item, orders, responses, setting, starts, traces};

/// All tables and figures, in the order of the text.
pub fn items() -> Vec<Item> {
    let mut all = setting::items();
    all.extend(bias::items());
    all.extend(orders::items());
    all.extend(responses::items());
    all.extend(starts::items());
    all.extend(traces::items());
    all.extend(averages::items());
    all.extend(experiment::items());
    all.extend(further::items());
    all.sort_by_cached_key(|item| place(&item.name));
    all
}

/// Sort key: tables, the figures of the article, those of the appendices by number, the rest.
fn place(name: &str) -> (u8, String, u32, String) {
    let number = |text: &str| text.parse::<f64>().map_or(0, |n| (10.0 * n) as u32);
    if let Some(n) = name.strip_prefix("table-") {
        return (0, String::new(), number(n), String::new());
    }
    if let Some(n) = name.strip_prefix("fig-") {
        return (1, String::new(), number(n), String::new());
    }
    match name.split_once('.') {
        Some((letter, n)) => {
            let (n, more) = n.split_once('-').unwrap_or((n, ""));
            (2, letter.to_owned(), n.parse().unwrap_or(0), more.to_owned())
        }
        None => (3, String::new(), 0, name.to_owned()),
    }
}
