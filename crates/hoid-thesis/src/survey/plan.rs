//! The plan of a survey: the plan of a study, and a file of comparators.

use hoid_study::Plan;
use toml::{Table, Value};

use crate::{
    ThesisError,
    comparators::{Comparator, comparators},
};

/// A checked plan of a survey.
pub struct SurveyPlan {
    /// Scenarios and estimators.
    pub study: Plan,
    /// Comparators with the names of their tables.
    pub comparators: Vec<(String, Box<dyn Comparator>)>,
}

impl SurveyPlan {
    /// Parses and checks a study and its comparators.
    ///
    /// # Errors
    /// [`ThesisError::Study`] if the study is invalid; [`ThesisError::Unsuited`] or [`ThesisError::Estimator`] if a
    /// comparator or one of its options is invalid.
    pub fn parse(study: &str, comparators: &str, path: &str) -> Result<Self, ThesisError> {
        let study = Plan::parse(study, path)?;
        let wrong = |quantity: &str, found: String, expected: String| ThesisError::Unsuited {
            method: "a comparator of the plan",
            quantity: quantity.to_owned(),
            found,
            expected,
        };
        let table: Table = comparators
            .parse()
            .map_err(|error: toml::de::Error| wrong("its table", error.message().to_owned(), "TOML".to_owned()))?;
        if let Some(key) = table.keys().find(|key| *key != "comparators") {
            return Err(wrong("a key", key.clone(), "only [[comparators]]".to_owned()));
        }
        let each = table.get("comparators").and_then(Value::as_array).into_iter().flatten();
        let comparators = each
            .map(|entry| {
                let table = entry
                    .as_table()
                    .ok_or_else(|| wrong("its entry", entry.to_string(), "a table".to_owned()))?;
                comparator(table, &wrong)
            })
            .collect::<Result<_, ThesisError>>()?;
        Ok(Self { study, comparators })
    }
}

fn comparator(
    table: &Table,
    wrong: &dyn Fn(&str, String, String) -> ThesisError,
) -> Result<(String, Box<dyn Comparator>), ThesisError> {
    let text = |key: &str| {
        let value = table.get(key).and_then(Value::as_str);
        value.ok_or_else(|| wrong(key, "missing".to_owned(), "a string".to_owned()))
    };
    let (name, method) = (text("name")?, text("method")?);
    let all = comparators();
    let known: Vec<&str> = all.iter().map(|of| of.description().name).collect();
    let missing = || wrong("method", method.to_owned(), format!("one of {}", known.join(", ")));
    let mut found = comparators()
        .into_iter()
        .find(|of| of.description().name == method)
        .ok_or_else(missing)?;
    for (key, value) in table
        .iter()
        .filter(|(key, _)| !["name", "method"].contains(&key.as_str()))
    {
        let text = match value {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        if !found.set(key, &text)? {
            let keys: Vec<&str> = found.list().iter().map(|setting| setting.name).collect();
            return Err(wrong("an option", key.clone(), format!("one of {}", keys.join(", "))));
        }
    }
    Ok((name.to_owned(), found))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::plans::SURVEY;

    const PLAN_HEAD: &str = r#"
name = "small"
replications = 2
[[scenarios]]
condition = "C4"
[[estimators]]
name = "RLS"
method = "rls"
"#;

    #[test]
    fn survey_plan_has_all_comparators() {
        let plan = SurveyPlan::parse(SURVEY.text, super::super::COMPARATOR_PLAN, "survey.toml").unwrap();
        let methods: Vec<&str> = plan.comparators.iter().map(|(_, of)| of.description().name).collect();
        for comparator in comparators() {
            assert!(
                methods.contains(&comparator.description().name),
                "{}",
                comparator.description().name
            );
        }
    }

    #[test]
    fn options_are_set_and_unknown_names_refused() {
        let parse = |tail: &str| SurveyPlan::parse(PLAN_HEAD, &format!("[[comparators]]\n{tail}"), "small.toml");
        let plan = parse("name = \"FIR\"\nmethod = \"rls-fir\"\nnb = 64\n").unwrap();
        assert_eq!(plan.comparators[0].1.get("nb").as_deref(), Some("64"));
        assert!(
            SurveyPlan::parse(PLAN_HEAD, "", "small.toml")
                .unwrap()
                .comparators
                .is_empty()
        );
        for (tail, named) in [
            ("name = \"x\"\nmethod = \"lstm\"\n", "rls-fir"),
            ("name = \"x\"\nmethod = \"wavelet\"\nnb = 3\n", "radians"),
            ("name = \"x\"\nmethod = \"wavelet\"\nradians = -1\n", "radians"),
            ("method = \"wavelet\"\n", "name"),
            ("name = \n", "TOML"),
            (
                "name = \"x\"\nmethod = \"wavelet\"\n[[estimators]]\nname = \"y\"\n",
                "only [[comparators]]",
            ),
        ] {
            let Err(refused) = parse(tail) else { panic!("{tail}") };
            assert!(refused.to_string().contains(named), "{refused}");
        }
    }
}
