//! The compact basis: its format, its errors, and its values compared with a second implementation in f64.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::file::HEADER_BYTES;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::{Basis, Nodes};
use proptest::prelude::*;

use crate::documents::hex_bytes;
use crate::recipes::{file, spread};

const EXAMPLE: &str = include_str!("../../docs/basis.hex");

/// The contents of a file.
#[derive(Clone, Debug)]
pub(crate) struct Contents {
    of: u32,
    shape: [u16; 3],
    mean_scale: f32,
    scales: Vec<f32>,
    table: Vec<(i16, u16, Vec<i8>)>,
}

impl Contents {
    /// Contents with `shape` nodes and `components` components. The entries vary strongly between neighbors.
    pub(crate) fn synthetic(shape: [u16; 3], components: usize) -> Self {
        let nodes = shape.into_iter().map(usize::from).product::<usize>();
        Self {
            of: 0xfeed_beef,
            shape,
            mean_scale: 1e-4,
            scales: (0..components)
                .map(|k| 4.0 / (127.0 * 65535.0 * (k + 1) as f32))
                .collect(),
            table: (0..nodes)
                .map(|node| {
                    let row = (0..components).map(|k| (254.0 * spread(7 * node + 3 * k)) as i8);
                    let mean = 20_000.0 + 20_000.0 * spread(node);
                    let scale = 40_000.0 + 50_000.0 * spread(3 * node);
                    (mean as i16, scale as u16, row.collect())
                })
                .collect(),
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut body = self.of.to_le_bytes().to_vec();
        let components = self.scales.len() as u16;
        for count in [components].iter().chain(&self.shape) {
            body.extend(count.to_le_bytes());
        }
        for scale in [self.mean_scale].iter().chain(&self.scales) {
            body.extend(scale.to_le_bytes());
        }
        for (mean, scale, row) in &self.table {
            body.extend(mean.to_le_bytes());
            body.extend(scale.to_le_bytes());
            body.extend(row.iter().map(|entry| entry.cast_unsigned()));
        }
        file(b"GLMC", 1, &body)
    }

    /// The BRDF in f64, implemented from the document, with angles.
    fn brdf(&self, coefficients: [&[f32]; 3], at: &HalfDifference<f32>) -> [f64; 3] {
        let [hx, hz, dx, dy, dz] = at.to_array().map(f64::from);
        let theta_h = hx.abs().atan2(hz);
        let theta_d = dx.hypot(dy).atan2(dz);
        let phi_d = dy.abs().atan2(dx.abs());
        let cosines = [
            theta_h.cos() * theta_d.cos() - theta_h.sin() * theta_d.sin() * phi_d.cos(),
            theta_h.cos() * theta_d.cos() + theta_h.sin() * theta_d.sin() * phi_d.cos(),
        ];
        let horizon = cosines[0] / (theta_h.cos() * theta_d.cos());
        let places = [
            (2_f64.sqrt() * (theta_h / 2.0).sin()).sqrt(),
            1.0 - theta_d.cos(),
            (1.0 - phi_d.cos()).min(horizon).max(0.0).sqrt(),
        ];
        let axes = [0, 1, 2].map(|axis| {
            let cells = f64::from(self.shape[axis] - 1);
            let along = cells * places[axis].clamp(0.0, 1.0);
            let low = along.floor().min(cells - 1.0);
            (low as usize, along - low)
        });
        let mut mapped = [0.0; 3];
        for corner in 0..8 {
            let (mut node, mut share) = (0, 1.0);
            for (axis, (low, between)) in axes.into_iter().enumerate() {
                let high = corner >> axis & 1;
                node = node * usize::from(self.shape[axis]) + low + high;
                share *= if high == 1 { between } else { 1.0 - between };
            }
            let (mean, scale, row) = &self.table[node];
            for (mapped, coefficients) in mapped.iter_mut().zip(coefficients) {
                let mut value = f64::from(*mean) * f64::from(self.mean_scale);
                for ((entry, c), column) in row.iter().zip(coefficients).zip(&self.scales) {
                    let entry = f64::from(*entry) * f64::from(*scale) * f64::from(*column);
                    value += entry * f64::from(*c);
                }
                *mapped += share * value;
            }
        }
        let weight = cosines[0] * cosines[1];
        mapped.map(|mapped| (1e-3 * (mapped.exp() - 1.0) / weight).max(0.0))
    }
}

/// Half and difference vectors from exact sines and cosines, independent of core's.
fn half_difference(theta_h: f32, theta_d: f32, phi_d: f32) -> HalfDifference<f32> {
    let ((hx, hz), (sin_d, dz)) = (theta_h.sin_cos(), theta_d.sin_cos());
    HalfDifference::from_array([hx, hz, sin_d * phi_d.cos(), sin_d * phi_d.sin(), dz])
}

/// A valid basis. Its bytes are leaked.
fn basis(contents: &Contents) -> Basis<'static> {
    Basis::parse(contents.bytes().leak()).expect("a valid basis")
}

/// The document's example: two nodes along each axis and one component.
fn example() -> Contents {
    Contents {
        of: 0x0123_abcd,
        shape: [2; 3],
        mean_scale: 0.001,
        scales: vec![1.0 / (127.0 * 65535.0)],
        table: (0..8)
            .map(|node| match node {
                1 => (1000, 65535, vec![127]),
                _ => (100 * node, 8000, vec![-1]),
            })
            .collect(),
    }
}

#[test]
fn documented_example_parses() {
    let bytes = hex_bytes(EXAMPLE);
    let expected = example().bytes();
    assert_eq!(bytes, expected, "the bytes are {expected:02x?}");
    let basis = basis(&example());
    assert_eq!(basis.checksum(), 0x0123_abcd);
    assert_eq!(basis.components(), 1);
    let shape = Nodes {
        theta_h: 2,
        theta_d: 2,
        phi_d: 2,
    };
    assert_eq!(basis.nodes(), shape);
    let at = half_difference(0.0, 0.0, 0.0);
    let actual = basis.brdf([&[0.5], &[0.0], &[-1.0]], &at);
    let tolerance = by_math!(1e-8, 2e-5);
    for (actual, (exact, written)) in actual.expect("a BRDF").into_iter().zip([
        (1e-3 * (1.5_f32.exp() - 1.0), "0.003482"),
        (1e-3 * (1.0_f32.exp() - 1.0), "0.001718"),
        (0.0, "0 sr"),
    ]) {
        let is_valid = (actual - exact).abs() < tolerance;
        assert!(is_valid, "{actual} instead of {exact}");
        assert!(EXAMPLE.contains(written), "the example lacks {written}");
    }
}

fn malformed(field: &'static str) -> Error {
    Error::in_field(ErrorCode::BasisMalformed, field)
}

#[test]
fn rejects_invalid_contents() {
    let good = Contents::synthetic([2, 2, 3], 2);
    let parse_error = |change: &dyn Fn(&mut Contents)| {
        let mut wrong = good.clone();
        change(&mut wrong);
        Basis::parse(&wrong.bytes()).expect_err("wrong contents")
    };
    for scale in [f32::NAN, f32::INFINITY, -1.0] {
        let expected = malformed("basis.scales");
        assert_eq!(parse_error(&|wrong| wrong.mean_scale = scale), expected);
        assert_eq!(parse_error(&|wrong| wrong.scales[1] = scale), expected);
    }
    for shape in [[1, 4, 3], [12, 1, 1], [0, 2, 2], [6, 1, 2]] {
        let error = parse_error(&|wrong| wrong.shape = shape);
        assert_eq!(error, malformed("basis.nodes"), "{shape:?}");
    }
    for shape in [[2, 2, 2], [3, 2, 3], [65535, 65535, 2]] {
        let error = parse_error(&|wrong| wrong.shape = shape);
        let is_named = error.code == ErrorCode::BasisLength;
        assert!(is_named, "{shape:?}: {error:?}");
    }
    for components in [0, 1025] {
        let error = parse_error(&|wrong| *wrong = Contents::synthetic([2, 2, 2], components));
        assert_eq!(error, malformed("basis.components"));
    }
    let body = &good.bytes()[HEADER_BYTES..];
    for length in 0..body.len() {
        assert!(Basis::parse(&file(b"GLMC", 1, &body[..length])).is_err());
    }
}

#[test]
fn no_brdf_for_invalid_directions_or_coefficients() {
    let basis = basis(&Contents::synthetic([4, 3, 3], 2));
    let coefficients: [&[f32]; 3] = [&[0.1, 0.2]; 3];
    let good = half_difference(0.3, 0.4, 1.0);
    assert!(basis.brdf(coefficients, &good).is_some());
    // Below the horizon, and not of unit length.
    let below = half_difference(1.2, 1.2, 0.1);
    let long = HalfDifference { hz: 1.5, ..good };
    let mut invalid = vec![below, long];
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for coordinate in 0..5 {
            let mut numbers = good.to_array();
            numbers[coordinate] = number;
            invalid.push(HalfDifference::from_array(numbers));
        }
    }
    for at in invalid {
        assert_eq!(basis.brdf(coefficients, &at), None, "{at:?}");
    }
    for number in [f32::NAN, f32::INFINITY, f32::MAX] {
        let actual = basis.brdf([&[number], &[0.0], &[0.0]], &good);
        // The BRDF does not exist, or is black if the coefficient makes it negative.
        assert!(actual.is_none_or(|brdf| brdf[0] == 0.0), "{actual:?}");
    }
}

#[test]
fn ignores_extra_components_and_zeroes_missing_ones() {
    let basis = basis(&Contents::synthetic([4, 3, 3], 2));
    let at = half_difference(0.3, 0.4, 1.0);
    let two = basis.brdf([&[0.1, 0.2], &[0.3, 0.0], &[0.0, 0.0]], &at);
    let others = basis.brdf([&[0.1, 0.2, 9.0, -7.0], &[0.3], &[]], &at);
    assert!(two.is_some());
    assert_eq!(others, two);
}

prop_compose! {
    fn valid_directions()(
        theta_h in 0.0..1.57_f32,
        theta_d in 0.0..1.57_f32,
        phi_d in -7.0..7.0_f32,
    ) -> HalfDifference<f32> {
        half_difference(theta_h, theta_d, phi_d)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn matches_f64_reference(
        at in valid_directions().prop_filter("near the horizon", |at| {
            at.cos_theta_i().min(at.cos_theta_o()) > 1e-2
        }),
        coefficients in prop::array::uniform3(prop::collection::vec(-0.3..0.3_f32, 3)),
    ) {
        let contents = Contents::synthetic([7, 5, 4], 3);
        let basis = basis(&contents);
        let coefficients = coefficients.each_ref().map(Vec::as_slice);
        let actual = basis.brdf(coefficients, &at).unwrap();
        let expected = contents.brdf(coefficients, &at);
        let weight = f64::from(at.cos_theta_i()) * f64::from(at.cos_theta_o());
        let tolerance = if cfg!(feature = "micromath") { 5e-3 } else { 1e-4 };
        for (actual, expected) in actual.into_iter().zip(expected) {
            // The error is relative to the argument of the mapping's logarithm, divided by its weight.
            let error = (f64::from(actual) - expected).abs() / (expected + 1e-3 / weight);
            prop_assert!(error < tolerance, "{actual} instead of {expected} at {at:?}");
        }
    }

    /// The values are equal bit for bit.
    #[test]
    fn is_reciprocal_and_mirror_symmetric(at in valid_directions()) {
        let basis = basis(&Contents::synthetic([7, 5, 4], 3));
        let coefficients: [&[f32]; 3] = [&[0.1, -0.2, 0.3], &[0.2], &[]];
        let actual = basis.brdf(coefficients, &at);
        let exchanged = HalfDifference { dx: -at.dx, dy: -at.dy, ..at };
        let mirrored = HalfDifference { dy: -at.dy, ..at };
        prop_assert_eq!(basis.brdf(coefficients, &exchanged), actual);
        prop_assert_eq!(basis.brdf(coefficients, &mirrored), actual);
    }

}
