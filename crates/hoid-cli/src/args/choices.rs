//! Parsers for choices of the library by their names.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use hoid::model::NamedChoice;

/// Returns a parser for the names of these choices.
pub fn choice_parser<T: NamedChoice + Send + Sync>(choices: &'static [T]) -> impl TypedValueParser<Value = T> {
    value_parser_by_name(choices.iter().map(|choice| (choice.choice_name(), *choice)))
}

/// Returns a parser for the names of these values; capitals are accepted if the option ignores the case.
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
