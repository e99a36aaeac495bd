//! Which materials a recipe has learned from: judged on those, it is judged on what it knows.

use std::collections::{HashMap, HashSet};

use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_materials::{Identity, Material};

/// The materials that something was trained on, by name and by digest.
#[derive(Clone, Debug, Default)]
pub struct TrainedOn {
    names: HashMap<String, u32>,
    digests: HashSet<u32>,
}

/// How a material is known to what was trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// The very same BRDF was trained on, whatever its name was.
    Same,
    /// One of the same name was trained on, which is another BRDF: another measurement of the same
    /// material, perhaps, or the same one in another format.
    Namesake,
}

impl TrainedOn {
    /// As a recipe names them; None if it does not, as recipes stripped for flash.
    ///
    /// # Errors
    /// If what the recipe states about itself makes no sense.
    pub fn of_recipe(recipe: &Recipe<'_>) -> Result<Option<Self>, RecipeError> {
        let mut all = Self::default();
        for (name, digest) in recipe.metadata()?.materials {
            all.add(name.to_owned(), digest);
        }
        Ok((!all.names.is_empty()).then_some(all))
    }

    /// These materials.
    #[must_use]
    pub fn of_materials(materials: &[Box<dyn Material>]) -> Self {
        let mut all = Self::default();
        for material in materials {
            let Identity { name, digest } = Identity::of(&**material);
            all.add(name, digest);
        }
        all
    }

    fn add(&mut self, name: String, digest: u32) {
        self.names.insert(name, digest);
        self.digests.insert(digest);
    }

    /// Whether, and how, a material is known; None if it is new.
    #[must_use]
    pub fn knows(&self, material: &dyn Material) -> Option<Known> {
        let Identity { name, digest } = Identity::of(material);
        match (self.digests.contains(&digest), self.names.get(&name)) {
            (true, _) => Some(Known::Same),
            (false, Some(_)) => Some(Known::Namesake),
            (false, None) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glimpse_core::geometry::Angles;
    use glimpse_materials::{Procedural, Source};

    /// A material under another name.
    struct Renamed<'a>(&'a str, &'a Procedural);

    impl Material for Renamed<'_> {
        fn name(&self) -> &str {
            self.0
        }
        fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
            self.1.brdf(angles)
        }
        fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
            self.1.brdf_with_derivative(angles)
        }
    }

    #[test]
    fn a_material_is_known_by_its_digest_or_else_by_its_name() {
        let trained = TrainedOn::of_materials(&Source("procedural:3".into()).load().unwrap());
        let set = Procedural::set(4, 0);
        assert_eq!(trained.knows(&set[2]), Some(Known::Same));
        assert_eq!(trained.knows(&Renamed("x", &set[2])), Some(Known::Same));
        assert_eq!(trained.knows(&set[3]), None);
        let namesake = Renamed(set[1].name(), &set[3]);
        assert_eq!(trained.knows(&namesake), Some(Known::Namesake));
    }
}
