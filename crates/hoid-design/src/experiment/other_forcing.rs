//! Forcing functions with which the designed one is compared.

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
    str::FromStr,
};

use hoid_io::{AnyScenario, ColumnValues, OutputTable, read_any_scenario, read_table};
use hoid_model::{
    FamilyScenario,
    forcing::{ForcingFunction, Sinusoid},
};

use super::{DesignError, EntryPoint, Forcing};

/// Another forcing function: the ten sines of the thesis (`reference`), the forcing functions of a scenario, or the
/// lines in a table with the columns omega_rad_s, amplitude and, optionally, phase_rad.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OtherForcing {
    /// The ten sines of the thesis.
    Reference,
    /// A scenario (`.toml`) or a table of lines.
    File(PathBuf),
}

/// Name of [`OtherForcing::Reference`].
const REFERENCE_NAME: &str = "reference";

impl OtherForcing {
    /// Parses the name `reference` or the path of a file.
    pub fn from_text(text: &str) -> Self {
        match text {
            REFERENCE_NAME => Self::Reference,
            file => Self::File(file.into()),
        }
    }
}

impl FromStr for OtherForcing {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(Self::from_text(text))
    }
}

impl OtherForcing {
    pub(super) fn name(&self) -> String {
        match self {
            Self::Reference => REFERENCE_NAME.to_owned(),
            Self::File(path) => path.display().to_string(),
        }
    }

    /// Returns the forcing function with lines at these points of entry.
    pub(super) fn forcing(&self, points: &[EntryPoint]) -> Result<Forcing, DesignError> {
        let one = |function: &ForcingFunction| match points {
            [enters] => Ok(Forcing::of(*enters, function)),
            _ => Err(DesignError::OneForcing {
                name: self.name(),
                missing: EntryPoint::Disturbance,
            }),
        };
        match self {
            Self::Reference => one(&ForcingFunction::reference()),
            Self::File(path) if is_scenario(path) => {
                let scenario = family(path)?;
                let of = |enters: &EntryPoint| match enters {
                    EntryPoint::Target => &scenario.target.function,
                    EntryPoint::Disturbance => &scenario.disturbance.function,
                };
                if let Some(missing) = points.iter().find(|p| of(p).sinusoids().is_empty()) {
                    return Err(DesignError::OneForcing {
                        name: self.name(),
                        missing: *missing,
                    });
                }
                let all = points.iter().flat_map(|p| Forcing::of(*p, of(p)).lines().to_vec());
                Ok(Forcing::new(all.collect())?)
            }
            Self::File(path) => one(&lines(&read_table(path)?, path)?),
        }
    }
}

fn is_scenario(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// Reads a scenario with an operator of the family.
pub(super) fn family(path: &Path) -> Result<FamilyScenario, DesignError> {
    match read_any_scenario(path)? {
        AnyScenario::Family(scenario) => Ok(*scenario),
        AnyScenario::Reference(_) => Err(DesignError::OtherScenario {
            path: path.display().to_string(),
        }),
    }
}

fn lines(table: &OutputTable, path: &Path) -> Result<ForcingFunction, DesignError> {
    let column = |name: &str| match table.column(name) {
        Some(ColumnValues::Real(values)) => Some(values.clone()),
        Some(ColumnValues::Whole(values)) => Some(values.iter().map(|v| *v as f64).collect()),
        _ => None,
    };
    let (Some(omega), Some(amplitude)) = (column("omega_rad_s"), column("amplitude")) else {
        let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
        return Err(DesignError::NoLines {
            path: path.display().to_string(),
            found: names.join(", "),
        });
    };
    let phase = column("phase_rad").unwrap_or_else(|| vec![0.0; omega.len()]);
    let line = |((omega_rad_s, amplitude_deg), phase_rad)| Sinusoid {
        amplitude_deg,
        omega_rad_s,
        phase_rad,
    };
    let lines = omega.into_iter().zip(amplitude).zip(phase).map(line).collect();
    Ok(ForcingFunction::new(lines)?)
}
