//! The files of a basis, for the host and for a device: their loss compared with the table of the training, their
//! derivatives and contents, and errors of files.

use std::fs;
use std::sync::LazyLock;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{self, EPSILON};
use glimpse_fitting::linear::{COMPACT_NODES, ComponentsAt, to_compact_bytes, to_host_bytes};
use glimpse_materials::Brdf;
use glimpse_materials::basis::{BasisError, BasisTable};
use glimpse_materials::sampling::uniform_valid;

use super::{MATERIALS, basis};

/// The compact basis of the bundled recipes.
const BUNDLED: &[u8] = include_bytes!("../../../../recipes/linear.basis24");
const COMPONENTS: usize = 8;
/// The number of bytes of a compact basis before its nodes.
const HEADER_BYTES: usize = 14 + 16 + 4 * COMPONENTS;
/// The number of bytes of a node.
const NODE_BYTES: usize = 4 + COMPONENTS;

static TABLE: LazyLock<BasisTable> = LazyLock::new(|| basis(COMPONENTS));
static COMPACT: LazyLock<Vec<u8>> =
    LazyLock::new(|| to_compact_bytes(&TABLE, COMPONENTS, COMPACT_NODES));
static HOST: LazyLock<Vec<u8>> = LazyLock::new(|| to_host_bytes(&TABLE));

/// Fits coefficients to a material measured at many directions. Returns those of red, then of green, then of blue.
fn coefficients(material: usize) -> Vec<f32> {
    let angles = uniform_valid(2000, 5);
    let material = &MATERIALS.materials[material];
    let measured: Vec<[f32; 3]> = angles
        .iter()
        .map(|angles| material.at_angles(*angles))
        .collect();
    let precision = [4.0; COMPONENTS];
    ComponentsAt::new(&TABLE, angles).fit(&precision, &measured)
}

/// Returns the mean absolute difference of ln(f w + e) between the table and a file.
fn loss(file: &[u8], material: usize) -> f64 {
    let file = linear::Basis::parse(file).expect("the bytes are a basis");
    let values = coefficients(material);
    let mut channels = values.chunks(COMPONENTS);
    let channels = [(); 3].map(|()| channels.next().expect("three channels"));
    let at: Vec<HalfDifference<f32>> = uniform_valid(4000, 6)
        .into_iter()
        .map(HalfDifference::from_angles)
        .collect();
    let table = TABLE.reconstruct(&values).expect("3 m values");
    let expected = table.values_at(&at);
    let mut sum = 0.0;
    for (at, expected) in at.iter().zip(&expected) {
        let actual = file.brdf(channels, at).expect("the directions are valid");
        let weight = f64::from(at.cos_theta_i() * at.cos_theta_o());
        let logarithm = |f: f32| (f64::from(f) * weight + EPSILON).ln();
        for (actual, expected) in actual.into_iter().zip(expected) {
            sum += (logarithm(actual) - logarithm(*expected)).abs();
        }
    }
    sum / (3 * at.len()) as f64
}

#[test]
fn files_approximate_table() {
    for (file, scale) in [(&COMPACT, 1.0), (&HOST, 0.7)] {
        let count = MATERIALS.materials.len();
        let losses: Vec<f64> = (0..count).map(|index| loss(file, index)).collect();
        // Every other material is a network with random weights, which is rougher than real materials.
        for (material, loss) in losses.iter().enumerate() {
            let bound = if material % 2 == 0 { 0.08 } else { 0.02 };
            assert!(*loss < scale * bound, "material {material}: {losses:?}");
        }
    }
}

/// Asserts that host and device compute the same BRDF from a compact basis.
fn assert_host_matches_device(compact: &[u8], values: &[f32]) {
    let device = linear::Basis::parse(compact).expect("the bytes are a basis");
    let basis = BasisTable::parse(compact).expect("the bytes are a basis");
    let mut channels = values.chunks(basis.components());
    let channels = [(); 3].map(|()| channels.next().expect("three channels"));
    let host = basis.reconstruct(values).expect("3 m values");
    for angles in uniform_valid(2000, 8) {
        let at = HalfDifference::from_angles(angles);
        let weight = f64::from(at.cos_theta_i()) * f64::from(at.cos_theta_o());
        let expected = device
            .brdf(channels, &at)
            .expect("the directions are valid");
        let actual = host.brdf(&angles, weight);
        for (actual, expected) in actual.into_iter().zip(expected) {
            // The mapping is ln(1 + f w / e), so the error is relative to f + e / w.
            let error = (actual - expected).abs() / (expected + (EPSILON / weight) as f32);
            assert!(error < 1e-4, "{actual} instead of {expected} at {angles:?}");
        }
    }
}

/// Tests a basis and the trained one of 24 components, with coefficients that decrease like those of materials.
#[test]
fn host_evaluates_compact_basis_like_device() {
    assert_host_matches_device(&COMPACT, &coefficients(2));
    let components = BasisTable::parse(BUNDLED)
        .expect("the bytes are a basis")
        .components();
    assert_eq!(components, 24);
    let values = (0..3 * components).map(|index| {
        let component = index % components;
        (1.7 * index as f32).sin() / (1.0 + component as f32)
    });
    assert_host_matches_device(BUNDLED, &values.collect::<Vec<_>>());
}

/// Tests that the integral of the derivatives along a line equals the difference of the values at its ends.
#[test]
fn compact_basis_derivatives_integrate_to_differences() {
    let basis = BasisTable::parse(&COMPACT).expect("the bytes are a basis");
    let host = basis.reconstruct(&coefficients(2)).expect("3 m values");
    let [from, to] = [[0.1_f32, 0.2, 0.4], [0.5, 0.6, 1.9]];
    let position = |fraction: f32| {
        let between = |axis| from[axis] + fraction * (to[axis] - from[axis]);
        Angles::from_array(std::array::from_fn(between))
    };
    const STEPS: u32 = 2_000;
    let mut sum = [0.0; 3];
    for step in 0..STEPS {
        let middle = position((step as f32 + 0.5) / STEPS as f32);
        let brdf = host.brdf_with_derivative(&middle);
        for (sum, channel) in sum.iter_mut().zip(brdf) {
            for (axis, slope) in channel.tangent.into_iter().enumerate() {
                *sum += slope * f64::from(to[axis] - from[axis]) / f64::from(STEPS);
            }
        }
    }
    let brdf = |fraction| {
        host.brdf_with_derivative(&position(fraction))
            .map(|channel| channel.value)
    };
    for ((before, after), sum) in brdf(0.0).into_iter().zip(brdf(1.0)).zip(sum) {
        let change = after - before;
        assert!(
            (sum - change).abs() < 0.01 * change.abs(),
            "{sum}, {change}"
        );
    }
}

#[test]
fn compact_basis_has_requested_shape() {
    let compact = linear::Basis::parse(&COMPACT).expect("the bytes are a basis");
    assert_eq!(compact.components(), COMPONENTS);
    assert_eq!(compact.nodes(), COMPACT_NODES);
    for count in [0, COMPONENTS, 3 * COMPONENTS - 1] {
        assert_eq!(TABLE.reconstruct(&vec![0.0; count]), None);
    }
    // 24 components must fit into 600 KiB.
    let nodes = COMPACT_NODES.count().expect("the nodes are valid");
    assert!(14 + 16 + 4 * 24 + nodes * (4 + 24) <= 600 * 1024);
    // The number of components is limited to that of the table.
    assert_eq!(
        to_compact_bytes(&TABLE, COMPONENTS + 1, COMPACT_NODES),
        *COMPACT
    );
}

#[test]
fn file_is_read_by_the_checksum_of_its_table() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("some.basis");
    let checksum = TABLE.checksum();
    for bytes in [&HOST, &COMPACT] {
        fs::write(&path, &**bytes).expect("the file is written");
        let read = BasisTable::read(&path, checksum).expect("the file is a basis");
        assert_eq!((read.file(), read.checksum()), (&bytes[..], checksum));
        assert_eq!(read.components(), COMPONENTS);
    }
    // A compact basis of a host's file belongs to the same recipes.
    let host = BasisTable::parse(&HOST).expect("the bytes are a basis");
    let compact = to_compact_bytes(&host, 3, COMPACT_NODES);
    assert!(BasisTable::parse_for(&compact, checksum).is_ok_and(|basis| basis.components() == 3));

    let mut damaged = HOST.clone();
    damaged[1000] ^= 1;
    for (bytes, checksum) in [
        (&*HOST, checksum ^ 1),
        (&damaged, checksum),
        (&HOST[..1000].to_vec(), checksum),
        (&Vec::new(), checksum),
    ] {
        fs::write(&path, bytes).expect("the file is written");
        let error = BasisTable::read(&path, checksum).expect_err("the file is invalid");
        assert!(matches!(&error, BasisError::Damaged { path: at, .. } if *at == path));
    }
    for path in [scratch.path().join("none.basis"), scratch.path().into()] {
        let error = BasisTable::read(&path, checksum).expect_err("the path is not a file");
        assert!(matches!(&error, BasisError::Read { path: at, .. } if *at == path));
    }
}

/// Tests that all nodes along phi_d have equal bytes if theta_h or theta_d is 0, because phi_d then has no effect.
#[test]
fn nodes_at_poles_are_equal_for_all_phi_d() {
    let [theta_d_nodes, phi_d_nodes] =
        [COMPACT_NODES.theta_d, COMPACT_NODES.phi_d].map(usize::from);
    let mut different = 0;
    let rows = COMPACT[HEADER_BYTES..].chunks(phi_d_nodes * NODE_BYTES);
    for (index, row) in rows.enumerate() {
        let same = row
            .chunks(NODE_BYTES)
            .all(|node| node == &row[..NODE_BYTES]);
        if index < theta_d_nodes || index % theta_d_nodes == 0 {
            assert!(same, "row {index}");
        } else {
            different += usize::from(!same);
        }
    }
    assert!(different > 500, "{different}");
}
