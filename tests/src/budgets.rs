//! The budgets of `embedded-demo/bench/budgets.toml`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::figures::Extent;

/// Path of the budgets in the repository.
const FILE: &str = "embedded-demo/bench/budgets.toml";

/// The largest allowed value of each figure.
#[derive(Clone, Debug)]
pub struct Budgets(BTreeMap<String, u64>);

impl Budgets {
    /// Reads the repository's budgets.
    ///
    /// # Panics
    /// If the file cannot be read or contains anything but numbers.
    #[must_use]
    pub fn load() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(FILE);
        let text = std::fs::read_to_string(&path)
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let table: BTreeMap<String, BTreeMap<String, BTreeMap<String, u64>>> =
            toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut budgets = BTreeMap::new();
        for (target, models) in table {
            for (model, figures) in models {
                for (name, budget) in figures {
                    budgets.insert(format!("{target}.{model}.{name}"), budget);
                }
            }
        }
        Self(budgets)
    }

    /// Returns a message for each figure above its budget, each figure without a budget, and, if all are measured, each
    /// budget without a figure.
    #[must_use]
    pub fn violations(&self, figures: &[(String, u64)], extent: Extent) -> Vec<String> {
        let mut messages = Vec::new();
        for (name, value) in figures {
            match self.0.get(name) {
                Some(budget) if value > budget => {
                    messages.push(format!(
                        "{name} is {value}, above its budget {budget}: reduce it, or raise the budget in {FILE}"
                    ));
                }
                Some(_) => {}
                None => messages.push(format!(
                    "{name} is {value} and has no budget: add it to {FILE}"
                )),
            }
        }
        for name in self.0.keys().filter(|_| extent == Extent::All) {
            if !figures.iter().any(|(figure, _)| figure == name) {
                messages.push(format!(
                    "{name} has a budget, but no test measures it: remove it from {FILE}"
                ));
            }
        }
        messages
    }
}
