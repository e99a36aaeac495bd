//! MERL tables: written, read back, looked up.

mod damaged;
mod many;

use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::{Material, MerlTable, write_merl};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::common::assert_names;
use crate::folder::{Folder, damage};
use crate::{Made, angles, network};

/// The angles of a node; of phi_d's there may be more than 180.
fn node([h, d, phi]: [usize; 3]) -> [f64; 3] {
    [
        FRAC_PI_2 * (h as f64 / 90.0).powi(2),
        (d as f64).to_radians(),
        (phi as f64).to_radians(),
    ]
}

fn is_valid(place: [f64; 3]) -> bool {
    HalfDifference::from_angles(angles(place)).is_valid()
}

/// Where in the file the value of a node is.
fn offset([h, d, phi]: [usize; 3], channel: usize) -> u64 {
    (12 + 8 * (phi + 180 * (d + 90 * (h + 90 * channel)))) as u64
}

/// A table on disk, for as long as it is held.
struct Tabulated {
    _folder: Folder,
    path: PathBuf,
}

fn tabulate(material: &dyn Material) -> Tabulated {
    let folder = Folder::new();
    let path = folder.at("a-table.binary");
    write_merl(&path, material).expect("the table is written");
    Tabulated {
        _folder: folder,
        path,
    }
}

impl Tabulated {
    fn read(&self) -> MerlTable {
        MerlTable::read(&self.path).expect("the table is read")
    }

    fn open(&self) -> File {
        let file = File::options().write(true).open(&self.path);
        file.expect("the file opens")
    }

    /// Overwrites bytes of the file.
    fn patch(&self, at: u64, bytes: &[u8]) {
        let mut file = self.open();
        file.seek(SeekFrom::Start(at)).expect("it can be sought in");
        file.write_all(bytes).expect("it can be written to");
    }

    fn set_length(&self, bytes: u64) {
        self.open().set_len(bytes).expect("its length can be set");
    }

    /// Asserts that the file is refused by its path, and that the message names these.
    fn assert_refused(&self, named: &[&str]) {
        match damage(MerlTable::read(&self.path), &self.path) {
            Some(what) => assert_names(&what, named),
            None => panic!("the damaged table was read: {named:?}"),
        }
    }
}

/// Any node.
fn nodes() -> impl Strategy<Value = [usize; 3]> {
    (0..90usize, 0..90usize, 0..180usize).prop_map(|(h, d, phi)| [h, d, phi])
}

/// Runs a property many times.
fn always<S: Strategy>(strategy: S, property: impl Fn(S::Value) -> Result<(), TestCaseError>) {
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
fn a_table_reads_back_what_was_tabulated() {
    let network = network(1);
    let table = tabulate(&network).read();
    assert_eq!(table.name(), "a-table");
    always((nodes(), 1..3usize), |(at, turns)| {
        let place = node(at);
        prop_assume!(is_valid(place));
        let turned = [place[0], place[1], place[2] + PI * turns as f64];
        // The angle is rounded to f32, which is up to 7e-6 of a cell, and more after turning.
        for (place, tolerance) in [(place, 2e-6), (turned, 2e-5)] {
            let found = table.brdf(angles(place));
            let expected = network.brdf(angles(node(at)));
            for (found, expected) in found.into_iter().zip(expected) {
                prop_assert!((found - expected).abs() <= tolerance * expected.max(0.1));
            }
        }
        Ok(())
    });
}

/// A random place in a cell that is measured all around: its nodes' angles and the place.
fn measured_cells(
    shares: std::ops::Range<f64>,
) -> impl Strategy<Value = ([[f64; 3]; 2], [f64; 3])> {
    // Not around phi_d = 180 degrees: a random network is not reciprocal, so it has a step there.
    let cells = (0..89usize, 0..89usize, 0..179usize);
    (cells, prop::array::uniform3(shares))
        .prop_map(|((h, d, phi), shares)| {
            let ends = [node([h, d, phi]), node([h + 1, d + 1, phi + 1])];
            let [low, high] = ends;
            let place = std::array::from_fn(|i| low[i] + shares[i] * (high[i] - low[i]));
            (ends, place)
        })
        .prop_filter("measured all around", |(ends, _)| {
            (0..8).all(|bits| is_valid(std::array::from_fn(|i| ends[bits >> i & 1][i])))
        })
}

#[test]
fn between_nodes_the_error_is_that_of_linear_interpolation() {
    // Its second derivatives by the angles are at most 0.5 FREQUENCY^2.
    const FREQUENCY: [f64; 3] = [5.0, 3.0, 4.0];
    let smooth = Made(|at: Angles<f32>| {
        let place = [at.theta_h, at.theta_d, at.phi_d].map(f64::from);
        [0.0, 1.0, 2.0].map(|phase| {
            let waves = (0..3).map(|i| (FREQUENCY[i] * place[i] + phase).sin());
            (1.0 + 0.5 * waves.product::<f64>()) as f32
        })
    });
    let table = tabulate(&smooth).read();
    let largest = Cell::new(0.0_f64);
    always(measured_cells(0.0..1.0), |([low, high], place)| {
        // The remainder of linear interpolation, for each angle in turn.
        let bound: f64 = (0..3)
            .map(|i| 0.5 * (FREQUENCY[i] * (high[i] - low[i])).powi(2) / 8.0)
            .sum();
        let found = table.brdf(angles(place));
        for (found, exact) in found.into_iter().zip(smooth.brdf(angles(place))) {
            let error = f64::from((found - exact).abs());
            largest.set(largest.get().max(error / bound));
            prop_assert!(error <= bound + 1e-6, "{error} at {place:?}, above {bound}");
        }
        Ok(())
    });
    let largest = largest.get();
    println!("largest error between nodes: {largest:.2} of the bound");
    assert!(largest > 0.5, "{largest}: the bound is idle");
}

#[test]
fn between_nodes_a_network_s_table_is_close_to_the_network() {
    let network = network(2);
    let table = tabulate(&network).read();
    let (largest, sum, count) = (Cell::new(0.0_f32), Cell::new(0.0_f32), Cell::new(0.0_f32));
    always(measured_cells(0.0..1.0), |(_, place)| {
        let found = table.brdf(angles(place));
        for (found, exact) in found.into_iter().zip(network.brdf(angles(place))) {
            let error = (found - exact).abs() / exact;
            largest.set(largest.get().max(error));
            sum.set(sum.get() + error);
            count.set(count.get() + 1.0);
        }
        Ok(())
    });
    let (largest, mean) = (largest.get(), sum.get() / count.get());
    println!("relative error between nodes: mean {mean:.1e}, largest {largest:.1e}");
    assert!(
        mean < 2e-4 && largest < 1e-2,
        "mean {mean}, largest {largest}"
    );
}

#[test]
fn derivatives_are_those_of_the_interpolant() {
    let table = tabulate(&network(3)).read();
    let largest = Cell::new(0.0_f64);
    always(measured_cells(0.3..0.7), |([low, high], place)| {
        let (brdf, derivative) = table.brdf_with_derivative(angles(place));
        prop_assert_eq!(brdf, table.brdf(angles(place)));
        for i in 0..3 {
            // Inside of a cell the interpolant is linear in each angle: no step is too wide.
            let step = 0.25 * (high[i] - low[i]);
            let at = |step: f64| {
                let mut place = place;
                place[i] += step;
                let rounded = angles(place);
                let rounded = [rounded.theta_h, rounded.theta_d, rounded.phi_d][i];
                (f64::from(rounded), table.brdf(angles(place)))
            };
            let ((before, lower), (after, upper)) = (at(-step), at(step));
            for channel in 0..3 {
                let rise = f64::from(upper[channel]) - f64::from(lower[channel]);
                let error = (rise / (after - before) - f64::from(derivative[channel][i])).abs();
                // Values are rounded to f32; angles have been, and exactly so above.
                let rounding = f64::from(brdf[channel]) * 1.2e-7 / (after - before);
                largest.set(largest.get().max(error / rounding));
                prop_assert!(
                    error <= 2.0 * rounding,
                    "{error} above {rounding} by angle {i}"
                );
            }
        }
        Ok(())
    });
    println!(
        "largest error of a derivative: {:.2} roundings",
        largest.get()
    );
}

#[test]
fn nodes_that_were_not_measured_are_left_out() {
    // Each channel is a number of its own, plus the node's place in its cell.
    let linear = Made(|at: Angles<f32>| {
        [1.0, 2.0, 3.0].map(|base| base + at.theta_h + 2.0 * at.theta_d + 3.0 * at.phi_d)
    });
    let tabulated = tabulate(&linear);
    let cell = [20, 30, 40];
    let (low, high) = (node(cell), node(cell.map(|k| k + 1)));
    let center: [f64; 3] = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
    let corners: Vec<[usize; 3]> = (0..8)
        .map(|bits| std::array::from_fn(|i| cell[i] + (bits >> i & 1)))
        .collect();
    let values: Vec<[f32; 3]> = corners
        .iter()
        .map(|at| linear.brdf(angles(node(*at))))
        .collect();
    let mean = |left: &[usize], channel: usize| {
        let kept: Vec<f32> = (0..8)
            .filter(|i| !left.contains(i))
            .map(|i| values[i][channel])
            .collect();
        kept.iter().sum::<f32>() / kept.len() as f32
    };
    let assert_close = |found: f32, expected: f32| {
        assert!(
            (found - expected).abs() < 1e-5,
            "{found} instead of {expected}"
        );
    };

    // Two corners less in green only: the others count for more there, and nowhere else.
    for corner in [1, 6] {
        tabulated.patch(offset(corners[corner], 1), &(-1.0_f64).to_le_bytes());
    }
    let table = tabulated.read();
    let (found, derivative) = table.brdf_with_derivative(angles(center));
    assert_close(found[0], mean(&[], 0));
    assert_close(found[1], mean(&[1, 6], 1));
    assert_close(found[2], mean(&[], 2));
    for i in 0..3 {
        let step = 2e-3 * if i == 0 { 1.0 } else { 2.0 };
        let at = |step: f64| {
            let mut place = center;
            place[i] += step;
            table.brdf(angles(place))[1]
        };
        let difference = (at(step) - at(-step)) / (2.0 * step as f32);
        assert!(
            (difference - derivative[1][i]).abs() < 2e-2,
            "{difference} and {derivative:?}"
        );
    }

    // None at all in blue: 0, and flat.
    for corner in &corners {
        tabulated.patch(offset(*corner, 2), &(-1.0_f64).to_le_bytes());
    }
    let (found, derivative) = tabulated.read().brdf_with_derivative(angles(center));
    assert_close(found[0], mean(&[], 0));
    assert_eq!(found[2], 0.0);
    assert_eq!(derivative[2], [0.0; 3]);
}

#[test]
fn look_ups_stay_at_the_upper_ends_and_wrap_around() {
    let table = tabulate(&network(4)).read();
    let at = |place| table.brdf(angles(place));
    let [theta_h, theta_d, _] = node([89, 89, 0]);
    // The last nodes are before the ends of theta_h and theta_d.
    assert_eq!(at([FRAC_PI_2, 0.0, 0.0]), at([theta_h + 1e-6, 0.0, 0.0]));
    assert_eq!(at([0.0, FRAC_PI_2, 1.0]), at([0.0, theta_d + 1e-6, 1.0]));
    let (_, derivative) = table.brdf_with_derivative(angles([0.0, 1.56, 1.0]));
    assert!(derivative.iter().all(|by| by[1] == 0.0), "{derivative:?}");
    // Between the last node of phi_d and the first one.
    let [last, middle, first] =
        [179.0, 179.5, 180.0].map(|phi: f64| at([0.3, 0.6, phi.to_radians()]));
    for channel in 0..3 {
        let mean = 0.5 * (last[channel] + first[channel]);
        assert!((middle[channel] - mean).abs() < 1e-5 * mean);
    }
    assert_eq!(at([0.3, 0.6, 0.0]), at([0.3, 0.6, -1e-30]));
    // Below the horizon nothing is measured.
    assert_eq!(at([1.5, 1.5, 0.0]), [0.0; 3]);
}

#[test]
fn negative_values_are_written_as_0() {
    let tabulated = tabulate(&Made(|_| [-0.5, 0.5, -0.0]));
    assert_eq!(
        tabulated.read().brdf(angles([0.3, 0.3, 0.3])),
        [0.0, 0.5, 0.0]
    );
}
