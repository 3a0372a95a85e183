//! Choices of the library as the command line reads them: by their own names.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use hoid::model::NamedChoice;

/// One of some choices of the library, by its name.
pub fn choice_parser<T: NamedChoice + Send + Sync>(choices: &'static [T]) -> impl TypedValueParser<Value = T> {
    value_parser_by_name(choices.iter().map(|choice| (choice.choice_name(), *choice)))
}

/// One of some values by its name, in capitals or not where the option takes both.
pub fn value_parser_by_name<T: Clone + Send + Sync + 'static>(
    values: impl IntoIterator<Item = (&'static str, T)>,
) -> impl TypedValueParser<Value = T> {
    let values: Vec<(&str, T)> = values.into_iter().collect();
    let names: Vec<&'static str> = values.iter().map(|(name, _)| *name).collect();
    PossibleValuesParser::new(names).try_map(move |typed| {
        let found = values.iter().find(|(name, _)| name.eq_ignore_ascii_case(&typed));
        found
            .map(|(_, value)| value.clone())
            .ok_or("not among the possible values")
    })
}
