//! Controlled elements of conditions in text form, as for `hoid group init --element`:
//!
//! ```text
//! C1-*,C3-pitch=90/(s(s+6))
//! C3-roll=90/(s(s+6)) > 30/(s(s+.2)) @ 50 : 0.5
//! ```
//!
//! The text gives the names of conditions (`*` matches anything) and the element. If the element changes, the text also
//! gives the element after the change, the time of the change in s, and its rate G in 1/s; without G the change is
//! sudden.

use std::str::FromStr;

use super::{manifest::Manifest, pattern::matches_any};

/// The controlled element of one or more conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionElement {
    names: Vec<String>,
    element: String,
    change: Option<Change>,
}

#[derive(Debug, Clone, PartialEq)]
struct Change {
    to: String,
    at_s: f64,
    per_s: Option<f64>,
}

impl FromStr for ConditionElement {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const EXPECTED: &str =
            "expected NAMES=ELEMENT or NAMES=ELEMENT>ELEMENT@TIME:G, such as C3-roll=90/(s(s+6))>30/(s(s+.2))@50:0.5";
        let (names, course) = text.split_once('=').ok_or_else(|| format!("{text}: {EXPECTED}"))?;
        let names: Vec<String> = names.split(',').map(|name| name.trim().to_owned()).collect();
        if names.iter().any(String::is_empty) {
            return Err(format!("{text}: a name is empty; {EXPECTED}"));
        }
        let Some((element, rest)) = course.split_once('>') else {
            return Ok(Self {
                names,
                element: course.trim().to_owned(),
                change: None,
            });
        };
        let (to, when) = rest
            .split_once('@')
            .ok_or_else(|| format!("{text}: the time of the change is missing; {EXPECTED}"))?;
        let (at, rate) = when.split_once(':').map_or((when, None), |(at, rate)| (at, Some(rate)));
        let number = |what: &str, text: &str| {
            let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| format!("{what} of the change is {:?}; {EXPECTED}", text.trim()))
        };
        Ok(Self {
            names,
            element: element.trim().to_owned(),
            change: Some(Change {
                to: to.trim().to_owned(),
                at_s: number("the time", at)?,
                per_s: rate.map(|rate| number("the rate", rate)).transpose()?,
            }),
        })
    }
}

impl ConditionElement {
    /// Writes the elements to the matching conditions of a manifest.
    ///
    /// # Errors
    /// A name that matches no condition, an element that cannot be parsed, or a rate that is not positive.
    pub fn apply(all: &[Self], manifest: &mut Manifest) -> Result<(), String> {
        let mut conditions: Vec<String> = manifest.runs.iter().map(|run| run.condition.clone()).collect();
        conditions.sort();
        conditions.dedup();
        for one in all {
            for name in &one.names {
                let own: Vec<&String> = conditions.iter().filter(|of| matches_any(name, of)).collect();
                if own.is_empty() {
                    return Err(format!(
                        "no condition is called {name}, expected one of {}",
                        conditions.join(", ")
                    ));
                }
                for condition in own {
                    let settings = manifest.conditions.entry(condition.clone()).or_default();
                    settings.controlled_element = Some(one.element.clone());
                    if let Some(change) = &one.change {
                        settings.changes_to = Some(change.to.clone());
                        settings.change_s = Some(change.at_s);
                        settings.change_per_s = change.per_s;
                    }
                    settings
                        .check_elements()
                        .map_err(|reason| format!("{condition}: {reason}"))?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn manifest() -> Manifest {
        let runs = ["C1-roll", "C1-pitch", "C3-roll"].map(|condition| {
            format!("[[runs]]\nfile = \"{condition}.csv\"\nsubject = \"a\"\ncondition = \"{condition}\"\nrun = \"1\"\n")
        });
        Manifest::parse(&format!("name = \"x\"\n{}", runs.join("")), "group.toml").unwrap()
    }

    fn apply_elements(texts: &[&str]) -> Result<Manifest, String> {
        let elements: Vec<ConditionElement> = texts.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        let mut manifest = manifest();
        ConditionElement::apply(&elements, &mut manifest)?;
        Ok(manifest)
    }

    #[test]
    fn elements_and_changes_are_applied_to_conditions() {
        let found = apply_elements(&["C1-*=90/(s(s+6))", "C3-roll=90/(s(s+6)) > 30/(s(s+.2)) @ 50 : 0.5"]).unwrap();
        let settings = |name: &str| found.conditions.get(name).unwrap();
        for name in ["C1-roll", "C1-pitch"] {
            assert_eq!(settings(name).constant_element(), Some("90/(s(s+6))"));
        }
        let changing = settings("C3-roll");
        assert_eq!(changing.constant_element(), None);
        assert_eq!((changing.change_s, changing.change_per_s), (Some(50.0), Some(0.5)));
        assert_eq!(changing.changes_to.as_deref(), Some("30/(s(s+.2))"));
        assert_eq!(Manifest::parse(&found.text(), "group.toml").unwrap(), found);
        assert_eq!(
            apply_elements(&["C3-roll=1/s>1/(s^2)@50"]).unwrap().conditions["C3-roll"].change_per_s,
            None
        );
    }

    #[test]
    fn invalid_elements_are_refused() {
        for (text, named) in [
            ("C1-roll", "NAMES=ELEMENT"),
            ("C1-roll,=1/s", "a name is empty"),
            (
                "C9=1/s",
                "no condition is called C9, expected one of C1-pitch, C1-roll, C3-roll",
            ),
            ("C3-roll=1/(s>1/s@50", "controlled_element"),
            ("C3-roll=1/s>1/s", "the time of the change is missing"),
            ("C3-roll=1/s>1/s@soon", "\"soon\""),
            ("C3-roll=1/s>1/s@50:-2", "change_per_s is -2"),
        ] {
            let refused = apply_elements(&[text]).unwrap_err();
            assert!(refused.contains(named), "{text}: {refused}");
        }
    }
}
