//! Check of `material.json`: the reader rejects a file, or a copy that is written has the same values.

use std::collections::BTreeMap;

use glimpse_materials::{FittedMaterial, Material, Source};

use crate::{ANGLES, Folder, check_rejection};

const NAME: &str = "material.json";

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write(NAME, bytes);
    let material = match FittedMaterial::read(&path) {
        Ok(material) => material,
        Err(error) => return check_rejection(&error, NAME),
    };
    assert!(
        material
            .fitted()
            .values()
            .iter()
            .all(|value| value.is_finite())
    );
    for angles in ANGLES {
        material.brdf(angles);
        material.brdf_with_derivative(angles);
    }
    let no_metadata = BTreeMap::<&str, &str>::new();
    let text = material.to_json(None, no_metadata).expect("valid JSON");
    folder.write(NAME, text.as_bytes());
    let reread = FittedMaterial::read(&path).expect("a written file is valid");
    let bits = |material: &FittedMaterial| -> Vec<u32> {
        material
            .fitted()
            .values()
            .iter()
            .map(|value| value.to_bits())
            .collect()
    };
    assert_eq!(bits(&reread), bits(&material));
    assert_eq!(
        (reread.name(), reread.fitted().model()),
        (material.name(), material.fitted().model())
    );
    let source = Source(folder.path().display().to_string());
    assert_eq!(source.load().expect("the folder has a material").len(), 1);
}
