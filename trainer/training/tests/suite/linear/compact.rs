//! The compact basis: what it loses, and what it holds exactly.

use std::sync::LazyLock;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{self, EPSILON};
use glimpse_materials::Brdf;
use glimpse_materials::basis::{Basis, CoefficientCountError, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_training::linear::{COMPACT_NODES, ReducedBasis, to_compact_bytes};

use super::{SET, basis};

/// The compact basis of the bundled recipes.
const BASIS: &[u8] = include_bytes!("../../../../recipes/linear.basis24");
const COMPONENTS: usize = 8;
/// Bytes of a compact basis before its nodes.
const HEAD: usize = 14 + 16 + 4 * COMPONENTS;
const NODE: usize = 4 + COMPONENTS;

static WHOLE: LazyLock<Basis> = LazyLock::new(|| basis(COMPONENTS));
static COMPACT: LazyLock<Vec<u8>> =
    LazyLock::new(|| to_compact_bytes(&WHOLE, COMPONENTS, COMPACT_NODES));

/// The coefficients of a material that was measured at many directions, m for each channel.
fn coefficients(material: usize) -> Vec<f32> {
    let angles = uniform_valid(2000, 5);
    let places: Vec<Angles<f64>> = angles.iter().map(angles_to_f64).collect();
    let material = &SET.materials[material];
    let measured: Vec<[f32; 3]> = angles.iter().map(|angles| material.brdf(*angles)).collect();
    let found = ReducedBasis::new(&WHOLE, &places)
        .fit(&[4.0; COMPONENTS], &measured)
        .expect("there is a solution");
    found.iter().flatten().map(|value| *value as f32).collect()
}

/// The mean difference of ln(f w + e) between the whole basis and a compact one.
fn loss(compact: &[u8], material: usize) -> f64 {
    let compact = linear::Basis::parse(compact).expect("it is a basis");
    let values = coefficients(material);
    let mut channels = values.chunks(COMPONENTS);
    let channels = [(); 3].map(|()| channels.next().expect("three channels"));
    let at: Vec<HalfDifference<f32>> = uniform_valid(4000, 6)
        .into_iter()
        .map(HalfDifference::from_angles)
        .collect();
    let mut expected = vec![[0.0; 3]; at.len()];
    let whole = WHOLE.reconstruct_values(&values).expect("3 m values");
    whole.evaluate(&at, &mut expected);
    let mut sum = 0.0;
    for (at, expected) in at.iter().zip(&expected) {
        let found = compact.brdf(channels, at).expect("a BRDF");
        let weight = f64::from(at.cos_theta_i() * at.cos_theta_o());
        let logarithm = |f: f32| (f64::from(f) * weight + EPSILON).ln();
        for (found, expected) in found.into_iter().zip(expected) {
            sum += (logarithm(found) - logarithm(*expected)).abs();
        }
    }
    sum / (3 * at.len()) as f64
}

#[test]
fn a_compact_basis_says_what_the_whole_one_says() {
    let count = SET.materials.len();
    let losses: Vec<f64> = (0..count).map(|index| loss(&COMPACT, index)).collect();
    println!("{losses:.4?}");
    // Every other one is a network of random weights, rougher than any material.
    for (material, loss) in losses.iter().enumerate() {
        let bound = if material % 2 == 0 { 0.08 } else { 0.02 };
        assert!(*loss < bound, "material {material}: {losses:?}");
    }
}

/// The host looks a compact basis up as a device does: the same BRDF of these values.
fn assert_looked_up_alike(compact: &[u8], values: &[f32]) {
    let device = linear::Basis::parse(compact).expect("it is a basis");
    let basis = Basis::from_compact_bytes(compact).expect("it is a basis");
    let mut channels = values.chunks(basis.components());
    let channels = [(); 3].map(|()| channels.next().expect("three channels"));
    let host = basis.reconstruct_values(values).expect("3 m values");
    for angles in uniform_valid(2000, 8) {
        let at = HalfDifference::from_angles(angles);
        let weight = f64::from(at.cos_theta_i()) * f64::from(at.cos_theta_o());
        let expected = device.brdf(channels, &at).expect("a BRDF");
        let found = host.brdf(&angles, weight);
        for (found, expected) in found.into_iter().zip(expected) {
            // Relative to what the logarithm sees.
            let error = (found - expected).abs() / (expected + (EPSILON / weight) as f32);
            assert!(error < 1e-4, "{found}, {expected} at {angles:?}");
        }
    }
}

#[test]
fn a_compact_basis_is_looked_up_as_on_a_device() {
    assert_looked_up_alike(&COMPACT, &coefficients(2));
}

/// Of 24 components, and trained: the first ones count for most, as those of a material do.
#[test]
fn the_basis_that_comes_along_is_looked_up_as_on_a_device() {
    let components = Basis::from_compact_bytes(BASIS)
        .expect("it is a basis")
        .components();
    assert_eq!(components, 24);
    let values = (0..3 * components).map(|index| {
        let component = index % components;
        (1.7 * index as f32).sin() / (1.0 + component as f32)
    });
    assert_looked_up_alike(BASIS, &values.collect::<Vec<_>>());
}

/// Its slopes add up to what changes on the way.
#[test]
fn slopes_over_a_compact_basis_add_up() {
    let basis = Basis::from_compact_bytes(&COMPACT).expect("it is a basis");
    assert_eq!(basis.to_bytes(), *COMPACT);
    assert_eq!(basis.whole_checksum(), WHOLE.whole_checksum());
    let host = basis
        .reconstruct_values(&coefficients(2))
        .expect("3 m values");
    let [from, to] = [[0.1, 0.2, 0.4], [0.5, 0.6, 1.9]];
    let place = |share: f32| {
        let [theta_h, theta_d, phi_d] =
            std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]));
        Angles {
            theta_h,
            theta_d,
            phi_d,
        }
    };
    const STEPS: u32 = 2_000;
    let mut sum = [0.0; 3];
    for step in 0..STEPS {
        let middle = place((step as f32 + 0.5) / STEPS as f32);
        let found = host.brdf_with_derivative(&middle);
        for (sum, found) in sum.iter_mut().zip(found) {
            for (axis, slope) in found.tangent.into_iter().enumerate() {
                *sum += slope * f64::from(to[axis] - from[axis]) / f64::from(STEPS);
            }
        }
    }
    let brdf = |share| {
        host.brdf_with_derivative(&place(share))
            .map(|found| found.value)
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
fn left_out_components_are_missed() {
    let fewer = to_compact_bytes(&WHOLE, 2, COMPACT_NODES);
    assert_eq!(
        linear::Basis::parse(&fewer).map(|basis| basis.components()),
        Ok(2)
    );
    let sum = |compact: &[u8]| {
        (0..SET.materials.len())
            .map(|index| loss(compact, index))
            .sum::<f64>()
    };
    let (few, all) = (sum(&fewer), sum(&COMPACT));
    assert!(few > 2.0 * all, "{few} and {all}");
}

#[test]
fn it_names_the_whole_basis_and_its_own_shape() {
    let compact = linear::Basis::parse(&COMPACT).expect("it is a basis");
    assert_eq!(compact.of(), Basis::checksum(&WHOLE.to_bytes()));
    assert_eq!(compact.components(), COMPONENTS);
    assert_eq!(compact.nodes(), COMPACT_NODES);
    let nodes = COMPACT_NODES.count().expect("some");
    assert_eq!(COMPACT.len(), HEAD + nodes * NODE);
    // 24 components have to fit into 600 KiB.
    assert!(14 + 16 + 4 * 24 + nodes * (4 + 24) <= 600 * 1024);
    // No more components than there are.
    let all = linear::Basis::parse(&COMPACT).map(|basis| basis.components());
    assert_eq!(all, Ok(WHOLE.components()));
}

/// Where phi_d means nothing, nodes that differ in it only have the same bytes.
#[test]
fn an_azimuth_at_a_pole_does_not_matter() {
    let [rows, columns] = [COMPACT_NODES.theta_d, COMPACT_NODES.phi_d].map(usize::from);
    let mut different = 0;
    for (index, run) in COMPACT[HEAD..].chunks(columns * NODE).enumerate() {
        let same = run.chunks(NODE).all(|node| node == &run[..NODE]);
        if index < rows || index % rows == 0 {
            assert!(same, "run {index}");
        } else {
            different += usize::from(!same);
        }
    }
    assert!(different > 500, "{different}");
}

#[test]
fn a_device_s_values_are_three_runs() {
    let values = coefficients(1);
    let channel = |index: usize| {
        let run = &values[COMPONENTS * index..][..COMPONENTS];
        run.iter().copied().map(f64::from).collect()
    };
    let expected = WHOLE.reconstruct(&[channel(0), channel(1), channel(2)]);
    assert_eq!(WHOLE.reconstruct_values(&values), Ok(expected));
    for count in [0, COMPONENTS, 3 * COMPONENTS - 1] {
        let error = CoefficientCountError {
            expected: 3 * COMPONENTS,
            found: count,
        };
        assert_eq!(WHOLE.reconstruct_values(&values[..count]), Err(error));
    }
}
