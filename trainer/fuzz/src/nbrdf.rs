//! Check of a neural BRDF's six arrays, five of them valid: the reader rejects a network, or a copy that is
//! written has the same bits.
//!
//! An input contains a byte and the file of one array. The byte modulo 6 selects the array.

use std::sync::LazyLock;

use glimpse_core::model::{NeuralParameters, ParameterSet};
use glimpse_materials::{Material, NeuralBrdf, Source, to_nbrdf};

use crate::{ANGLES, Folder, check_rejection};

static VALID_ARRAYS: LazyLock<[(String, Vec<u8>); 6]> =
    LazyLock::new(|| to_nbrdf(&NeuralParameters::filled(0.1)));

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some((array_index, bytes)) = input.split_first() else {
        return;
    };
    let folder = Folder::new();
    for (index, (suffix, valid_bytes)) in VALID_ARRAYS.iter().enumerate() {
        let bytes = match usize::from(*array_index) % 6 == index {
            true => bytes,
            false => &valid_bytes[..],
        };
        folder.write(&format!("input{suffix}"), bytes);
    }
    let path = folder.path().join("input_b2.npy");
    let network = match NeuralBrdf::read(&path) {
        Ok(network) => network,
        Err(error) => return check_rejection(&error, "input_"),
    };
    assert!(network.parameters().iter().all(|weight| weight.is_finite()));
    for angles in ANGLES {
        network.brdf(angles);
        network.brdf_with_derivative(angles);
    }
    for (suffix, bytes) in to_nbrdf(network.parameters()) {
        folder.write(&format!("input{suffix}"), &bytes);
    }
    let reread = NeuralBrdf::read(&path).expect("a written file is valid");
    let bits = |network: &NeuralBrdf| -> Vec<u32> {
        network
            .parameters()
            .iter()
            .map(|weight| weight.to_bits())
            .collect()
    };
    assert_eq!(bits(&reread), bits(&network));
    let source = Source(folder.path().display().to_string());
    assert_eq!(source.load().expect("the folder has a material").len(), 1);
}
