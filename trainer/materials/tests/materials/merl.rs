//! MERL tables: writing, reading, look-ups, and damaged ones.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, Coverage, Material, MerlTable, Procedural, table_nodes};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::assert_names;
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

/// Returns the indices of 5,000 random nodes that meet a condition, each with three random fractions.
fn random_nodes(
    counts: [usize; 3],
    condition: impl Fn([usize; 3]) -> bool,
) -> impl Iterator<Item = ([usize; 3], [f64; 3])> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let nodes = std::iter::repeat_with(move || {
        let node = counts.map(|count| random.random_range(0..count));
        (node, [(); 3].map(|()| random.random_range(0.0..1.0)))
    });
    nodes.filter(move |(node, _)| condition(*node)).take(5_000)
}

#[test]
fn table_holds_the_tabulated_brdf() {
    let network = network(1);
    let file = tabulate(&network);
    let bytes = fs::read(&file.path).expect("the file is read");
    let table = file.read();
    assert_eq!(table.name(), "a-table");
    let is_measured = |at| is_valid(node_angles(at));
    for (at, [fraction, ..]) in random_nodes([90, 90, 180], is_measured) {
        let point = node_angles(at);
        let expected = network.at_angles(angles(point));
        for (channel, expected) in expected.into_iter().enumerate() {
            let stored = bytes[offset(at, channel) as usize..].first_chunk();
            let scale = [1.0, 1.15, 1.66][channel] / 1500.0;
            let actual = f64::from_le_bytes(*stored.expect("eight bytes")) * scale;
            let tolerance = 2e-6 * f64::from(expected.max(0.1));
            assert!((actual - f64::from(expected)).abs() <= tolerance, "{at:?}");
        }
        let half_turns = if fraction < 0.5 { 1.0 } else { 2.0 };
        let turned = [point[0], point[1], point[2] + PI * half_turns];
        // Rounding angles to f32 moves them by up to 7e-6 of a cell, and by more if half turns were added.
        for (point, tolerance) in [(point, 2e-6), (turned, 2e-5)] {
            let (actual, _) = with_derivative(&*table, angles(point));
            assert_eq!(actual, table.at_angles(angles(point)));
            for (actual, expected) in actual.into_iter().zip(expected) {
                assert!(
                    (actual - expected).abs() <= tolerance * expected.max(0.1),
                    "{at:?}"
                );
            }
        }
    }
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
    let mut largest = 0.0_f64;
    let is_measured = |[h, d, phi]: [usize; 3]| {
        let corners = (0..8).map(|bits| [h + bits % 2, d + bits / 2 % 2, phi + bits / 4]);
        corners.map(node_angles).all(is_valid)
    };
    // The cell before phi_d = 180 degrees is excluded. The BRDF has a step there, because it is not reciprocal.
    for ([h, d, phi], fractions) in random_nodes([89, 89, 179], is_measured) {
        let [low, high] = [[h, d, phi], [h + 1, d + 1, phi + 1]].map(node_angles);
        let size: [f64; 3] = std::array::from_fn(|i| high[i] - low[i]);
        let point = angles(std::array::from_fn(|i| low[i] + fractions[i] * size[i]));
        // Linear interpolation has an error bound along each angle. This is the sum of the three.
        let bounds = (0..3).map(|i| 0.5 * (FREQUENCY[i] * size[i]).powi(2) / 8.0);
        let bound: f64 = bounds.sum();
        let actual = table.at_angles(point);
        for (actual, exact) in actual.into_iter().zip(smooth.at_angles(point)) {
            let error = f64::from((actual - exact).abs());
            largest = largest.max(error / bound);
            assert!(error <= bound + 1e-6, "{error} at {point:?}, above {bound}");
        }
    }
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
fn table_from_nodes_equals_the_written_table() {
    let material = &Procedural::set(1, 7)[0];
    let nodes = table_nodes().into_iter();
    let brdf: Vec<[f32; 3]> = nodes.map(|angles| material.at_angles(angles)).collect();
    let table = MerlTable::from_nodes("a".into(), &brdf).expect("complete values");
    let copy = MerlTable::from_nodes("a".into(), &table.to_nodes()).expect("valid values");
    let written = tabulate(material).read();
    assert_eq!(table.name(), "a");
    for angles in uniform_valid(2_000, 3) {
        let expected = written.at_angles(angles);
        assert_eq!(
            [&table, &copy].map(|table| table.at_angles(angles)),
            [expected; 2]
        );
    }
}

#[test]
fn table_from_nodes_excludes_unknown_values_and_rejects_invalid_ones() {
    let nodes = table_nodes();
    let mut brdf = vec![[0.5, 0.25, 0.125]; nodes.len()];
    brdf[0] = [f32::NAN; 3];
    let table = MerlTable::from_nodes("a".into(), &brdf).expect("one unknown node");
    let rgb = table.at_angles(angles([0.0, 0.005, 0.1]));
    assert!((rgb[0] - 0.5).abs() < 1e-6 && (rgb[2] - 0.125).abs() < 1e-6);

    let assert_rejected = |brdf: &[[f32; 3]], words: &[&str]| {
        let error = MerlTable::from_nodes("a".into(), brdf).err();
        assert_names(&error.expect("invalid values").to_string(), words);
    };
    assert_rejected(&brdf[1..], &[&(nodes.len() - 1).to_string()]);
    for invalid in [f32::INFINITY, -1.0, -1e-9] {
        brdf[3][1] = invalid;
        let theta_d = format!("{:.3}", nodes[3].theta_d.to_degrees());
        assert_rejected(&brdf, &["3", &invalid.to_string(), "green", &theta_d]);
    }
    brdf.fill([f32::NAN, 1.0, 1.0]);
    assert_rejected(&brdf, &["100.0 %"]);
}

/// The number of nodes of a table.
const NODES: usize = 90 * 90 * 180;

#[test]
fn rejects_damaged_tables() {
    let file = tabulate(&network(5));
    file.read();
    let header = |dimensions: [i32; 3]| dimensions.map(i32::to_le_bytes).concat();
    let value = |number: f64| number.to_le_bytes().to_vec();
    let unmeasured = value(-1.0).repeat(NODES);
    // A single invalid value is found at every position, including values outside the range of f32. No allocation depends
    // on sizes in the header.
    for (at, bytes, words) in [
        (12, value(f64::NAN), "red phi_d 0 NaN"),
        (20, value(f64::INFINITY), "red phi_d 1 inf"),
        (28, value(f64::NEG_INFINITY), "red phi_d 2 -inf"),
        (
            12 + 8 * (NODES + 180 * (90 * 45 + 20) + 7),
            value(3.5e38),
            "green theta_h 22.500 theta_d 20 phi_d 7 3.5e38",
        ),
        (
            4 + 24 * NODES,
            value(-1e300),
            "blue theta_d 89 phi_d 179 -1e300",
        ),
        // No node was measured in a channel.
        (12, unmeasured.clone(), "100.0 % 50 %"),
        (12 + 16 * NODES, unmeasured, "100.0 % 50 %"),
    ] {
        let valid = fs::read(&file.path).expect("the file is read")[at..][..bytes.len()].to_vec();
        file.patch(at as u64, &bytes);
        file.assert_rejected(words);
        file.patch(at as u64, &valid);
    }
    file.read();
    // Longer files first, because truncation removes the values.
    let valid_length = 12 + 24 * NODES as i64;
    for change in [valid_length, 1, -1, -8, 12 - valid_length] {
        let length = (valid_length + change) as u64;
        file.set_length(length);
        file.assert_rejected(&format!("{length} {valid_length}"));
    }
    for dimensions in [[90, 90, 90], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
        file.patch(0, &header(dimensions));
        let start = header(dimensions).escape_ascii().to_string();
        file.assert_rejected(&start);
    }
}

fn encoded<const N: usize>(values: &[f64], bytes: fn(f64) -> [u8; N]) -> Vec<u8> {
    values.iter().copied().flat_map(bytes).collect()
}

/// Writes the values of a file in another form: single precision, or both halves of phi_d.
#[test]
fn other_forms_are_read_like_the_standard_one() {
    let network = network(5);
    let file = tabulate(&network);
    let bytes = fs::read(&file.path).expect("the file is read");
    let values: Vec<f64> = bytes[12..]
        .as_chunks()
        .0
        .iter()
        .map(|bytes| f64::from_le_bytes(*bytes))
        .collect();
    // The table is mapped, so that it is read before the file changes.
    let brdf = |table: &dyn Material| -> Vec<[f32; 3]> {
        uniform_valid(500, 3)
            .into_iter()
            .map(|angles| table.at_angles(angles))
            .collect()
    };
    let expected = brdf(&*file.read());
    let halves: Vec<f64> = values
        .chunks(180)
        .flat_map(|half| [half, half].concat())
        .collect();
    let single = |values: &[f64]| encoded(values, |value| (value as f32).to_le_bytes());
    let double = |values: &[f64]| encoded(values, f64::to_le_bytes);
    let header = |phi: i32| [90, 90, phi].map(i32::to_le_bytes).concat();
    for (phi, values) in [
        (180, single(&values)),
        (360, double(&halves)),
        (360, single(&halves)),
    ] {
        fs::write(&file.path, [header(phi), values].concat()).expect("the file is written");
        let read = brdf(&*file.read());
        for (read, expected) in read.as_flattened().iter().zip(expected.as_flattened()) {
            assert!(
                (read - expected).abs() <= 1e-6 * expected.abs(),
                "{phi}: {read} {expected}"
            );
        }
    }
    // Red at theta_h = 0, theta_d = 2 degrees, phi_d = 187 degrees.
    for (factor, is_read) in [(1.0005, true), (1.002, false)] {
        let mut halves = halves.clone();
        halves[2 * 360 + 187] *= factor;
        fs::write(&file.path, [header(360), double(&halves)].concat())
            .expect("the file is written");
        match is_read {
            true => drop(file.read()),
            false => file.assert_rejected("red theta_d 2 phi_d 7"),
        }
    }
    let length = 12 + 4 * 3 * 1_458_000;
    file.patch(0, &header(180));
    file.set_length(length - 4);
    file.assert_rejected(&format!("{} {length}", length - 4));
}
