//! Reciprocity and energy of each model's fits, and of the tables that are exported from them.

use clap::ValueEnum;
use glimpse_evaluation::conversion::{OutputFormat, encode};
use glimpse_evaluation::evaluation::Method;
use glimpse_fitting::bundled;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::{FittedBrdf, FittedMaterial, Format, Material, PhysicalErrors, Source};
use rayon::prelude::*;

/// Returns the fit of a bundled recipe to a material.
fn fit(recipe: &str, material: &dyn Material) -> FittedMaterial {
    let bundled = bundled::find(recipe).expect("a bundled recipe");
    let basis = bundled.basis().map(BasisTable::parse);
    let basis = basis.transpose().expect("a valid basis");
    let method = Method::with_recipe(&bundled.recipe(), basis.as_ref());
    let method = method.expect("a method");
    let values = method.fit(material, 0).expect("a fit").values;
    let fitted = FittedBrdf::new(method.model, values, basis.as_ref()).expect("a BRDF");
    FittedMaterial::new(recipe.to_owned(), fitted).expect("finite values")
}

/// Returns the physical errors of a table that is written and read again.
fn errors_of_table(
    material: &dyn Material,
    format: OutputFormat,
    as_fitted: bool,
) -> PhysicalErrors {
    let encoded = encode(material, format, "m", 0, as_fitted).expect("a table");
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in &encoded.files {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let first = folder.path().join(&encoded.files[0].0);
    let source = Source(first.display().to_string());
    let read = source.load().expect("a readable table");
    PhysicalErrors::of(&*read[0])
}

#[test]
fn tables_of_fits_are_reciprocal_and_conserve_energy() {
    let materials = Source("procedural:12:4242".to_owned())
        .load()
        .expect("materials");
    for recipe in ["linear-n4", "phong-n4", "cook-torrance-n4", "neural-n4"] {
        // The fits that break the laws most, and their errors.
        let fits = materials.par_iter().map(|material| {
            let fit = fit(recipe, &**material);
            let errors = PhysicalErrors::of(&fit as &dyn Material);
            (fit, errors)
        });
        let fits: Vec<_> = fits.collect();
        let [reciprocity, albedo] = [
            |errors: &PhysicalErrors| errors.reciprocity,
            |errors: &PhysicalErrors| errors.albedo,
        ]
        .map(|error| {
            fits.iter()
                .max_by(|(_, one), (_, other)| error(one).total_cmp(&error(other)))
                .expect("a fit")
        });
        assert_eq!(
            reciprocity.1.reciprocity > 0.01,
            recipe.starts_with("neural"),
            "{recipe}"
        );
        for (fit, before) in [reciprocity, albedo] {
            for &format in OutputFormat::value_variants() {
                if !format.is_table() {
                    continue;
                }
                let after = errors_of_table(fit, format, false);
                assert!(
                    after.albedo <= 1.0,
                    "{recipe} {format:?}: {before:?}, {after:?}"
                );
                // Interpolation between nodes; PAB-Opto's files and OpenMATERIAL's have few light directions, the same ones.
                let limit = match format {
                    OutputFormat::Brdf(Format::Pab | Format::OpenMaterial) => 0.3,
                    _ => 0.02,
                };
                assert!(
                    after.reciprocity < limit,
                    "{recipe} {format:?}: {before:?}, {after:?}"
                );
            }
        }
    }
}
