//! Factors: the variables in which conditions or people differ.
//!
//! A factor has levels, and a level has members: conditions (`axis:roll=C1_roll,C2_roll;pitch=C1_pitch,C2_pitch`) or
//! people (`training:yes=P1,P4;no=P2,P3`). It varies **within** people if people are in several of its levels, and
//! **between** people if each person is in only one of them. By default the conditions are the levels of the factor
//! `condition`.

use std::str::FromStr;

use hoid_model::named_choice;
use serde::{Deserialize, Serialize};

use super::CompareError;

/// The factor whose levels are the conditions.
pub const CONDITION_FACTOR: &str = "condition";

/// Variation of a factor: within or between people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variation {
    /// People are in several levels of the factor.
    Within,
    /// Each person is in only one level of the factor.
    Between,
}

named_choice!(Variation, "variation", 2, {
    Within => "within",
    Between => "between",
});

/// A level of a factor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Level {
    /// Name of the level.
    pub name: String,
    /// Conditions or people of the level.
    pub members: Vec<String>,
}

/// A requested factor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Factor {
    /// Name of the factor.
    pub name: String,
    /// Levels of the factor; if empty, the levels in the manifest, or the conditions.
    pub levels: Vec<Level>,
}

impl Factor {
    /// Returns the factor whose levels are the conditions.
    pub fn conditions() -> Self {
        Self {
            name: CONDITION_FACTOR.to_owned(),
            levels: Vec::new(),
        }
    }
}

impl FromStr for Factor {
    type Err = CompareError;

    fn from_str(text: &str) -> Result<Self, CompareError> {
        let bad = |reason: String| CompareError::Factor {
            name: text.to_owned(),
            reason,
        };
        let (name, levels) = match text.split_once(':') {
            None => (text, ""),
            Some((_, levels)) if levels.trim().is_empty() => return Err(bad("no level is named".to_owned())),
            Some(both) => both,
        };
        let mut factor = Self {
            name: name.trim().to_owned(),
            levels: Vec::new(),
        };
        if factor.name.is_empty() {
            return Err(bad("it has no name".to_owned()));
        }
        for level in levels.split(';').filter(|level| !level.trim().is_empty()) {
            let (name, members) = level.split_once('=').unwrap_or((level, level));
            let members: Vec<String> = members
                .split(',')
                .map(|member| member.trim().to_owned())
                .filter(|member| !member.is_empty())
                .collect();
            if members.is_empty() || name.trim().is_empty() {
                return Err(bad(format!("the level {level:?} has no name or no members")));
            }
            factor.levels.push(Level {
                name: name.trim().to_owned(),
                members,
            });
        }
        if factor.levels.len() == 1 {
            return Err(bad("it has one level, expected two or more".to_owned()));
        }
        let mut known = Vec::new();
        for member in factor.levels.iter().flat_map(|level| &level.members) {
            if known.contains(&member) {
                return Err(bad(format!("{member} is listed at two levels, or twice at one level")));
            }
            known.push(member);
        }
        Ok(factor)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn factor_text_is_parsed() {
        let axis: Factor = "axis:roll=C1r, C2r;pitch=C1p,C2p".parse().unwrap();
        assert_eq!((axis.name.as_str(), axis.levels.len()), ("axis", 2));
        assert_eq!(axis.levels[0].members, ["C1r", "C2r"]);
        // A level that consists of one condition needs no name of its own.
        let plant: Factor = "plant:fo;so".parse().unwrap();
        assert_eq!(
            (plant.levels[1].name.as_str(), plant.levels[1].members.len()),
            ("so", 1)
        );
        assert!("display".parse::<Factor>().unwrap().levels.is_empty());
        for bad in [
            "",
            ":a;b",
            "axis:",
            "axis:a=x",
            "axis:a=x;b=x",
            "axis:a=;b=x",
            "axis:=x;b=y",
        ] {
            assert!(bad.parse::<Factor>().is_err(), "{bad}");
        }
    }
}
