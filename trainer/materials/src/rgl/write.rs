//! RGL's files, written: any isotropic BRDF, as Mitsuba's `measured` renders and samples it.
//!
//! `rgb` is a ratio to `ndf` and `sigma`, at nodes that `vndf` spreads. So at the nodes what is written
//! is the BRDF itself, whatever the three are, as long as they are positive; they are chosen for what
//! lies between nodes:
//!
//! - `ndf` is the mean of the BRDF at each theta_m, times cos(theta_m). What is left is smooth where a
//!   highlight is sharp.
//! - `sigma` is the area that those normals show, as in a measurement.
//! - `vndf` is *not* the density of the visible normals but between its square root and a constant, and
//!   leaves little below the horizon: the density itself would leave few nodes beside a mirror's
//!   highlight. Importance sampling is none the worse: `luminance` makes up for it.
//!
//! Where w_o is below the horizon, `rgb` goes on as BRDF times cosine does just above it: to less than 0,
//! as a rule, so that what is interpolated reaches 0 at the horizon and not a node before it.

use rayon::prelude::*;

use super::angular::unit_theta;
use super::distribution::{Cell, Densities, TableShape};
use super::normals::{NDF, Normals, SIGMA};
use super::place::{Place, coordinate, luminance, solid_angle, times_cosine};
use super::tensor_file::{Values, write};
use crate::{Brdf, NotFinite};

/// Nodes of `rgb` and `luminance` in each direction.
const SIDE: usize = 96;
const VNDF: TableShape = TableShape {
    columns: 128,
    rows: 64,
};
/// The share of the visible normals in `vndf`.
const VISIBLE: f64 = 0.4;

/// Tabulates a BRDF: the bytes of a `NAME_rgb.bsdf`, 12 MB, with a description.
///
/// # Errors
/// If the BRDF is not finite at some node.
pub fn to_rgl(description: &str, brdf: &(impl Brdf + ?Sized)) -> Result<Vec<u8>, NotFinite> {
    let theta_i = theta_i();
    let normals = Normals::of(brdf)?;
    let slices: Vec<Slice> = theta_i
        .par_iter()
        .map(|theta| Slice::of(brdf, f64::from(*theta), &normals))
        .collect::<Result<_, _>>()?;
    let nodes = theta_i.len();
    let joined =
        |of: fn(&Slice) -> &Vec<f32>| -> Vec<f32> { slices.iter().flat_map(of).copied().collect() };
    let (vndf, luminance, rgb) = (
        joined(|slice| &slice.vndf),
        joined(|slice| &slice.luminance),
        joined(|slice| &slice.rgb),
    );
    Ok(write(&[
        (
            "description",
            &[description.len()],
            Values::Bytes(description.as_bytes()),
        ),
        ("phi_i", &[1], Values::Floats(&[0.0])),
        ("theta_i", &[nodes], Values::Floats(&theta_i)),
        (
            "sigma",
            &[SIGMA.rows, SIGMA.columns],
            Values::Floats(&normals.sigma),
        ),
        (
            "ndf",
            &[NDF.rows, NDF.columns],
            Values::Floats(&normals.ndf),
        ),
        (
            "vndf",
            &[1, nodes, VNDF.rows, VNDF.columns],
            Values::Floats(&vndf),
        ),
        (
            "luminance",
            &[1, nodes, SIDE, SIDE],
            Values::Floats(&luminance),
        ),
        ("rgb", &[1, nodes, 3, SIDE, SIDE], Values::Floats(&rgb)),
        ("jacobian", &[1], Values::Bytes(&[1])),
        (
            "valid",
            &[nodes * SIDE * SIDE / 8],
            Values::Bytes(&valid(&slices)),
        ),
    ]))
}

/// The nodes of theta_i, radians: closer together where the horizon is near, and the last one as near
/// as f32 still tells a cosine from 0 well.
fn theta_i() -> Vec<f32> {
    let even = (0..56).map(|step| 1.5 * f64::from(step));
    let near_horizon = [84.0, 85.0, 86.0, 87.0, 88.0, 88.5, 89.0, 89.4, 89.7, 89.9];
    let degrees = even.chain(near_horizon);
    degrees.map(|degrees| degrees.to_radians() as f32).collect()
}

/// One bit for each node, the first one the highest of its byte: whether it is above the horizon.
fn valid(slices: &[Slice]) -> Vec<u8> {
    let bits: Vec<bool> = slices
        .iter()
        .flat_map(|slice| slice.above.iter().copied())
        .collect();
    let bytes = bits.chunks(8).map(|bits| {
        let placed = bits.iter().enumerate();
        placed.fold(0, |byte, (place, bit)| {
            byte | (u8::from(*bit) << (7 - place))
        })
    });
    bytes.collect()
}

/// What is stored for one node of theta_i.
struct Slice {
    vndf: Vec<f32>,
    luminance: Vec<f32>,
    /// Red's nodes, then green's, then blue's.
    rgb: Vec<f32>,
    above: Vec<bool>,
}

impl Slice {
    fn of(brdf: &(impl Brdf + ?Sized), theta_i: f64, normals: &Normals) -> Result<Self, NotFinite> {
        let ndf = |point: [f64; 2]| NDF.evaluate(&normals.ndf, &Cell::of(point, NDF));
        let area: f64 =
            SIGMA.evaluate(&normals.sigma, &Cell::of([unit_theta(theta_i), 0.5], SIGMA));
        let vndf = spread(theta_i, ndf);
        let points = Densities::new(VNDF, vndf.clone()).points_of_grid(SIDE);
        let places: Vec<Place> = points
            .iter()
            .map(|point| Place::of(theta_i, *point))
            .collect();
        let values = times_cosine(brdf, &places)?;

        let mut rgb = [(); 3].map(|()| Vec::with_capacity(points.len()));
        let mut sampled = Vec::with_capacity(points.len());
        for ((point, place), value) in points.iter().zip(&places).zip(&values) {
            for (channel, value) in rgb.iter_mut().zip(value) {
                channel.push(value * 4.0 * area / ndf(*point));
            }
            // From the density of directions w_o to that of points: see `solid_angle`.
            let energy = (luminance(*value) * place.cos_d).max(0.0);
            let density: f64 = VNDF.evaluate(&vndf, &Cell::of(*point, VNDF));
            let seen = if place.cos_o > 0.0 { energy } else { 0.0 };
            sampled.push((4.0 * seen * solid_angle(*point) / density) as f32);
        }
        let above: Vec<bool> = places.iter().map(|place| place.cos_o > 0.0).collect();
        let bounded = rgb.iter().flat_map(|channel| bounded(channel, &above));
        Ok(Self {
            luminance: sampled,
            rgb: bounded.collect(),
            vndf,
            above,
        })
    }
}

/// Ratios, not further below 0 than they go above it: beyond the horizon a small `ndf` may make them
/// as large as it likes, and only the first node there counts.
fn bounded(ratios: &[f64], above: &[bool]) -> Vec<f32> {
    let most = ratios.iter().zip(above).filter(|(_, above)| **above);
    let most = most.fold(0.0, |most: f64, (ratio, _)| most.max(ratio.abs()));
    ratios.iter().map(|ratio| ratio.max(-most) as f32).collect()
}

/// The density that places the nodes.
fn spread(theta_i: f64, ndf: impl Fn([f64; 2]) -> f64) -> Vec<f32> {
    let (visible, even): (Vec<f64>, Vec<f64>) = (0..VNDF.nodes())
        .map(|index| {
            let point = [
                coordinate(index % VNDF.columns, VNDF.columns),
                coordinate(index / VNDF.columns, VNDF.rows),
            ];
            let place = Place::of(theta_i, point);
            let normals = ndf(point) * place.cos_d.max(0.0) * solid_angle(point);
            let of_interest = of_interest(place.cos_o);
            (of_interest * normals.sqrt(), of_interest)
        })
        .unzip();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let [of_visible, of_even] = [VISIBLE / mean(&visible), (1.0 - VISIBLE) / mean(&even)];
    let both = visible.iter().zip(&even);
    both.map(|(visible, even)| (of_visible * visible + of_even * even) as f32)
        .collect()
}

/// How closely nodes are wanted where theta_o has this cosine: hardly below the horizon, and most just
/// above it, where BRDF times cosine is nearly 0 and so any error large beside it.
fn of_interest(cos_o: f64) -> f64 {
    let above = 1.0 / (1.0 + (-(cos_o + 0.12) / 0.04).exp());
    let near = 1.5 * (-(cos_o / 0.2).powi(2)).exp();
    (0.05 + above) * (1.0 + near)
}
