//! One of a network's six arrays, the others being right: it is refused, or written again to the bit.

use std::sync::LazyLock;

use glimpse_core::model::{NeuralParameters, ParameterSet};
use glimpse_materials::{Material, NeuralBrdf, Source, to_nbrdf};

use crate::{Folder, PLACES, refused};

static VALID: LazyLock<[(String, Vec<u8>); 6]> =
    LazyLock::new(|| to_nbrdf(&NeuralParameters::filled(0.1)));

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some((which, bytes)) = input.split_first() else {
        return;
    };
    let folder = Folder::new();
    for (index, (ending, valid)) in VALID.iter().enumerate() {
        let bytes = match usize::from(*which) % 6 == index {
            true => bytes,
            false => &valid[..],
        };
        folder.write(&format!("felt{ending}"), bytes);
    }
    let path = folder.path().join("felt_b2.npy");
    let network = match NeuralBrdf::read(&path) {
        Ok(network) => network,
        Err(error) => return refused(&error, "felt_"),
    };
    assert!(network.parameters().iter().all(|weight| weight.is_finite()));
    for at in PLACES {
        network.brdf(at);
        network.brdf_with_derivative(at);
    }
    for (ending, bytes) in to_nbrdf(network.parameters()) {
        folder.write(&format!("felt{ending}"), &bytes);
    }
    let again = NeuralBrdf::read(&path).expect("what is written is read");
    let bits = |network: &NeuralBrdf| -> Vec<u32> {
        network
            .parameters()
            .iter()
            .map(|weight| weight.to_bits())
            .collect()
    };
    assert_eq!(bits(&again), bits(&network));
    let source = Source(folder.path().display().to_string());
    assert_eq!(source.load().expect("it is found").len(), 1);
}
