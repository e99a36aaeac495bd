//! Compact bases on the command line: one file for recipes of every n.

use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;

use super::folder::PHONG_N8;
use super::shared::{LINEAR_N2, LINEAR_N4};
use super::{Folder, number};

const TEST: &str = "procedural:1:9";

fn export(recipe: &str, out: &str) -> String {
    format!("export {recipe} --format basis --out {out}")
}

fn loss(folder: &Folder, options: &str) -> f64 {
    let report = folder.succeed_as_json(&format!("evaluate --test {TEST} --recipe {options}"));
    number(&report["loss"])
}

/// Asserts that the loss of a recipe with a compact basis is almost that with the host's.
fn assert_compact_basis_is_accurate(folder: &Folder, basis: &str, recipe: &str) {
    let host = loss(folder, recipe);
    let compact = loss(folder, &format!("{recipe} --basis {basis}"));
    assert!(
        compact != host && (compact - host).abs() < 0.1 * host,
        "{compact}, {host}"
    );
}

#[test]
fn compact_basis_is_valid_for_every_n() {
    let folder = Folder::new();
    LINEAR_N2.copy_to(folder.path());
    LINEAR_N4.copy_to(folder.path());
    folder.succeed(&export("linear-n2.recipe", "compact.basis"));
    folder.succeed(&export("linear-n4.recipe", "again.basis"));
    let compact = folder.read("compact.basis");
    assert_eq!(compact, folder.read("again.basis"));
    let basis = Basis::parse(&compact).expect("a valid basis");
    for name in ["linear-n2.recipe", "linear-n4.recipe"] {
        let bytes = folder.read(name);
        let recipe = Recipe::parse(&bytes).expect("a valid recipe");
        assert_eq!(recipe.basis_checksum(), Some(basis.checksum()));
        assert!(3 * basis.components() <= recipe.values());
        assert_compact_basis_is_accurate(&folder, "compact.basis", name);
    }

    // With schedule prior, coefficients have another scale and another basis.
    folder.succeed(
        "train --model linear --samples 3 --data procedural:6 --effort brief --out prior.recipe",
    );
    let over = export("prior.recipe", "again.basis");
    folder.fail_naming(&over, &["again.basis", "--force"]);
    assert_eq!(folder.read("again.basis"), compact);
    folder.succeed(&export("prior.recipe", "compact-prior.basis"));
    assert_compact_basis_is_accurate(&folder, "compact-prior.basis", "prior.recipe");

    // --components limits the number of components.
    let fewer = export("linear-n2.recipe", "fewer.basis");
    folder.succeed(&format!("{fewer} --components 3"));
    let bytes = folder.read("fewer.basis");
    assert_eq!(Basis::parse(&bytes).map(|basis| basis.components()), Ok(3));

    let mut damaged = compact;
    damaged[100] ^= 1;
    folder.write("damaged.basis", damaged);
    // A basis of another training, a damaged basis, and invalid options.
    folder.fail_each(
        &format!("evaluate --test {TEST} --recipe"),
        &[
            "prior.recipe --basis compact.basis => ",
            "linear-n2.recipe --basis damaged.basis => damaged.basis",
        ],
    );
    folder.fail_each(
        "export linear-n2.recipe --out x --format",
        &[
            "basis --components 0 => --components",
            "basis --components 999 => --components",
            "json --components 3 => --components --format basis",
        ],
    );
    folder.write("phong.recipe", PHONG_N8);
    folder.fail_naming(&export("phong.recipe", "x"), &["linear"]);
    assert!(!folder.exists("x"));
}
