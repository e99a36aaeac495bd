//! A basis of one component, cut, extended and with other numbers here and there: it is refused, or written
//! again byte by byte, and finite.

use glimpse_materials::basis::{BASIS_MAGIC, Basis, Grid};

use crate::{Damage, Folder, PLACES, refused};

/// Numbers of a node: mean, ln(median w + e), and a component.
const NODE: [f32; 3] = [0.5, -3.0, 0.01];

/// As its format says, for the library makes one of materials alone.
fn valid() -> Vec<u8> {
    let [h, d, p] = Grid::SHAPE;
    let header = [u32::from_le_bytes(BASIS_MAGIC), 1, h, d, p, 1];
    let table = [NODE.map(f32::to_bits); Grid::LEN];
    let words = header.iter().chain(table.as_flattened());
    words.flat_map(|word| word.to_le_bytes()).collect()
}

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some(damage) = Damage::of(input) else {
        return;
    };
    let mut bytes = valid();
    damage.apply(&mut bytes);
    let folder = Folder::new();
    let path = folder.write("felt.basis", &bytes);
    // As a recipe would name it: a file with another checksum is refused before it is looked at.
    let basis = match Basis::read(&path, Basis::checksum(&bytes)) {
        Ok(basis) => basis,
        Err(error) => return refused(&error, "felt.basis"),
    };
    assert_eq!(basis.to_bytes(), bytes);
    let reconstruction = basis.reconstruct_values(&[0.5; 3]).expect("three of one");
    for at in PLACES {
        let _ = reconstruction.brdf(&at, 0.5);
        let _ = reconstruction.brdf_with_derivative(&at);
        let tabulated = basis.look_up(glimpse_materials::basis::widened(&at));
        assert!(tabulated.mean[0].is_finite());
    }
}
