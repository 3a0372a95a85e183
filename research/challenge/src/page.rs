//! The page `research/notes/challenge.md`: the cases and the tables.

use std::fmt::Write as _;

use super::{cases::cases, measure::Line, tables::tables};

/// Returns the text of the page; `measured` describes the date, the conditions and the number of runs.
pub fn page(lines: &[Line], measured: &str) -> String {
    let mut text = format!(
        "# The challenge: cases that can refute a tracker\n\n{measured}\n\n\
         The loop is integrated in continuous time and shares nothing with the simulators on which\n\
         the methods were made; every run has a person of its own, with parameters from ranges of\n\
         people. Methods have default options and a start span of 30 s. Where nothing else is reported: gain\n\
         and lead on `1/s^2` against a disturbance at primes times 0.05 Hz, a remnant `1/(T_n s + 1)` of\n\
         .3 of the standard deviation that u has without it, 100 Hz, 90 s; a change starts at 45 s, takes\n\
         half a second, and is of the operator alone. Remnant, plant and forcing stay.\n\n\
         H is requested at seven lines from .5 to 6 rad/s. Who carries no information, or fails, has the error 1.\n\
         `batch (oracle)` knows the changes and the delay: Box-Jenkins on everything since the last change\n\
         (none before 7.5 s), without a constant and over no missing sample, so that offsets, drift and\n\
         gaps cost it. A change is certain where the logarithm of the likelihood ratio of the true\n\
         models, remnant known, is over 12 within the time. `basis-kalman` and `chow` are plain methods in\n\
         three gains of a nominal person, `error-threshold` the published baseline.\n\n\
         There are two sets of seeds: `open`, for making a method, and `sealed`, for its judgement.\n\n\
         ## Results\n"
    );
    text += &tables(lines);
    text += "\n## The cases\n\n| case | theme | description |\n|---|---|---|\n";
    for case in cases() {
        let _ = writeln!(text, "| {} | {} | {} |", case.name, case.theme, case.meaning);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_a_row() {
        let page = page(&[], "never measured");
        assert!(cases().iter().all(|case| page.contains(&format!("| {} |", case.name))));
        assert!(page.contains("never measured"));
    }
}
