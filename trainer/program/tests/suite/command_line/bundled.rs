//! A recipe that is trained as in `recipes/train.sh` has the loss of the bundled one.

use glimpse_fitting::bundled;
use glimpse_fitting::recipe::{Metadata, RecipeFile};

use super::Folder;

#[test]
fn retrained_recipe_has_loss_of_bundled_one() {
    let folder = Folder::new();
    folder.succeed(
        "train --model phong --samples 1 --effort standard --data procedural:400 --noise 0.02 \
         --min-separation 10 --max-theta-i 80 --max-theta-o 80 --out retrained.recipe",
    );
    let retrained = RecipeFile::read(&folder.at("retrained.recipe")).expect("a valid recipe");
    let bundled = bundled::find("phong-n1").expect("a bundled recipe");
    let bundled = RecipeFile::new(bundled.bytes.to_vec()).expect("a valid recipe");
    let [retrained_fit, bundled_fit] = [&retrained, &bundled]
        .map(|file| file.with_metadata(&Metadata::default()).expect("a copy"));
    // Processors and C libraries round differently, and training amplifies that.
    assert_eq!(retrained_fit.bytes().len(), bundled_fit.bytes().len());
    let loss = |file: &RecipeFile| {
        let expected = file.metadata().expected_loss.as_ref();
        f64::from(expected.expect("an expected loss").estimate.loss)
    };
    let ratio = loss(&retrained) / loss(&bundled);
    assert!((0.99..=1.01).contains(&ratio), "{ratio}");
    // Bundled recipes may lack the names of their materials.
    let without_names = |file: &RecipeFile| Metadata {
        materials: Vec::new(),
        expected_loss: None,
        ..file.metadata().clone()
    };
    assert_eq!(without_names(&retrained), without_names(&bundled));
}
