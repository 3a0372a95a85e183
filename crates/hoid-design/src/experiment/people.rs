//! The people for whom an experiment is designed.
//!
//! | source | typical person | others |
//! |---|---|---|
//! | `population` | person predicted by the crossover model (`typical_operator`) | for each parameter of the prior, two people, one spread above and one spread below its median |
//! | scenario, fit (including the response to a target) | the person of the file | none |
//! | result of a group, `population.json` | medians over people (`group_people`) | each person |

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
    str::FromStr,
};

use hoid_model::{FamilyState, family_scenario::Feedforward};
use serde_json::Value;

use super::{
    DesignError,
    design_people::{ChosenPeople, GivenOptions, NamedState},
    group_people,
    other_forcing::family,
    typical_operator,
};

/// The people for whom an experiment is designed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum People {
    /// Typical people, adapted to the controlled element.
    #[default]
    Population,
    /// A file or directory: a scenario (`.toml`), a fit, a population or the result of a group (`.json`), or the
    /// directory of a group.
    File(PathBuf),
}

/// Name of [`People::Population`].
const POPULATION_NAME: &str = "population";

impl People {
    /// Parses the name `population` or a path.
    pub fn from_text(text: &str) -> Self {
        match text {
            POPULATION_NAME => Self::Population,
            file => Self::File(file.into()),
        }
    }
}

impl FromStr for People {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(Self::from_text(text))
    }
}

impl std::fmt::Display for People {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Population => f.write_str(POPULATION_NAME),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

impl People {
    /// Returns the path of the file or directory; `None` for the population.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Population => None,
            Self::File(path) => Some(path),
        }
    }

    pub(super) fn choose(&self, given: &GivenOptions<'_>) -> Result<ChosenPeople, DesignError> {
        let Self::File(path) = self else {
            let (typical, others) = typical_operator::population(&given.element(POPULATION_NAME)?, given.form)?;
            return Ok(ChosenPeople {
                typical,
                others,
                feedforward: None,
                findings: Vec::new(),
            });
        };
        if let Some(form) = given.form {
            return Err(DesignError::FormOfPeople {
                people: path.display().to_string(),
                form,
            });
        }
        if path.is_dir() {
            return group_people::from_directory(path, given);
        }
        if !hoid_io::is_fit_file(&path.to_string_lossy()) {
            let (state, feedforward) = read_scenario(path, given)?;
            return Ok(ChosenPeople {
                feedforward,
                ..single_person(path, state)
            });
        }
        let text = hoid_io::read_settings(path)?;
        let object: Value = serde_json::from_str(&text).unwrap_or_default();
        if object["kind"] == "population" {
            return group_people::from_population(&object, path, given);
        }
        if object["people"].is_array() && object["kind"] != "design" {
            return group_people::from_json(&object, path, given);
        }
        let name = path.display().to_string();
        let file = hoid_io::parse_fit(&text, &name)?;
        let feedforward = file.feedforward.clone();
        let fit = file.operator()?;
        let state = FamilyState {
            operator: fit.operator,
            controlled_element: given.element(&name)?,
        };
        Ok(ChosenPeople {
            feedforward,
            ..single_person(path, state)
        })
    }
}

fn read_scenario(path: &Path, given: &GivenOptions<'_>) -> Result<(FamilyState, Option<Feedforward>), DesignError> {
    let scenario = family(path)?;
    let mut state = scenario.initial;
    if let Some(element) = given.controlled_element {
        state.controlled_element = element.clone();
    }
    Ok((state, scenario.feedforward))
}

fn single_person(path: &Path, state: FamilyState) -> ChosenPeople {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    ChosenPeople {
        typical: NamedState { name, state },
        others: Vec::new(),
        feedforward: None,
        findings: Vec::new(),
    }
}
