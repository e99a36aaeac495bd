//! The budgets of `embedded-demo/bench/budgets.toml`.

use std::collections::BTreeMap;
use std::path::Path;

/// The most that each figure may be.
#[derive(Clone, Debug)]
pub struct Budgets(BTreeMap<String, u64>);

impl Budgets {
    /// Reads the repository's.
    ///
    /// # Panics
    /// If the file is not there or holds anything but numbers.
    #[must_use]
    pub fn load() -> Self {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../embedded-demo/bench/budgets.toml");
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

    /// A sentence for each figure above its budget, for each that has none, and for each budget
    /// without a figure.
    #[must_use]
    pub fn exceeded(&self, figures: &[(String, u64)]) -> Vec<String> {
        let mut sentences = Vec::new();
        for (name, value) in figures {
            match self.0.get(name) {
                Some(budget) if value > budget => {
                    sentences.push(format!("{name} is {value}, its budget {budget}"));
                }
                Some(_) => {}
                None => sentences.push(format!("{name} has no budget")),
            }
        }
        for name in self.0.keys() {
            if !figures.iter().any(|(figure, _)| figure == name) {
                sentences.push(format!("{name} has a budget, but nothing measures it"));
            }
        }
        sentences
    }
}
