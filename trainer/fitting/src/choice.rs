//! Names of choices.

use clap::ValueEnum;

/// A choice among a few, by its name on the command line.
pub trait Choice: ValueEnum {
    /// Returns the name.
    fn name(&self) -> String;
}

impl<T: ValueEnum> Choice for T {
    fn name(&self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }
}
