//! Values that are chosen by name and whose type is not the command line's.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Returns a parser of the names of choices, and of aliases, each with its name.
pub(super) fn choice<T: Copy + Send + Sync + 'static>(
    choices: &[(&'static str, T)],
    aliases: &'static [(&'static str, &'static str)],
) -> impl TypedValueParser<Value = T> + use<T> {
    let choices = choices.to_vec();
    let values = choices.iter().map(|(name, _)| {
        let aliases = aliases.iter().filter(|(_, of)| of == name);
        PossibleValue::new(*name).aliases(aliases.map(|(alias, _)| *alias))
    });
    let values = PossibleValuesParser::new(values.collect::<Vec<_>>());
    values.try_map(move |text| {
        let alias = aliases.iter().find(|(alias, _)| *alias == text);
        let name = alias.map_or(&text[..], |(_, of)| of);
        let found = choices.iter().find(|(other, _)| *other == name);
        found.map(|(_, choice)| *choice).ok_or("unknown name")
    })
}
