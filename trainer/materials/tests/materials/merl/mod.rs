//! MERL tables: writing, reading, look-ups.

mod damaged;

use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::{Brdf, Coverage, Material};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::folder::{Folder, assert_defect, load};
use crate::{FunctionMaterial, angles, network, with_derivative};

/// Returns the angles of a node in radians. The index along phi_d may exceed 179, which adds half turns.
fn node_angles([h, d, phi]: [usize; 3]) -> [f64; 3] {
    [
        FRAC_PI_2 * (h as f64 / 90.0).powi(2),
        (d as f64).to_radians(),
        (phi as f64).to_radians(),
    ]
}

fn is_valid(point: [f64; 3]) -> bool {
    HalfDifference::from_angles(angles(point)).is_valid()
}

/// Returns the offset of a node's value in the file.
fn offset([h, d, phi]: [usize; 3], channel: usize) -> u64 {
    (12 + 8 * (phi + 180 * (d + 90 * (h + 90 * channel)))) as u64
}

/// A table in a temporary directory.
struct TableFile {
    _folder: Folder,
    path: PathBuf,
}

fn tabulate(material: &dyn Material) -> TableFile {
    let folder = Folder::new();
    let path = folder.write_table("a-table.binary", material);
    TableFile {
        _folder: folder,
        path,
    }
}

impl TableFile {
    fn read(&self) -> Box<dyn Material> {
        load(&self.path).expect("the table is read").remove(0)
    }

    fn open(&self) -> File {
        let file = File::options().write(true).open(&self.path);
        file.expect("the file opens")
    }

    /// Overwrites bytes of the file.
    fn patch(&self, at: u64, bytes: &[u8]) {
        let mut file = self.open();
        file.seek(SeekFrom::Start(at))
            .expect("the file is seekable");
        file.write_all(bytes).expect("the file is written");
    }

    fn set_length(&self, bytes: u64) {
        self.open().set_len(bytes).expect("the length is set");
    }

    /// Asserts that the file is rejected, and that the message contains each of `words`, which are separated by spaces.
    fn assert_rejected(&self, words: &str) {
        assert_defect(&self.path, &self.path, words);
    }
}

/// A strategy for the indices of all nodes.
fn node_indices() -> impl Strategy<Value = [usize; 3]> {
    (0..90usize, 0..90usize, 0..180usize).prop_map(|(h, d, phi)| [h, d, phi])
}

/// Checks a property in 5000 random cases.
fn check_property<S: Strategy>(
    strategy: S,
    property: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let config = ProptestConfig {
        cases: 5000,
        max_global_rejects: 50_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    if let Err(error) = TestRunner::new(config).run(&strategy, property) {
        panic!("{error}");
    }
}

#[test]
fn table_holds_the_tabulated_brdf() {
    let network = network(1);
    let file = tabulate(&network);
    let bytes = fs::read(&file.path).expect("the file is read");
    let table = file.read();
    assert_eq!(table.name(), "a-table");
    check_property((node_indices(), 1..3usize), |(at, half_turns)| {
        let point = node_angles(at);
        prop_assume!(is_valid(point));
        for (channel, expected) in network.at_angles(angles(point)).into_iter().enumerate() {
            let stored = bytes[offset(at, channel) as usize..].first_chunk();
            let scale = [1.0, 1.15, 1.66][channel] / 1500.0;
            let actual = f64::from_le_bytes(*stored.expect("eight bytes")) * scale;
            let tolerance = 2e-6 * f64::from(expected.max(0.1));
            prop_assert!((actual - f64::from(expected)).abs() <= tolerance);
        }
        let turned = [point[0], point[1], point[2] + PI * half_turns as f64];
        // Rounding angles to f32 moves them by up to 7e-6 of a cell, and by more if half turns were added.
        for (point, tolerance) in [(point, 2e-6), (turned, 2e-5)] {
            let (actual, _) = with_derivative(&*table, angles(point));
            prop_assert_eq!(actual, table.at_angles(angles(point)));
            let expected = network.at_angles(angles(node_angles(at)));
            for (actual, expected) in actual.into_iter().zip(expected) {
                prop_assert!((actual - expected).abs() <= tolerance * expected.max(0.1));
            }
        }
        Ok(())
    });
}

/// A strategy for cells with eight measured nodes: the angles of the lower and upper nodes, and angles at random
/// fractions of the way between them.
fn measured_cells(
    fractions: std::ops::Range<f64>,
) -> impl Strategy<Value = ([[f64; 3]; 2], [f64; 3])> {
    // The cell before phi_d = 180 degrees is excluded. A random network has a step there, because it is not reciprocal.
    let cells = (0..89usize, 0..89usize, 0..179usize);
    (cells, prop::array::uniform3(fractions))
        .prop_map(|((h, d, phi), fractions)| {
            let ends = [
                node_angles([h, d, phi]),
                node_angles([h + 1, d + 1, phi + 1]),
            ];
            let [low, high] = ends;
            let point = std::array::from_fn(|i| low[i] + fractions[i] * (high[i] - low[i]));
            (ends, point)
        })
        .prop_filter("all eight nodes are measured", |(ends, _)| {
            (0..8).all(|bits| is_valid(std::array::from_fn(|i| ends[bits >> i & 1][i])))
        })
}

#[test]
fn interpolation_error_is_within_its_bound() {
    // The second derivative with respect to an angle is at most 0.5 FREQUENCY^2.
    const FREQUENCY: [f64; 3] = [5.0, 3.0, 4.0];
    let smooth = FunctionMaterial(|at: Angles<f32>| {
        let point = at.to_array().map(f64::from);
        [0.0, 1.0, 2.0].map(|phase| {
            let waves = (0..3).map(|i| (FREQUENCY[i] * point[i] + phase).sin());
            (1.0 + 0.5 * waves.product::<f64>()) as f32
        })
    });
    let table = tabulate(&smooth).read();
    let largest = Cell::new(0.0_f64);
    check_property(measured_cells(0.0..1.0), |([low, high], point)| {
        // Linear interpolation has an error bound along each angle. This is the sum of the three.
        let bound: f64 = (0..3)
            .map(|i| 0.5 * (FREQUENCY[i] * (high[i] - low[i])).powi(2) / 8.0)
            .sum();
        let actual = table.at_angles(angles(point));
        for (actual, exact) in actual.into_iter().zip(smooth.at_angles(angles(point))) {
            let error = f64::from((actual - exact).abs());
            largest.set(largest.get().max(error / bound));
            prop_assert!(error <= bound + 1e-6, "{error} at {point:?}, above {bound}");
        }
        Ok(())
    });
    let largest = largest.get();
    println!("largest error between nodes: {largest:.2} of the bound");
    assert!(largest > 0.5, "{largest}: the bound is too loose");
}

#[test]
fn fills_unmeasured_nodes_from_their_neighbors() {
    // Linear in the indices of nodes.
    let value = |[h, d, phi]: [usize; 3]| (h + 2 * d + 3 * phi) as f32 / 100.0;
    let linear = FunctionMaterial(|at: Angles<f32>| {
        let h = 90.0 * (f64::from(at.theta_h) / FRAC_PI_2).sqrt();
        let [d, phi] = [at.theta_d, at.phi_d].map(|angle| f64::from(angle).to_degrees());
        let node = [h, d, phi].map(|index| index.round() as usize);
        [1.0, 2.0, 3.0].map(|scale| scale * value(node))
    });
    let file = tabulate(&linear);
    let bytes = fs::read(&file.path).expect("the file is read");
    // Blue was not measured inside of a block, at small theta_h and at large theta_d.
    let (inside, highlight, grazing) = ([25, 30, 90], [0, 35, 90], [20, 70, 90]);
    for (unmeasured_nodes, node, expected) in [
        ([20..30, 20..40, 60..120], inside, value(inside)),
        // Between neighbors on both sides along theta_d. The highlight has measured nodes on one side along theta_h.
        ([0..10, 30..40, 0..180], highlight, value(highlight)),
        ([0..90, 60..90, 0..180], grazing, value([20, 59, 90])),
    ] {
        let is_unmeasured = |at: [usize; 3]| (0..3).all(|i| unmeasured_nodes[i].contains(&at[i]));
        let mut bytes = bytes.clone();
        let (mut unmeasured, mut all) = (0, 0);
        for index in 0..90 * 90 * 180 {
            let at = [index / 180 / 90, index / 180 % 90, index % 180];
            if is_valid(node_angles(at)) {
                all += 1;
                unmeasured += u32::from(is_unmeasured(at));
            }
            if is_unmeasured(at) {
                // The values of the other channels are ignored.
                for (channel, value) in [(0, 1e6_f64), (2, -1.0)] {
                    let offset = offset(at, channel) as usize;
                    bytes[offset..offset + 8].copy_from_slice(&value.to_le_bytes());
                }
            }
        }
        fs::write(&file.path, bytes).expect("the file is written");
        let table = file.read();
        let share = f64::from(unmeasured) / f64::from(all);
        assert_eq!(table.coverage(), Coverage::Filled { share });
        let (brdf, derivative) = with_derivative(&*table, angles(node_angles(node)));
        for (brdf, scale) in brdf.into_iter().zip([1.0, 2.0, 3.0]) {
            let expected = scale * expected;
            assert!(
                (brdf - expected).abs() < 1e-4 * expected,
                "{brdf}, expected {expected}"
            );
        }
        assert!(
            derivative
                .as_flattened()
                .iter()
                .all(|value| value.is_finite())
        );
    }
}

#[test]
fn zero_is_measured_and_values_that_become_invalid_are_excluded() {
    let file = tabulate(&FunctionMaterial(|_| [0.0, 0.0, 0.5]));
    let table = file.read();
    assert_eq!(table.coverage(), Coverage::Complete);
    let (cell, center) = ([20, 30, 40], [0.079, 0.53, 0.71]);
    assert_eq!(table.at_angles(angles(center)), [0.0, 0.0, 0.5]);
    // Another program changes the file after the table was opened.
    let invalid = [-1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 3.5e38];
    for (bits, value) in (0..8).zip(invalid.iter().cycle()) {
        let corner = std::array::from_fn(|i| cell[i] + (bits >> i & 1));
        file.patch(offset(corner, 2), &value.to_le_bytes());
    }
    assert_eq!(
        with_derivative(&*table, angles(center)),
        ([0.0; 3], [[0.0; 3]; 3])
    );
}

#[test]
fn lookups_clamp_theta_and_wrap_phi() {
    let table = tabulate(&network(4)).read();
    let brdf_at = |point| table.at_angles(angles(point));
    let [theta_h, theta_d, _] = node_angles([89, 89, 0]);
    // The last nodes of theta_h and theta_d are below pi/2.
    assert_eq!(
        brdf_at([FRAC_PI_2, 0.0, 0.0]),
        brdf_at([theta_h + 1e-6, 0.0, 0.0])
    );
    assert_eq!(
        brdf_at([0.0, FRAC_PI_2, 1.0]),
        brdf_at([0.0, theta_d + 1e-6, 1.0])
    );
    let (_, derivative) = with_derivative(&*table, angles([0.0, 1.56, 1.0]));
    assert!(
        derivative.iter().all(|channel| channel[1] == 0.0),
        "{derivative:?}"
    );
    // Between the last and the first node of phi_d.
    let [last, middle, first] =
        [179.0, 179.5, 180.0].map(|phi: f64| brdf_at([0.3, 0.6, phi.to_radians()]));
    for channel in 0..3 {
        let mean = 0.5 * (last[channel] + first[channel]);
        assert!((middle[channel] - mean).abs() < 1e-5 * mean);
    }
    assert_eq!(brdf_at([0.3, 0.6, 0.0]), brdf_at([0.3, 0.6, -1e-30]));
    // No node is measured below the horizon.
    assert_eq!(brdf_at([1.5, 1.5, 0.0]), [0.0; 3]);
}

#[test]
fn negative_values_are_written_as_0() {
    let file = tabulate(&FunctionMaterial(|_| [-0.5, 0.5, -0.0]));
    assert_eq!(
        file.read().at_angles(angles([0.3, 0.3, 0.3])),
        [0.0, 0.5, 0.0]
    );
}
