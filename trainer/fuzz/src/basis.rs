//! Check of damaged bases with one component: the reader rejects a basis, or returns finite values and writes the same
//! bytes.

use glimpse_materials::basis::{BASIS_MAGIC, Basis, Grid};

use crate::{ANGLES, Damage, Folder, check_rejection};

/// The values of every node: mean, ln(median w + e), and one component.
const NODE_VALUES: [f32; 3] = [0.5, -3.0, 0.01];

/// Returns a valid basis, encoded by hand, because the library only computes bases from materials.
fn valid_basis() -> Vec<u8> {
    let [h, d, p] = Grid::SHAPE;
    let header = [u32::from_le_bytes(BASIS_MAGIC), 1, h, d, p, 1];
    let table = [NODE_VALUES.map(f32::to_bits); Grid::LEN];
    let words = header.iter().chain(table.as_flattened());
    words.flat_map(|word| word.to_le_bytes()).collect()
}

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some(damage) = Damage::from_input(input) else {
        return;
    };
    let mut bytes = valid_basis();
    damage.apply(&mut bytes);
    let folder = Folder::new();
    let path = folder.write("input.basis", &bytes);
    // Expects the checksum of the damaged file, because the reader rejects any other before it parses the file.
    let basis = match Basis::read(&path, Basis::checksum(&bytes)) {
        Ok(basis) => basis,
        Err(error) => return check_rejection(&error, "input.basis"),
    };
    assert_eq!(basis.to_bytes(), bytes);
    let reconstruction = basis
        .reconstruct_values(&[0.5; 3])
        .expect("one component for three channels");
    for angles in ANGLES {
        let _ = reconstruction.brdf(&angles, 0.5);
        let _ = reconstruction.brdf_with_derivative(&angles);
        let tabulated = basis.look_up(glimpse_materials::basis::angles_to_f64(&angles));
        assert!(tabulated.mean[0].is_finite());
    }
}
