//! `material.json`: it is refused, or written again with the same values.

use std::collections::BTreeMap;

use glimpse_materials::{FittedMaterial, Material, Source};

use crate::{Folder, PLACES, refused};

const NAME: &str = "material.json";

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write(NAME, bytes);
    let material = match FittedMaterial::read(&path) {
        Ok(material) => material,
        Err(error) => return refused(&error, NAME),
    };
    assert!(
        material
            .fitted()
            .values()
            .iter()
            .all(|value| value.is_finite())
    );
    for at in PLACES {
        material.brdf(at);
        material.brdf_with_derivative(at);
    }
    let nothing = BTreeMap::<&str, &str>::new();
    let text = material.to_json(None, nothing).expect("it is JSON");
    folder.write(NAME, text.as_bytes());
    let again = FittedMaterial::read(&path).expect("what is written is read");
    let bits = |material: &FittedMaterial| -> Vec<u32> {
        material
            .fitted()
            .values()
            .iter()
            .map(|value| value.to_bits())
            .collect()
    };
    assert_eq!(bits(&again), bits(&material));
    assert_eq!(
        (again.name(), again.fitted().model()),
        (material.name(), material.fitted().model())
    );
    let source = Source(folder.path().display().to_string());
    assert_eq!(source.load().expect("it is found").len(), 1);
}
