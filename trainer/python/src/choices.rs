//! Arguments that are chosen by name.

use glimpse_fitting::choice::Choice;

use crate::error::{Result, reject};

/// Returns the choice with a name, as on the command line. For an unknown name, the error names `argument` and all choices.
pub(crate) fn choose<T: Choice>(argument: &str, name: Option<&str>) -> Result<Option<T>> {
    let Some(name) = name else { return Ok(None) };
    if let Ok(choice) = T::from_str(name, false) {
        return Ok(Some(choice));
    }
    let names: Vec<String> = T::value_variants().iter().map(T::name).collect();
    reject(format!(
        "{argument} is `{name}`, and must be one of {}",
        names.join(", ")
    ))
}
