//! Extensions beyond the thesis: decimation, T_n = 0.2 s, the second definition of the noise level, memory lengths,
//! forgetting matrix; and an example of a user-defined study.

mod boxes;
mod decimation;
mod forgetting;
mod lead_change;
mod memory;
mod quartiles;
mod remnant;
mod symbols;

use super::Item;

pub(super) fn items() -> Vec<Item> {
    let mut all = decimation::items();
    all.extend(memory::items());
    all.extend(forgetting::items());
    all.extend(lead_change::items());
    all.extend(remnant::items());
    all
}
