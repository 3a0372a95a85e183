//! The options that were used, for people and as a record of the result.

use crate::{args::IdentifyArgs, commands::reading};

/// The options that every kind of fit shares, defaults included.
pub fn common_settings(args: &IdentifyArgs, with_input: bool) -> Vec<(String, String)> {
    let mut list = vec![(
        "initial state".to_owned(),
        args.initial_state
            .map_or("auto", hoid::ident::InitialState::name)
            .to_owned(),
    )];
    list.extend(reading::settings(&args.read, with_input));
    list.push(("faults".to_owned(), args.faults.faults.to_string()));
    if !args.mask.mask.is_empty() {
        let kinds: Vec<String> = args
            .mask
            .mask
            .iter()
            .map(|kind| format!("{kind:?}").to_lowercase())
            .collect();
        list.push((
            "masked".to_owned(),
            format!("{}, stretches of {} s or more", kinds.join(", "), args.mask.shortest),
        ));
    }
    list.extend([
        (
            "search".to_owned(),
            format!("{}, relative tolerance {:e}", args.search_method, args.tolerance),
        ),
        ("largest number of steps".to_owned(), args.max_iterations.to_string()),
    ]);
    for (name, text) in [("fixed", &args.fix), ("bounds", &args.bound)] {
        if let Some(text) = text {
            list.push((name.to_owned(), text.clone()));
        }
    }
    if let Some(h) = &args.controlled_element {
        list.push(("controlled element".to_owned(), h.to_string()));
    }
    list
}
