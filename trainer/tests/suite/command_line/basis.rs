//! The compact basis at the command line: one file for recipes of every n.

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
    let judged = folder.succeed_as_json(&format!("evaluate --test {TEST} --recipe {options}"));
    number(&judged["loss"])
}

/// Asserts that a recipe fits with a compact basis almost as with the whole one.
fn assert_serves(folder: &Folder, basis: &str, recipe: &str) {
    let whole = loss(folder, recipe);
    let compact = loss(folder, &format!("{recipe} --basis {basis}"));
    println!("{recipe}: {whole:.5} by the whole basis, {compact:.5} by the compact one");
    assert!(
        compact != whole && (compact - whole).abs() < 0.1 * whole,
        "{compact}, {whole}"
    );
}

#[test]
fn one_compact_basis_serves_every_n() {
    let folder = Folder::new();
    LINEAR_N2.copy_to(folder.path());
    LINEAR_N4.copy_to(folder.path());
    folder.succeed(&export("linear-n2.recipe", "compact.basis"));
    folder.succeed(&export("linear-n4.recipe", "again.basis"));
    let compact = folder.read("compact.basis");
    assert_eq!(compact, folder.read("again.basis"));
    let basis = Basis::parse(&compact).expect("it is a basis");
    for name in ["linear-n2.recipe", "linear-n4.recipe"] {
        let bytes = folder.read(name);
        let recipe = Recipe::parse(&bytes).expect("it is a recipe");
        let ridge = recipe.ridge().expect("it is Linear");
        assert_eq!(ridge.basis_checksum(), Some(basis.of()));
        assert!(basis.components() <= ridge.components());
        assert_serves(&folder, "compact.basis", name);
    }

    // By schedule prior coefficients are of another scale: the basis is another one, for every n too.
    for (samples, out) in [(2, "p2.recipe"), (3, "p3.recipe")] {
        folder.succeed(&format!(
            "train --model linear --schedule prior --samples {samples} --data procedural:6 \
             --effort brief --out {out}"
        ));
    }
    folder.succeed(&export("p2.recipe", "prior.basis"));
    let over = export("p3.recipe", "again.basis");
    folder.fail_naming(&over, &["again.basis", "--force"]);
    assert_eq!(folder.read("again.basis"), compact);
    folder.succeed(&export("p3.recipe", "prior-again.basis"));
    assert_eq!(folder.read("prior.basis"), folder.read("prior-again.basis"));
    assert_serves(&folder, "prior.basis", "p3.recipe");

    // Fewer components, when asked for.
    let fewer = export("linear-n2.recipe", "fewer.basis");
    folder.succeed(&format!("{fewer} --components 3"));
    let bytes = folder.read("fewer.basis");
    assert_eq!(Basis::parse(&bytes).map(|basis| basis.components()), Ok(3));

    // Another seed shuffles the materials, and has a basis of its own.
    folder.succeed(
        "train --model linear --schedule joint --samples 2 --data procedural:6 --effort brief \
         --seed 1 --out other.recipe",
    );
    let mut damaged = compact;
    damaged[100] ^= 1;
    folder.write("damaged.basis", damaged);
    // A basis of other materials, a damaged one, and options without effect or sense.
    let other = format!("evaluate --recipe other.recipe --basis compact.basis --test {TEST}");
    let damaged = format!("evaluate --recipe linear-n2.recipe --basis damaged.basis --test {TEST}");
    let export = "export linear-n2.recipe --out x";
    for (command, named) in [
        (&other, &[][..]),
        (&damaged, &["damaged.basis"]),
        (
            &format!("{export} --format basis --components 0"),
            &["--components"],
        ),
        (
            &format!("{export} --format basis --components 999"),
            &["--components"],
        ),
        (
            &format!("{export} --format json --components 3"),
            &["--components", "--format", "basis"],
        ),
    ] {
        folder.fail_naming(command, named);
    }
    assert!(!folder.exists("x"));
}

#[test]
fn a_compact_basis_is_for_linear() {
    let folder = Folder::with("phong.recipe", PHONG_N8);
    folder.fail_naming(&export("phong.recipe", "x"), &["linear"]);
    assert!(!folder.exists("x"));
    let random =
        "evaluate --method random --model linear --samples 2 --basis x --test procedural:1:9";
    folder.fail_naming(random, &["--recipe"]);
}
