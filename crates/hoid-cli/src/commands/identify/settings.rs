//! The options that a fit of polynomials was made with, for people and as a record of the result.

use hoid::analysis::{Recordings, shared_settings};

use super::estimate::search;
use crate::{args::IdentifyArgs, commands::reading};

/// The options that every kind of fit shares, defaults included.
pub fn common_settings(args: &IdentifyArgs, data: &Recordings) -> Vec<(String, String)> {
    let shared = shared_settings(
        data,
        args.initial_state.map_or("auto", hoid::ident::InitialState::name),
        args.read.prepare.rate.decimate,
        args.faults.faults,
        &search(args),
        args.controlled_element.as_ref(),
    );
    let mut list = reading::rows(shared);
    for (name, text) in [("fixed", &args.fix), ("bounds", &args.bound)] {
        if let Some(text) = text {
            list.push((name.to_owned(), text.clone()));
        }
    }
    list
}
