//! RGL's measurements: looked up against closed formulas, refused when damaged or of another kind.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Material, RglMeasurement};

use crate::common::assert_names;
use crate::folder::{Folder, damage};

/// One field of a tensor file.
#[derive(Clone)]
pub(crate) struct Field {
    name: &'static str,
    kind: u8,
    shape: Vec<u64>,
    values: Vec<u8>,
}

impl Field {
    fn floats(name: &'static str, shape: &[usize], values: &[f32]) -> Self {
        Self {
            name,
            kind: 10,
            shape: shape.iter().map(|length| *length as u64).collect(),
            values: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }

    fn bytes(name: &'static str, values: &[u8]) -> Self {
        Self {
            name,
            kind: 1,
            shape: vec![values.len() as u64],
            values: values.to_vec(),
        }
    }
}

/// A tensor file, written out by hand; `lie` may change where a field is said to begin.
fn tensor_file(fields: &[Field], lie: impl Fn(&str, u64) -> u64) -> Vec<u8> {
    let header: usize = fields
        .iter()
        .map(|field| 2 + field.name.len() + 2 + 1 + 8 + 8 * field.shape.len())
        .sum();
    let mut bytes = b"tensor_file\0\x01\x00".to_vec();
    bytes.extend((fields.len() as u32).to_le_bytes());
    let mut begin = bytes.len() + header;
    for field in fields {
        bytes.extend((field.name.len() as u16).to_le_bytes());
        bytes.extend(field.name.as_bytes());
        bytes.extend((field.shape.len() as u16).to_le_bytes());
        bytes.push(field.kind);
        bytes.extend(lie(field.name, begin as u64).to_le_bytes());
        bytes.extend(field.shape.iter().flat_map(|length| length.to_le_bytes()));
        begin += field.values.len();
    }
    fields.iter().for_each(|field| bytes.extend(&field.values));
    bytes
}

/// A measurement that is a closed formula: everything in it is linear in each coordinate, so that
/// interpolation is exact.
///
/// The density of visible normals at node k of theta_i is p_k(u) q(v), p_k = 1 + b_k (2 u - 1) and
/// q = 1 + a (2 v - 1); the mapping that makes it uniform is x = u + b_k (u^2 - u),
/// y = v + a (v^2 - v).
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

    /// Its tables for so many nodes of phi_i, all alike.
    fn fields(phi_i: &[f32]) -> Vec<Field> {
        let phis = phi_i.len();
        // Values of a function of the unit square.
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
                // Of any scale.
                (k + 1) as f64 * (1.0 + B[k] * (2.0 * u - 1.0)) * (1.0 + A * (2.0 * v - 1.0))
            })
        };
        let vndf: Vec<f32> = (0..3).flat_map(density).collect();
        let color = |k: usize, c: usize| table(4, 5, &|x, y| Self::rgb(k, c, x, y));
        let rgb: Vec<f32> = (0..9).flat_map(|i| color(i / 3, i % 3)).collect();
        vec![
            Field::bytes("description", b"a formula"),
            Field::floats("phi_i", &[phis], phi_i),
            Field::floats("theta_i", &[3], &THETA_I),
            Field::floats("sigma", &[2, 7], &table(2, 7, &|u, _| Self::sigma(u))),
            Field::floats("ndf", &[3, 8], &table(3, 8, &Self::ndf)),
            Field::floats("vndf", &[phis, 3, 6, 9], &vndf.repeat(phis)),
            Field::floats("rgb", &[phis, 3, 3, 4, 5], &rgb.repeat(phis)),
            Field::bytes("jacobian", &[1]),
        ]
    }

    /// The BRDF times cos(theta_o).
    fn evaluate(theta_i: f64, theta_h: f64, phi: f64, channel: usize) -> f64 {
        let unit = |theta: f64| (theta / FRAC_PI_2).sqrt();
        let (u, v) = (unit(theta_h), (phi + PI) / TAU);
        let nodes = THETA_I.map(f64::from);
        let low = usize::from(theta_i > nodes[1]);
        let share = ((theta_i - nodes[low]) / (nodes[low + 1] - nodes[low])).min(1.0);
        let mix = |f: &dyn Fn(usize) -> f64| (1.0 - share) * f(low) + share * f(low + 1);
        let x = mix(&|k| u + B[k] * (u * u - u));
        let y = v + A * (v * v - v);
        mix(&|k| Self::rgb(k, channel, x, y)) * Self::ndf(u, v) / (4.0 * Self::sigma(unit(theta_i)))
    }
}

/// Reads a file with these bytes.
fn read(bytes: &[u8]) -> RglMeasurement {
    let folder = Folder::new();
    let path = folder.write("formula_rgb.bsdf", bytes);
    RglMeasurement::read(&path).expect("it is read")
}

/// Asserts that a file with these bytes is refused by its path, and that the message names these.
fn assert_refused(bytes: &[u8], named: &[&str]) {
    let folder = Folder::new();
    let path = folder.write("formula_rgb.bsdf", bytes);
    match damage(RglMeasurement::read(&path), &path) {
        Some(what) => assert_names(&what, named),
        None => panic!("the damaged file was read: {named:?}"),
    }
}

fn whole_file(fields: &[Field]) -> Vec<u8> {
    tensor_file(fields, |_, at| at)
}

/// The file of an isotropic measurement.
pub(crate) fn isotropic() -> Vec<u8> {
    whole_file(&Formula::fields(&[0.0]))
}

/// The file of one that is anisotropic.
pub(crate) fn anisotropic() -> Vec<u8> {
    whole_file(&Formula::fields(&[-1.0, 0.0, 1.0]))
}

/// The file of one that is spectral.
pub(crate) fn spectral() -> Vec<u8> {
    let mut fields = Formula::fields(&[0.0]);
    let rgb = fields.iter_mut().find(|field| field.name == "rgb");
    rgb.expect("it is there").name = "spectra";
    whole_file(&fields)
}

#[test]
fn look_ups_are_the_formula() {
    let material = read(&isotropic());
    assert_eq!(material.name(), "formula_rgb");
    let circle = read(&whole_file(&Formula::fields(&[-3.1, 3.1])));
    let mut largest = 0.0_f64;
    for angles in uniform_valid(20_000, 1) {
        let found = material.brdf(angles);
        assert_eq!(found, circle.brdf(angles));
        // In double precision, from where the angles in single precision are.
        let at = HalfDifference::from_angles(glimpse_core::geometry::Angles {
            theta_h: f64::from(angles.theta_h),
            theta_d: f64::from(angles.theta_d),
            phi_d: f64::from(angles.phi_d),
        });
        let directions = at.directions();
        let theta_i = directions.incoming[2].acos();
        let azimuth = |[x, y, _]: [f64; 3]| y.atan2(x);
        let sum = std::array::from_fn(|i| directions.incoming[i] + directions.outgoing[i]);
        let phi = (azimuth(sum) - azimuth(directions.incoming) + PI).rem_euclid(TAU) - PI;
        let cos_o = directions.outgoing[2];
        if cos_o < 1e-6 {
            continue;
        }
        for (channel, found) in found.into_iter().enumerate() {
            let expected =
                Formula::evaluate(theta_i, f64::from(angles.theta_h), phi, channel) / cos_o;
            largest = largest.max((f64::from(found) / expected - 1.0).abs());
        }
    }
    println!("largest relative error: {largest:.1e}");
    assert!(largest < 2e-6, "{largest}");
}

#[test]
fn below_the_horizon_and_where_interpolation_overshoots_it_is_0() {
    let mut fields = Formula::fields(&[0.0]);
    let material = read(&whole_file(&fields));
    for place in [[1.0, 1.0, 0.0], [1.0, 1.0, PI], [1.5, 1.5, 0.1]] {
        let (brdf, derivative) = material.brdf_with_derivative(crate::angles(place));
        assert_eq!((brdf, derivative), ([0.0; 3], [[0.0; 3]; 3]));
    }
    // At the horizon itself what is stored is divided by next to nothing.
    for step in -5..5 {
        let theta = PI / 4.0 + 1e-8 * f64::from(step);
        let brdf = material.brdf(crate::angles([theta, PI / 4.0, PI]));
        assert!(brdf.iter().all(|value| value.is_finite()), "{brdf:?}");
    }
    let rgb = fields.iter_mut().find(|field| field.name == "rgb");
    *rgb.expect("it is there") = Field::floats("rgb", &[1, 3, 3, 4, 5], &[-0.01; 180]);
    let negative = read(&whole_file(&fields));
    let (brdf, derivative) = negative.brdf_with_derivative(crate::angles([0.3, 0.3, 0.3]));
    assert_eq!((brdf, derivative), ([0.0; 3], [[0.0; 3]; 3]));
}

/// A file in which one field is another one, or is missing.
fn with(name: &str, field: Option<Field>) -> Vec<u8> {
    let mut fields = Formula::fields(&[0.0]);
    let index = fields.iter().position(|field| field.name == name);
    let index = index.expect("it is there");
    match field {
        Some(field) => fields[index] = field,
        None => {
            fields.remove(index);
        }
    }
    whole_file(&fields)
}

#[test]
fn what_its_fields_must_be_is_said() {
    let floats = |name, shape: &[usize], value: f32| {
        Some(Field::floats(
            name,
            shape,
            &vec![value; shape.iter().product()],
        ))
    };
    for name in [
        "phi_i", "theta_i", "sigma", "ndf", "vndf", "rgb", "jacobian",
    ] {
        assert_refused(&with(name, None), &[name]);
    }
    for (name, field, named) in [
        ("ndf", floats("ndf", &[24], 1.0), &["ndf", "2", "[24]"][..]),
        (
            "jacobian",
            floats("jacobian", &[1], 1.0),
            &["jacobian", "8", "32", "[1]"],
        ),
        (
            "jacobian",
            Some(Field::bytes("jacobian", &[1, 1])),
            &["jacobian", "2", "1"],
        ),
        (
            "jacobian",
            Some(Field::bytes("jacobian", &[0])),
            &["jacobian"],
        ),
        (
            "ndf",
            floats("ndf", &[3, 8], f32::NAN),
            &["0", "ndf", "NaN"],
        ),
        ("sigma", floats("sigma", &[2, 7], 0.0), &["sigma", "0"]),
        ("sigma", floats("sigma", &[1, 7], 1.0), &["sigma", "1", "7"]),
        (
            "vndf",
            floats("vndf", &[1, 3, 0, 9], 1.0),
            &["vndf", "0", "9"],
        ),
        (
            "theta_i",
            Some(Field::floats("theta_i", &[3], &[0.0, 1.5, 1.5])),
            &["theta_i"],
        ),
        ("theta_i", floats("theta_i", &[0], 0.0), &["theta_i"]),
        (
            "theta_i",
            Some(Field::floats("theta_i", &[2], &[0.0, 1.5])),
            &["phi_i", "theta_i", "2", "vndf", "rgb", "[1, 3]"],
        ),
        ("rgb", floats("rgb", &[1, 3, 4, 4, 5], 1.0), &["rgb", "4"]),
        ("rgb", floats("spectra", &[1, 3, 3, 4, 5], 1.0), &["RGB"]),
        ("description", floats("rgb", &[1], 1.0), &["rgb"]),
    ] {
        assert_refused(&with(name, field), named);
    }
}

#[test]
fn lies_of_the_header_are_found() {
    let fields = Formula::fields(&[0.0]);
    let whole = whole_file(&fields);
    let length = whole.len() as u64;
    let lie =
        |name: &str, to: u64| tensor_file(&fields, |field, at| if field == name { to } else { at });
    for begin in [length, length - 8, u64::MAX, u64::MAX - 95] {
        let [begins, ends] = [begin, length].map(|number| number.to_string());
        assert_refused(&lie("ndf", begin), &["ndf", "[3, 8]", &begins, &ends]);
    }
    for begin in [0, 17] {
        assert_refused(&lie("ndf", begin), &["ndf"]);
    }
    let jacobian = length - 1;
    assert_refused(&lie("jacobian", jacobian - 1), &["jacobian", "rgb"]);

    // Shapes beyond all memory, also where their product is 0 or wraps around.
    for shape in [
        vec![u64::MAX],
        vec![1 << 32, 1 << 32],
        vec![1 << 63, 2],
        vec![u64::MAX, u64::MAX, 16],
    ] {
        let mut fields = fields.clone();
        fields[4].shape.clone_from(&shape);
        let shape = format!("{shape:?}");
        assert_refused(&whole_file(&fields), &["ndf", &shape]);
    }
    for kind in [0, 12, 255] {
        let mut fields = fields.clone();
        fields[4].kind = kind;
        let kind = kind.to_string();
        assert_refused(&whole_file(&fields), &["ndf", &kind]);
    }

    let patched = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    assert_refused(&patched(3, b"z"), &[]);
    assert_refused(&patched(12, &[2, 1]), &["2.1", "1.0"]);
    assert_refused(&patched(18, &[255, 255]), &[]);
    assert_refused(b"", &[]);
    assert_refused(&patched(20, &[0xff]), &[]);
}
