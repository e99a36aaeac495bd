//! RGL measurements: look-ups against closed formulas, and rejection of damaged and unsupported files.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Format, Material, Procedural};

use crate::folder::{Folder, load};
use crate::formats::tabulated;
use crate::with_derivative;

/// A field of a tensor file.
#[derive(Clone)]
pub(crate) struct Field {
    name: &'static str,
    type_code: u8,
    shape: Vec<u64>,
    values: Vec<u8>,
}

impl Field {
    fn floats(name: &'static str, shape: &[usize], values: &[f32]) -> Self {
        Self {
            name,
            type_code: 10,
            shape: shape.iter().map(|length| *length as u64).collect(),
            values: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }

    fn bytes(name: &'static str, values: &[u8]) -> Self {
        Self {
            name,
            type_code: 1,
            shape: vec![values.len() as u64],
            values: values.to_vec(),
        }
    }
}

/// Encodes a tensor file independently of the code under test. `stated_offset` maps a field's name and true offset to
/// the offset in the header.
fn tensor_file(fields: &[Field], stated_offset: impl Fn(&str, u64) -> u64) -> Vec<u8> {
    let header: usize = fields
        .iter()
        .map(|field| 2 + field.name.len() + 2 + 1 + 8 + 8 * field.shape.len())
        .sum();
    let mut bytes = b"tensor_file\0\x01\x00".to_vec();
    bytes.extend((fields.len() as u32).to_le_bytes());
    let mut offset = bytes.len() + header;
    for field in fields {
        bytes.extend((field.name.len() as u16).to_le_bytes());
        bytes.extend(field.name.as_bytes());
        bytes.extend((field.shape.len() as u16).to_le_bytes());
        bytes.push(field.type_code);
        bytes.extend(stated_offset(field.name, offset as u64).to_le_bytes());
        bytes.extend(field.shape.iter().flat_map(|length| length.to_le_bytes()));
        offset += field.values.len();
    }
    fields.iter().for_each(|field| bytes.extend(&field.values));
    bytes
}

/// A measurement given by closed formulas. They are linear in each coordinate, so that interpolation is exact.
///
/// The density of visible normals at node k of theta_i is p_k(u) q(v), with p_k = 1 + b_k (2 u - 1) and
/// q = 1 + a (2 v - 1). Its cumulative distributions are x = u + b_k (u^2 - u) and y = v + a (v^2 - v).
struct Formula;

const THETA_I: [f32; 3] = [0.0, 0.6, 1.5];
const B: [f64; 3] = [-0.5, 0.2, 0.9];
const A: f64 = 0.7;

impl Formula {
    fn ndf(u: f64, v: f64) -> f64 {
        1.0 + u + 0.5 * v + 2.0 * u * v
    }

    fn sigma(u: f64) -> f64 {
        0.5 + 0.3 * u
    }

    fn rgb(node: usize, channel: usize, x: f64, y: f64) -> f64 {
        let (k, c) = (node as f64, channel as f64);
        0.3 + 0.1 * k + (0.2 + 0.3 * c) * x + (0.4 - 0.1 * k) * y + 0.5 * c * x * y
    }

    /// Returns the fields for the given nodes of phi_i. The tables are equal for all phi_i.
    fn fields(phi_i: &[f32]) -> Vec<Field> {
        let phi_count = phi_i.len();
        // Tabulates a function on the unit square.
        let table = |rows: usize, columns: usize, f: &dyn Fn(f64, f64) -> f64| -> Vec<f32> {
            (0..rows * columns)
                .map(|index| {
                    let u = (index % columns) as f64 / (columns - 1) as f64;
                    let v = (index / columns) as f64 / (rows - 1) as f64;
                    f(u, v) as f32
                })
                .collect()
        };
        let density = |k: usize| {
            table(6, 9, &|u, v| {
                // Densities may have any scale.
                (k + 1) as f64 * (1.0 + B[k] * (2.0 * u - 1.0)) * (1.0 + A * (2.0 * v - 1.0))
            })
        };
        let vndf: Vec<f32> = (0..3).flat_map(density).collect();
        let color = |k: usize, c: usize| table(4, 5, &|x, y| Self::rgb(k, c, x, y));
        let rgb: Vec<f32> = (0..9).flat_map(|i| color(i / 3, i % 3)).collect();
        vec![
            Field::bytes("description", b"a formula"),
            Field::floats("phi_i", &[phi_count], phi_i),
            Field::floats("theta_i", &[3], &THETA_I),
            Field::floats("sigma", &[2, 7], &table(2, 7, &|u, _| Self::sigma(u))),
            Field::floats("ndf", &[3, 8], &table(3, 8, &Self::ndf)),
            Field::floats("vndf", &[phi_count, 3, 6, 9], &vndf.repeat(phi_count)),
            Field::floats("rgb", &[phi_count, 3, 3, 4, 5], &rgb.repeat(phi_count)),
            Field::bytes("jacobian", &[1]),
        ]
    }

    /// Returns the BRDF times cos(theta_o).
    fn evaluate(theta_i: f64, theta_h: f64, phi: f64, channel: usize) -> f64 {
        let unit = |theta: f64| (theta / FRAC_PI_2).sqrt();
        let (u, v) = (unit(theta_h), (phi + PI) / TAU);
        let nodes = THETA_I.map(f64::from);
        let low = usize::from(theta_i > nodes[1]);
        let fraction = ((theta_i - nodes[low]) / (nodes[low + 1] - nodes[low])).min(1.0);
        let mix = |f: &dyn Fn(usize) -> f64| (1.0 - fraction) * f(low) + fraction * f(low + 1);
        let x = mix(&|k| u + B[k] * (u * u - u));
        let y = v + A * (v * v - v);
        mix(&|k| Self::rgb(k, channel, x, y)) * Self::ndf(u, v) / (4.0 * Self::sigma(unit(theta_i)))
    }
}

/// Reads a file with these bytes.
pub(crate) fn read(bytes: &[u8]) -> Box<dyn Material> {
    let folder = Folder::new();
    let path = folder.write("formula_rgb.bsdf", bytes);
    load(&path).expect("the file is read").remove(0)
}

/// Encodes a valid tensor file.
fn valid_file(fields: &[Field]) -> Vec<u8> {
    tensor_file(fields, |_, offset| offset)
}

/// Returns the file of an isotropic measurement.
pub(crate) fn isotropic() -> Vec<u8> {
    valid_file(&Formula::fields(&[0.0]))
}

#[test]
fn lookups_match_the_formula() {
    let material = read(&isotropic());
    assert_eq!(material.name(), "formula_rgb");
    let two_phi_i = read(&valid_file(&Formula::fields(&[-3.1, 3.1])));
    let mut largest = 0.0_f64;
    for angles in uniform_valid(20_000, 1) {
        let brdf = material.at_angles(angles);
        assert_eq!(brdf, two_phi_i.at_angles(angles));
        let (values, _) = with_derivative(&*material, angles);
        for (value, expected) in values.into_iter().zip(brdf) {
            assert!(
                (value - expected).abs() <= 1e-6 * expected,
                "{value} {expected}"
            );
        }
        // The formula in f64, at the angles rounded to f32.
        let at = HalfDifference::from_angles(angles.map(f64::from));
        let directions = at.directions();
        let theta_i = directions.incoming[2].acos();
        let azimuth = |[x, y, _]: [f64; 3]| y.atan2(x);
        let sum = std::array::from_fn(|i| directions.incoming[i] + directions.outgoing[i]);
        let phi = (azimuth(sum) - azimuth(directions.incoming) + PI).rem_euclid(TAU) - PI;
        let cos_o = directions.outgoing[2];
        if cos_o < 1e-6 {
            continue;
        }
        for (channel, value) in brdf.into_iter().enumerate() {
            let expected =
                Formula::evaluate(theta_i, f64::from(angles.theta_h), phi, channel) / cos_o;
            largest = largest.max((f64::from(value) / expected - 1.0).abs());
        }
    }
    assert!(largest < 2e-6, "{largest}");
}

/// A written spectrum has the color of the written RGB.
#[test]
fn spectra_have_colors_of_rgb() {
    let material = &Procedural::set(2, 3)[1];
    let [rgb, spectral] = [Format::Rgl, Format::RglSpectra]
        .map(|format| read(&tabulated(format, "test", material)[0]));
    for angles in uniform_valid(2_000, 5) {
        let (expected, actual) = (rgb.at_angles(angles), spectral.at_angles(angles));
        let largest = expected.into_iter().fold(0.0, f32::max);
        for (one, other) in expected.into_iter().zip(actual) {
            assert!(
                (one - other).abs() <= 3e-3 * largest,
                "{expected:?} {actual:?}"
            );
        }
    }
}

#[test]
fn brdf_is_0_below_the_horizon_and_for_negative_values() {
    let material = read(&isotropic());
    for below in [[1.0, 1.0, 0.0], [1.0, 1.0, PI], [1.5, 1.5, 0.1]] {
        let (brdf, derivative) = with_derivative(&*material, crate::angles(below));
        assert_eq!((brdf, derivative), ([0.0; 3], [[0.0; 3]; 3]));
    }
    // At the horizon, stored values are divided by a cosine near 0.
    for step in -5..5 {
        let theta = PI / 4.0 + 1e-8 * f64::from(step);
        let brdf = material.at_angles(crate::angles([theta, PI / 4.0, PI]));
        assert!(brdf.iter().all(|value| value.is_finite()), "{brdf:?}");
    }
    let negative = read(&floats("rgb", &[1, 3, 3, 4, 5], &[-0.01]));
    let (brdf, derivative) = with_derivative(&*negative, crate::angles([0.3, 0.3, 0.3]));
    assert_eq!((brdf, derivative), ([0.0; 3], [[0.0; 3]; 3]));
}

/// Returns the file after a change of one field.
fn changed(name: &str, change: impl Fn(&mut Field)) -> Vec<u8> {
    let mut fields = Formula::fields(&[0.0]);
    let field = fields.iter_mut().find(|field| field.name == name);
    change(field.expect("the field exists"));
    valid_file(&fields)
}

/// Returns the file with a field of floats, which repeat `values`.
fn floats(name: &'static str, shape: &[usize], values: &[f32]) -> Vec<u8> {
    let count = shape.iter().product();
    let values: Vec<f32> = values.iter().copied().cycle().take(count).collect();
    changed(name, |field| *field = Field::floats(name, shape, &values))
}

/// Returns the fields of a file whose three channels are the spectrum at three wavelengths in nm.
fn spectral(wavelengths: &[f32]) -> Vec<Field> {
    let mut fields = Formula::fields(&[0.0]);
    fields[6].name = "spectra";
    let wavelengths = Field::floats("wavelengths", &[wavelengths.len()], wavelengths);
    fields.push(wavelengths);
    fields
}

/// Returns files with one defect each, and words of the message, which are separated by spaces.
pub(crate) fn damaged() -> Vec<(Vec<u8>, String)> {
    let mut files = Vec::new();
    for (index, field) in Formula::fields(&[0.0]).iter().enumerate().skip(1) {
        let mut fields = Formula::fields(&[0.0]);
        fields.remove(index);
        files.push((valid_file(&fields), field.name.to_owned()));
    }
    let bytes = |values| {
        changed("jacobian", |field| {
            *field = Field::bytes("jacobian", values)
        })
    };
    let valid_spectrum = spectral(&[400.0, 550.0, 700.0]);
    read(&valid_file(&valid_spectrum));
    let mut not_finite = valid_spectrum.clone();
    not_finite[6].values[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    // A field without values may have any dimensions.
    let mut empty = valid_spectrum;
    empty[6].shape = vec![0, 1, 3, 1 << 32, 1 << 31];
    empty[6].values.clear();
    let matrix = Field::floats("M", &[1, 1, 1, 1, 4, 4], &[0.5; 16]);
    let wavelengths = Field::floats("wvls", &[1], &[0.5]);
    let valid = isotropic();
    let length = valid.len() as u64;
    let moved = |name: &str, to: u64| {
        tensor_file(&Formula::fields(&[0.0]), |field, offset| {
            if field == name { to } else { offset }
        })
    };
    for (bytes, words) in [
        (floats("ndf", &[24], &[1.0]), "ndf 2 [24]"),
        (floats("jacobian", &[1], &[1.0]), "jacobian 1 10 [1]"),
        (bytes(&[1, 1]), "jacobian 2 1"),
        (bytes(&[0]), "jacobian 1"),
        (floats("ndf", &[3, 8], &[f32::NAN]), "[0, 0] ndf NaN"),
        (floats("ndf", &[3, 8], &[1.0, -1.0]), "[0, 1] ndf -1"),
        (floats("sigma", &[2, 7], &[0.0]), "sigma 0"),
        (floats("sigma", &[1, 7], &[1.0]), "sigma 1 7"),
        (floats("vndf", &[1, 3, 0, 9], &[1.0]), "vndf 0 9"),
        (floats("theta_i", &[3], &[0.0, 1.5, 1.5]), "theta_i"),
        (floats("theta_i", &[2], &[0.0, 1.6]), "[1] theta_i 1.6"),
        (floats("theta_i", &[0], &[0.0]), "theta_i"),
        (floats("theta_i", &[2], &[0.0, 1.5]), "2 vndf rgb [1, 3]"),
        (floats("rgb", &[1, 3, 4, 4, 5], &[1.0]), "rgb 4"),
        (changed("rgb", |f| f.name = "spectra"), "wavelengths"),
        (changed("sigma", |f| f.name = "rgb"), "rgb"),
        (valid_file(&spectral(&[400.0, 700.0])), "2 spectra"),
        (valid_file(&spectral(&[700.0, 550.0])), "wavelengths"),
        (valid_file(&spectral(&[0.4, 0.5, 0.7])), "0.4 nm"),
        (valid_file(&not_finite), "spectra"),
        (valid_file(&empty), "spectra"),
        (valid_file(&[matrix, wavelengths]), "polarized M"),
        (
            valid_file(&Formula::fields(&[-1.0, 0.0, 1.0])),
            "anisotropic 3 phi_i",
        ),
        (moved("ndf", 0), "0"),
        (moved("ndf", 17), "17"),
    ] {
        files.push((bytes, words.to_owned()));
    }
    files.push((moved("jacobian", length - 2), (length - 2).to_string()));
    for offset in [length, length - 8, u64::MAX, u64::MAX - 95] {
        let words = format!("ndf [3, 8] {offset} {length}");
        files.push((moved("ndf", offset), words));
    }
    // Shapes that exceed memory. The products of all but the first one overflow, some of them to 0.
    for shape in [
        vec![u64::MAX],
        vec![1 << 32, 1 << 32],
        vec![1 << 63, 2],
        vec![u64::MAX, u64::MAX, 16],
    ] {
        let bytes = changed("ndf", |field| field.shape.clone_from(&shape));
        files.push((bytes, format!("ndf {shape:?}")));
    }
    for type_code in [0, 12, 255] {
        let bytes = changed("ndf", |field| field.type_code = type_code);
        files.push((bytes, format!("ndf {type_code}")));
    }
    // The magic, the version, the number of fields in big-endian, the length of the first field's name, and the name.
    for (at, bytes, words) in [
        (3, &b"z"[..], "tenzor_file"),
        (12, &[2, 1], "2.1 1.0"),
        (14, &[0, 0, 0, 8], ""),
        (18, &[255, 255], ""),
        (20, &[255], "UTF-8"),
    ] {
        let mut file = valid.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        files.push((file, words.to_owned()));
    }
    files
}
