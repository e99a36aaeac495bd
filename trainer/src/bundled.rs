//! Recipes that come with the trainer: trained on its own procedural materials and nothing measured, so that
//! they may be passed on. How they are made is in `trainer/recipes/README.md`.

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Recipe, RecipeError};

/// The compact basis of all that are of the model Linear.
pub static BASIS: &[u8] = include_bytes!("../recipes/linear.basis24");
/// What each of them loses: its name, then the mean loss on procedural materials that were not trained on, on 80 of
/// MERL's as networks, and on 17 of RGL's.
const LOSSES: &str = include_str!("../recipes/losses.csv");
/// Cycles of a fit by some of them on a Cortex-M4F, as `core/docs/costs.md` has them.
const CYCLES: &str = include_str!("../recipes/cycles.csv");

/// A recipe that comes along.
#[derive(Clone, Copy, Debug)]
pub struct BundledRecipe {
    /// Model and n, as `neural-n8`; `neural-n16-masked` where any of the readings may be missing.
    pub name: &'static str,
    /// The recipe's file.
    pub bytes: &'static [u8],
}

/// What a bundled recipe loses: mean losses, each over unseen materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Losses {
    /// On 40 procedural materials.
    pub procedural: f64,
    /// On 80 of MERL's, as networks.
    pub merl: f64,
    /// On 17 of RGL's.
    pub rgl: f64,
}

macro_rules! bundled {
    ($($name:literal in $file:literal),+ $(,)?) => {
        &[$(BundledRecipe {
            name: $name,
            bytes: include_bytes!(concat!("../recipes/", $file, ".recipe")),
        }),+]
    };
}

/// All of them, by model and n.
pub static ALL: &[BundledRecipe] = bundled![
    "linear-n1" in "completed/linear-n1",
    "linear-n2" in "completed/linear-n2",
    "linear-n4" in "completed/linear-n4",
    "linear-n8" in "completed/linear-n8",
    "linear-n16" in "completed/linear-n16",
    "linear-n32" in "completed/linear-n32",
    "linear-n16-masked" in "masked/linear-n16",
    "phong-n1" in "completed/phong-n1",
    "phong-n2" in "completed/phong-n2",
    "phong-n4" in "completed/phong-n4",
    "phong-n8" in "completed/phong-n8",
    "phong-n16" in "completed/phong-n16",
    "phong-n32" in "completed/phong-n32",
    "phong-n16-masked" in "masked/phong-n16",
    "cook-torrance-n1" in "completed/cook-torrance-n1",
    "cook-torrance-n2" in "completed/cook-torrance-n2",
    "cook-torrance-n4" in "completed/cook-torrance-n4",
    "cook-torrance-n8" in "completed/cook-torrance-n8",
    "cook-torrance-n16" in "completed/cook-torrance-n16",
    "cook-torrance-n32" in "completed/cook-torrance-n32",
    "cook-torrance-n16-masked" in "masked/cook-torrance-n16",
    "neural-n1" in "completed/neural-n1",
    "neural-n2" in "completed/neural-n2",
    "neural-n4" in "completed/neural-n4",
    "neural-n8" in "completed/neural-n8",
    "neural-n16" in "completed/neural-n16",
    "neural-n32" in "completed/neural-n32",
    "neural-n16-masked" in "masked/neural-n16",
];

/// A recipe of the paper's schedule, to compare the others with.
pub static PAPER: BundledRecipe = BundledRecipe {
    name: "neural-n8-paper",
    bytes: include_bytes!("../recipes/paper/neural-n8.recipe"),
};

/// The recipe of a name; None if there is none.
#[must_use]
pub fn find(name: &str) -> Option<&'static BundledRecipe> {
    ALL.iter().find(|bundled| bundled.name == name)
}

/// The one of a checksum, as its file has it.
#[must_use]
pub fn find_by_checksum(checksum: u32) -> Option<&'static BundledRecipe> {
    let has =
        |bundled: &&BundledRecipe| bundled.recipe().is_ok_and(|own| own.checksum() == checksum);
    ALL.iter().find(has)
}

impl BundledRecipe {
    /// The recipe.
    ///
    /// # Errors
    /// None: a test reads all of them.
    pub fn recipe(&self) -> Result<Recipe<'static>, RecipeError> {
        Recipe::parse(self.bytes)
    }

    /// The compact basis that belongs to it; None if its model needs none.
    #[must_use]
    pub fn basis(&self) -> Option<&'static [u8]> {
        let model = self.recipe().ok()?.model();
        (model == ModelKind::Linear).then_some(BASIS)
    }

    /// What it loses, where that was measured.
    #[must_use]
    pub fn losses(&self) -> Option<Losses> {
        LOSSES.lines().find_map(|line| {
            let mut cells = line.split(',');
            (cells.next() == Some(self.name)).then_some(())?;
            let mut loss = || cells.next()?.parse().ok();
            Some(Losses {
                procedural: loss()?,
                merl: loss()?,
                rgl: loss()?,
            })
        })
    }

    /// Cycles of a fit on a Cortex-M4F, where the firmware's tests measure them.
    #[must_use]
    pub fn cycles(&self) -> Option<u64> {
        let mut rows = CYCLES.lines().filter_map(|line| line.split_once(','));
        let (_, cycles) = rows.find(|(name, _)| *name == self.name)?;
        cycles.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::model::linear;

    use super::*;

    #[test]
    fn each_is_what_its_name_says_and_has_its_losses() {
        let basis = linear::Basis::parse(BASIS).expect("the basis is whole");
        for bundled in ALL {
            let recipe = bundled.recipe().expect("it is whole");
            let masked = recipe.tolerates_missing();
            let suffix = if masked { "-masked" } else { "" };
            let name = format!("{}-n{}{suffix}", recipe.model().name(), recipe.samples());
            assert_eq!(bundled.name, name);
            assert!(
                find(&name).is_some() && bundled.losses().is_some(),
                "{name}"
            );
            let of = recipe.method().basis_checksum();
            assert_eq!(of, bundled.basis().map(|_| basis.of()), "{name}");
            let same = find_by_checksum(recipe.checksum());
            assert_eq!(same.map(|same| same.name), Some(bundled.name));
        }
        assert!(find("neural-n3").is_none());
    }

    #[test]
    fn the_paper_s_recipe_descends_without_a_map() {
        let recipe = PAPER.recipe().expect("it is whole");
        assert_eq!((recipe.model(), recipe.samples()), (ModelKind::Neural, 8));
        assert!(recipe.descent().is_some() && recipe.completed().is_none());
        let provenance = recipe.metadata().expect("they are whole").provenance;
        assert!(provenance.is_some_and(|provenance| provenance.schedule.starts_with("paper ")));
    }
}
