//! Bundled recipes. They are trained on the built-in procedural materials and on 17 materials that RGL published in the
//! public domain (CC0), so they can be redistributed. `trainer/recipes/README.md` describes their training.

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use serde::{Deserialize, Serialize};

use crate::recipe::{Metadata, MetadataError};
use crate::route::{Order, Route};

/// The compact basis of all bundled recipes of the model Linear.
pub static BASIS: &[u8] = include_bytes!("../../recipes/linear.basis24");
/// The compact basis of all bundled recipes without a pattern.
pub static ANY_BASIS: &[u8] = include_bytes!("../../recipes/any/linear-any.basis");
/// The accuracy of the bundled recipes, one per line: the name, the mean losses on unseen procedural materials and on
/// networks of 80 MERL materials, the mean color error on the latter, and the cross-validated loss on RGL's materials.
const LOSSES: &str = include_str!("../../recipes/losses.csv");
/// The cycles of a fit on a Cortex-M4F for some of the bundled recipes, one per line: the name and the number. They are
/// those of `core/docs/costs.md`.
const CYCLES: &str = include_str!("../../recipes/cycles.csv");

/// A bundled, pre-trained recipe.
#[derive(Clone, Copy, Debug)]
pub struct BundledRecipe {
    /// The name: model and n, such as `neural-n8`, or `neural-any` for readings at any directions. With the suffix `-masked`, readings may be missing. With the suffix
    /// `-16s`, they may be missing too, and the recipe was trained for a scan of 16 seconds.
    pub name: &'static str,
    /// The recipe's file.
    pub bytes: &'static [u8],
}

/// The accuracy of a bundled recipe on unseen materials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// The mean loss on 40 procedural materials.
    pub procedural: f64,
    /// The mean loss on networks of 80 MERL materials.
    pub merl: f64,
    /// The mean color error of the same materials' spheres, CIEDE2000.
    pub merl_color: f64,
    /// The mean loss on 17 materials of RGL, by cross-validation of a training at quick effort; None if it was not measured.
    pub rgl: Option<f64>,
}

/// The recipes of a model: the name of each after the model's name, and its folder and file.
macro_rules! recipes_of {
    ($model:literal) => {
        recipes_of![$model:
            "-n1" in "completed/" "-n1",
            "-n2" in "completed/" "-n2",
            "-n4" in "completed/" "-n4",
            "-n8" in "completed/" "-n8",
            "-n16" in "completed/" "-n16",
            "-n32" in "completed/" "-n32",
            "-n16-masked" in "masked/" "-n16",
            "-n16-16s" in "timed/" "-n16",
            "-any" in "any/" "-any",
        ]
    };
    ($model:literal: $($name:literal in $folder:literal $file:literal),+ $(,)?) => {
        [$(BundledRecipe {
            name: concat!($model, $name),
            bytes: include_bytes!(concat!("../../recipes/", $folder, $model, $file, ".recipe")),
        }),+]
    };
}

static BY_MODEL: [[BundledRecipe; 9]; 4] = [
    recipes_of!("linear"),
    recipes_of!("phong"),
    recipes_of!("cook-torrance"),
    recipes_of!("neural"),
];

/// All bundled recipes, ordered by model and n.
pub static ALL: &[BundledRecipe] = BY_MODEL.as_flattened();

/// A recipe that was trained with the paper's schedule, for comparison.
pub static PAPER: BundledRecipe = BundledRecipe {
    name: "neural-n8-paper",
    bytes: include_bytes!("../../recipes/paper/neural-n8.recipe"),
};

/// A bundled recipe as `trainer recipes list --json` and Python list it.
#[derive(Serialize)]
pub struct Entry {
    name: &'static str,
    model: &'static str,
    samples: usize,
    takes_missing: bool,
    checksum: String,
    bytes: usize,
    basis_bytes: Option<usize>,
    /// Seconds of a scan on the machine that the recipe was trained for, or else on the default one.
    seconds: Option<f64>,
    loss: Option<Losses>,
}

impl Entry {
    fn new(bundled: &BundledRecipe) -> Result<Self, MetadataError> {
        let recipe = bundled.recipe();
        let machine = Metadata::of(&recipe)?.machine();
        let route = Route::of_recipe(&recipe, &machine, Order::Travel);
        Ok(Self {
            name: bundled.name,
            model: recipe.model().name(),
            samples: recipe.samples(),
            takes_missing: recipe.tolerates_missing(),
            checksum: format!("{:08x}", recipe.checksum()),
            bytes: bundled.bytes.len(),
            basis_bytes: bundled.basis().map(<[u8]>::len),
            seconds: route
                .map(|route| route.total())
                .filter(|_| recipe.samples() > 0),
            loss: bundled.losses(),
        })
    }
}

/// Lists all bundled recipes.
///
/// # Errors
/// None in practice: a test reads the metadata of all.
pub fn entries() -> Result<Vec<Entry>, MetadataError> {
    ALL.iter().map(Entry::new).collect()
}

/// Returns the bundled recipe with this name; None if no recipe has it.
#[must_use]
pub fn find(name: &str) -> Option<&'static BundledRecipe> {
    ALL.iter().find(|bundled| bundled.name == name)
}

/// Returns the bundled recipe with this checksum; None if no recipe has it.
#[must_use]
pub fn find_by_checksum(checksum: u32) -> Option<&'static BundledRecipe> {
    let mut all = ALL.iter();
    all.find(|bundled| bundled.recipe().checksum() == checksum)
}

impl BundledRecipe {
    /// Parses the recipe.
    #[must_use]
    pub fn recipe(&self) -> Recipe<'static> {
        Recipe::parse(self.bytes).expect("a test parses all bundled recipes")
    }

    /// Returns the compact basis of the recipe; None if it does not need one.
    #[must_use]
    pub fn basis(&self) -> Option<&'static [u8]> {
        let recipe = self.recipe();
        match (recipe.samples(), recipe.model()) {
            (0, _) => Some(ANY_BASIS),
            (_, ModelKind::Linear) => Some(BASIS),
            _ => None,
        }
    }

    /// Returns the losses of the recipe; None if they were not measured.
    #[must_use]
    pub fn losses(&self) -> Option<Losses> {
        let mut rows = csv::ReaderBuilder::new();
        let rows = rows.has_headers(false).from_reader(LOSSES.as_bytes());
        let mut rows = rows.into_deserialize::<(String, Losses)>().flatten();
        let row = rows.find(|(name, _)| name == self.name);
        row.map(|(_, losses)| losses)
    }

    /// Returns the cycles of a fit on a Cortex-M4F; None if the firmware tests do not measure them.
    #[must_use]
    pub fn cycles(&self) -> Option<u64> {
        let mut rows = CYCLES.lines().filter_map(|line| line.split_once(','));
        let (_, cycles) = rows.find(|(name, _)| *name == self.name)?;
        cycles.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use crate::recipe::options::Schedule;
    use glimpse_core::fit::Estimator;
    use glimpse_core::model::linear;

    use super::*;

    #[test]
    fn names_match_recipes_and_losses_are_recorded() {
        let checksum = |basis| {
            let basis = linear::Basis::parse(basis).expect("the basis is valid");
            basis.checksum()
        };
        for bundled in ALL {
            let recipe = bundled.recipe();
            let metadata = Metadata::of(&recipe).expect("the metadata are valid");
            let is_any = recipe.samples() == 0;
            let suffix = match (metadata.scan_seconds(), recipe.tolerates_missing()) {
                (Some(seconds), true) => format!("-{seconds}s"),
                (None, true) => "-masked".to_owned(),
                (None, false) => String::new(),
                (Some(_), false) => panic!("{}: needs all readings", bundled.name),
            };
            let name = match is_any {
                true => format!("{}-any", recipe.model().name()),
                false => format!("{}-n{}{suffix}", recipe.model().name(), recipe.samples()),
            };
            assert_eq!(bundled.name, name);
            assert!(
                find(&name).is_some() && bundled.losses().is_some() != is_any,
                "{name}"
            );
            assert_eq!(
                recipe.basis_checksum(),
                bundled.basis().map(checksum),
                "{name}"
            );
            let by_checksum = find_by_checksum(recipe.checksum());
            assert_eq!(by_checksum.map(|bundled| bundled.name), Some(bundled.name));
        }
        assert!(find("neural-n3").is_none());
    }

    #[test]
    fn paper_recipe_uses_descent_without_coefficient_net() {
        let recipe = PAPER.recipe();
        assert_eq!((recipe.model(), recipe.samples()), (ModelKind::Neural, 8));
        assert!(matches!(recipe.estimator(), Estimator::Sgd(_)));
        let metadata = Metadata::of(&recipe).expect("the metadata are valid");
        let options = metadata.options().expect("stated options");
        assert_eq!(options.schedule, Schedule::Paper);
    }
}
