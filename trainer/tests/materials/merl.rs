//! MERL tables: written, read back, looked up, and damaged in every way.

use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_trainer::material::{
    Material, MerlTable, Source, SourceError, WHOLLY_CHECKED, write_merl,
};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use tempfile::TempDir;

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
    _directory: TempDir,
    path: PathBuf,
}

fn tabulate(material: &dyn Material) -> Tabulated {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("a-table.binary");
    write_merl(&path, material).expect("the table is written");
    Tabulated {
        _directory: directory,
        path,
    }
}

impl Tabulated {
    fn read(&self) -> MerlTable {
        MerlTable::read(&self.path).expect("the table is read")
    }

    /// Overwrites bytes of the file.
    fn patch(&self, at: u64, bytes: &[u8]) {
        let mut file = OpenOptions::new()
            .write(true)
            .open(&self.path)
            .expect("the file opens");
        file.seek(SeekFrom::Start(at)).expect("it can be sought in");
        file.write_all(bytes).expect("it can be written to");
    }

    fn set_length(&self, bytes: u64) {
        let file = OpenOptions::new()
            .write(true)
            .open(&self.path)
            .expect("the file opens");
        file.set_len(bytes).expect("its length can be set");
    }

    /// What is said of the file.
    fn complaint(&self) -> String {
        match MerlTable::read(&self.path) {
            Ok(_) => panic!("the damaged table was read"),
            Err(error) => error.to_string(),
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
    let centre: [f64; 3] = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
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
    let (found, derivative) = table.brdf_with_derivative(angles(centre));
    assert_close(found[0], mean(&[], 0));
    assert_close(found[1], mean(&[1, 6], 1));
    assert_close(found[2], mean(&[], 2));
    for i in 0..3 {
        let step = 2e-3 * if i == 0 { 1.0 } else { 2.0 };
        let at = |step: f64| {
            let mut place = centre;
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
    let (found, derivative) = tabulated.read().brdf_with_derivative(angles(centre));
    assert_close(found[0], mean(&[], 0));
    assert_eq!(found[2], 0.0);
    assert_eq!(derivative[2], [0.0; 3]);
}

#[test]
fn values_that_are_no_finite_floats_count_as_not_measured_if_they_come_after_opening() {
    let tabulated = tabulate(&network(6));
    let table = tabulated.read();
    let cell = [20, 30, 40];
    let (low, high) = (node(cell), node(cell.map(|k| k + 1)));
    let place = std::array::from_fn(|i| low[i] + 0.4 * (high[i] - low[i]));
    let whole = table.brdf(angles(place));
    // One corner in red, all of them in blue.
    let corners = (0..8).map(|bits| std::array::from_fn(|i| cell[i] + (bits >> i & 1)));
    let damage = |value: f64| {
        tabulated.patch(offset(cell, 0), &value.to_le_bytes());
        for corner in corners.clone() {
            tabulated.patch(offset(corner, 2), &value.to_le_bytes());
        }
        table.brdf_with_derivative(angles(place))
    };
    let not_measured = damage(-1.0);
    assert_ne!(not_measured.0[0], whole[0]);
    assert_eq!(not_measured.0[1..], [whole[1], 0.0]);
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 3.5e38, -1e300] {
        assert_eq!(damage(value), not_measured, "{value}");
    }
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
fn damaged_tables_are_refused_by_name() {
    let tabulated = tabulate(&network(5));
    let path = tabulated.path.display().to_string();
    let whole = 34_992_012;
    assert_eq!(
        fs::metadata(&tabulated.path).expect("it is there").len(),
        whole
    );
    tabulated.read();

    for (at, number, described) in [
        (0, f64::NAN, "value 0 is NaN"),
        (11 * 262_144, f64::INFINITY, "value 2883584 is inf"),
        (16 * 262_144, f64::NEG_INFINITY, "value 4194304 is -inf"),
    ] {
        let place = 12 + 8 * at;
        tabulated.patch(place, &number.to_le_bytes());
        let expected = format!("{path}: {described}, which is no BRDF; get the file again");
        assert_eq!(tabulated.complaint(), expected);
        tabulated.patch(place, &1.0_f64.to_le_bytes());
    }
    // A single one is found wherever it is, and so is what no f32 holds.
    for at in [0, 1, 1_000_000, 3 * 1_458_000 - 1] {
        for (number, described) in [
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
            (3.5e38, "3.5e38"),
            (-1e300, "-1e300"),
        ] {
            tabulated.patch(12 + 8 * at, &number.to_le_bytes());
            let expected =
                format!("{path}: value {at} is {described}, which is no BRDF; get the file again");
            assert_eq!(tabulated.complaint(), expected);
        }
        tabulated.patch(12 + 8 * at, &0_f64.to_le_bytes());
    }
    tabulated.read();
    // A colour of which nothing was measured.
    for (plane, colour) in [(2, "blue"), (0, "red")] {
        let place = 12 + 8 * plane * 1_458_000;
        tabulated.patch(place, &(-1.0_f64).to_le_bytes().repeat(1_458_000));
        let expected = format!(
            "{path}: none of its {colour} values was measured: all are negative; get the file again"
        );
        assert_eq!(tabulated.complaint(), expected);
    }
    for plane in [0, 2] {
        tabulated.patch(12 + 8 * plane * 1_458_000, &[0; 8 * 1_458_000]);
    }
    tabulated.read();

    // Whatever the header says, nothing is allocated on its word.
    for dimensions in [[90, 90, 360], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
        tabulated.patch(0, &dimensions.map(i32::to_le_bytes).concat());
        let expected = format!(
            "{path}: its header gives the dimensions {dimensions:?} where a MERL table has \
             [90, 90, 180]; only isotropic materials of that size are read; take it away"
        );
        assert_eq!(tabulated.complaint(), expected);
    }
    tabulated.patch(0, &[90, 90, 180].map(i32::to_le_bytes).concat());
    tabulated.read();

    for (length, complaint) in [
        (whole + 1, "something was appended"),
        (2 * whole, "something was appended"),
        (whole - 1, "it was cut short"),
        (12, "it was cut short"),
    ] {
        tabulated.set_length(length);
        let expected = format!(
            "{path}: {complaint}: it has {length} bytes where a MERL table has {whole}; get it again"
        );
        assert_eq!(tabulated.complaint(), expected);
    }
    for length in [11, 0] {
        tabulated.set_length(length);
        let expected = format!(
            "{path}: it has {length} bytes, too few even for a MERL table's header; get it again"
        );
        assert_eq!(tabulated.complaint(), expected);
    }

    fs::remove_file(&tabulated.path).expect("it can be removed");
    assert!(matches!(
        MerlTable::read(&tabulated.path),
        Err(SourceError::Read { .. })
    ));
}

#[test]
fn what_cannot_be_tabulated_leaves_the_old_file_alone() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("old.binary");
    File::create(&path)
        .and_then(|mut file| file.write_all(b"old"))
        .expect("it is written");
    for number in [f32::NAN, f32::INFINITY] {
        let error = write_merl(&path, &Made(|_| [0.1, number, 0.1])).expect_err("not finite");
        let expected = format!(
            "cannot write {}: the BRDF is {number} at theta_h 0.00, theta_d 0.00 and phi_d 0.00 \
             degrees, and only a finite one can be written; fit it again, or from other readings",
            path.display()
        );
        assert_eq!(error.to_string(), expected);
        assert_eq!(fs::read(&path).expect("it is still there"), b"old");
    }
    let nowhere = path.join("new.binary");
    let error = write_merl(&nowhere, &Made(|_| [0.1; 3])).expect_err("a file is no directory");
    assert!(matches!(error, SourceError::Write { .. }), "{error}");
    let names = fs::read_dir(directory.path()).expect("it can be listed");
    assert_eq!(names.count(), 1, "something was left behind");
}

#[test]
fn negative_values_are_written_as_0() {
    let tabulated = tabulate(&Made(|_| [-0.5, 0.5, -0.0]));
    assert_eq!(
        tabulated.read().brdf(angles([0.3, 0.3, 0.3])),
        [0.0, 0.5, 0.0]
    );
}

/// One of many tables keeps little of its file in memory, and is looked up as any other.
#[test]
fn a_table_that_lets_go_of_its_pages_has_the_same_values() {
    let tabulated = tabulate(&network(1));
    let whole = tabulated.read();
    let one_of_many = MerlTable::open(&tabulated.path).expect("the table is opened");
    for angles in glimpse_trainer::sampling::uniform_valid(1_000, 7) {
        let (found, expected) = (one_of_many.brdf(angles), whole.brdf(angles));
        assert_eq!(found, expected);
        let [found, expected] =
            [&one_of_many, &whole].map(|each| each.brdf_with_derivative(angles));
        assert_eq!(found, expected);
    }
    whole.release();
    let angles = angles([0.3, 0.4, 0.5]);
    assert_eq!(whole.brdf(angles), one_of_many.brdf(angles));
}

/// A value that is no number is an error in a small set; in a large one, where it is not looked for, it
/// counts as not measured. A file that was cut is an error in both.
#[test]
fn many_tables_are_opened_and_not_read_from_end_to_end() {
    let tabulated = tabulate(&network(2));
    let sound = tabulated.read();
    let (at, channel) = ([20, 30, 40], 1);
    tabulated.patch(offset(at, channel), &f64::NAN.to_le_bytes());
    assert!(tabulated.complaint().contains("no BRDF"));
    let folder = tempfile::tempdir().expect("a temporary directory");
    let source = Source(folder.path().display().to_string());
    for number in 0..=WHOLLY_CHECKED {
        // The last one makes them many.
        if number == WHOLLY_CHECKED {
            let error = source.load().err().expect("a value is no number");
            assert!(error.to_string().contains("no BRDF"), "{error}");
        }
        let path = folder.path().join(format!("m{number}.binary"));
        fs::hard_link(&tabulated.path, path).expect("it is linked");
    }
    let materials = source.load().expect("they are opened");
    assert_eq!(materials.len(), WHOLLY_CHECKED + 1);
    assert_eq!(source.count().expect("they are counted"), materials.len());
    let near = angles(node(at));
    let (found, expected) = (materials[0].brdf(near), sound.brdf(near));
    assert!(found.iter().all(|value| value.is_finite()), "{found:?}");
    assert_eq!((found[0], found[2]), (expected[0], expected[2]));

    tabulated.set_length(1_000);
    let error = source.load().err().expect("it is cut");
    assert!(error.to_string().contains("cut short"), "{error}");
}
