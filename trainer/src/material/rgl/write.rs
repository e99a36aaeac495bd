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

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::angular::unit_theta;
use super::distribution::{Cell, Densities, TableShape};
use super::tensor_file::{Values, write};
use crate::material::{Brdf, NotFinite, angles_of};

/// Nodes of `rgb` and `luminance` in each direction.
const SIDE: usize = 96;
/// Nodes of the tables over directions.
const NDF: TableShape = TableShape {
    columns: 1024,
    rows: 2,
};
const SIGMA: TableShape = TableShape {
    columns: 128,
    rows: 2,
};
const VNDF: TableShape = TableShape {
    columns: 128,
    rows: 64,
};
/// The share of the visible normals in `vndf`.
const VISIBLE: f64 = 0.4;
/// theta_d, as shares of what is left of the quarter circle, and phi_d whose mean is a value of `ndf`.
const MEAN_THETA_D: usize = 12;
const MEAN_PHI_D: usize = 5;
/// `ndf` is nowhere less than this share of that of a white surface as bright.
const LEAST_NDF: f64 = 1e-3;
/// By the BRDF at these two cosines of theta_o it is known how BRDF times cosine goes on below the
/// horizon.
const NEAR_HORIZON: [f64; 2] = [1e-4, 0.02];
/// Cosine of theta_m below which `ndf` does not go on falling: it must stay above 0.
const LEAST_COSINE: f64 = 1e-4;
/// Luminance of linear RGB (Rec. 709).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

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

/// Angle of a coordinate of the unit square.
fn theta(u: f64) -> f64 {
    FRAC_PI_2 * u * u
}

/// Coordinate of a column or row of so many.
fn coordinate(index: usize, count: usize) -> f64 {
    index as f64 / (count - 1) as f64
}

/// What is common to all theta_i.
struct Normals {
    ndf: Vec<f32>,
    sigma: Vec<f32>,
}

impl Normals {
    fn of(brdf: &(impl Brdf + ?Sized)) -> Result<Self, NotFinite> {
        let thetas: Vec<f64> = (0..NDF.columns)
            .map(|column| theta(coordinate(column, NDF.columns)))
            .collect();
        let mean = thetas.par_iter().map(|theta| mean(brdf, *theta));
        let mut normals: Vec<f64> = mean.collect::<Result<_, _>>()?;
        for (value, theta) in normals.iter_mut().zip(&thetas) {
            *value *= theta.cos().max(LEAST_COSINE);
        }
        let facing = area(&normals, &thetas, 0.0);
        for (value, theta) in normals.iter_mut().zip(&thetas) {
            let least = LEAST_NDF * theta.cos().max(LEAST_COSINE);
            // A black one has no normals of its own.
            let own = if facing > 0.0 { *value / facing } else { 0.0 };
            *value = own.max(least);
        }
        let sigma = (0..SIGMA.columns).into_par_iter();
        let sigma = sigma
            .map(|column| area(&normals, &thetas, theta(coordinate(column, SIGMA.columns))) as f32);
        let twice = |row: Vec<f32>| row.repeat(2);
        Ok(Self {
            ndf: twice(normals.iter().map(|value| *value as f32).collect()),
            sigma: twice(sigma.collect()),
        })
    }
}

/// Mean luminance of a BRDF at a theta_h.
fn mean(brdf: &(impl Brdf + ?Sized), theta_h: f64) -> Result<f64, NotFinite> {
    let at: Vec<HalfDifference<f32>> = (0..MEAN_THETA_D * MEAN_PHI_D)
        .map(|index| {
            let share = 0.95 * coordinate(index / MEAN_PHI_D, MEAN_THETA_D);
            HalfDifference::from_angles(Angles {
                theta_h: theta_h as f32,
                theta_d: (share * (FRAC_PI_2 - theta_h)) as f32,
                phi_d: (PI * coordinate(index % MEAN_PHI_D, MEAN_PHI_D)) as f32,
            })
        })
        .collect();
    let values = evaluate(brdf, &at)?;
    let sum: f64 = values
        .iter()
        .map(|value| luminance(value.map(f64::from)).max(0.0))
        .sum();
    Ok(sum / at.len() as f64)
}

/// Area that normals show towards a theta_i: the integral of their density times the cosine to it.
fn area(normals: &[f64], thetas: &[f64], theta_i: f64) -> f64 {
    const PHIS: usize = 64;
    let (sin_i, cos_i) = theta_i.sin_cos();
    let step = 1.0 / (normals.len() - 1) as f64;
    let rings = normals.iter().zip(thetas).map(|(density, theta)| {
        let (sin, cos) = theta.sin_cos();
        let shown: f64 = (0..PHIS)
            .map(|phi| {
                let phi = PI * (phi as f64 + 0.5) / PHIS as f64;
                (sin_i * sin * phi.cos() + cos_i * cos).max(0.0)
            })
            .sum();
        // d theta = pi u du, and pi u = sqrt(2 pi theta).
        density * shown * TAU / PHIS as f64 * sin * (TAU * theta).sqrt() * step
    });
    rings.sum()
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

/// Solid angle of normals by area of the unit square.
fn solid_angle([u, _]: [f64; 2]) -> f64 {
    2.0 * PI * PI * u * theta(u).sin()
}

/// Where a point of the unit square looks.
struct Place {
    /// Above the horizon the place itself, twice; below it, two places above, by [`NEAR_HORIZON`].
    at: [HalfDifference<f32>; 2],
    /// cos(theta_o).
    cos_o: f64,
    /// The cosine between w_i and w_m.
    cos_d: f64,
}

impl Place {
    fn of(theta_i: f64, [u, v]: [f64; 2]) -> Self {
        let (sin_i, cos_i) = theta_i.sin_cos();
        let (sin_m, cos_m) = theta(u).sin_cos();
        let (sin_phi, cos_phi) = (PI * (2.0 * v - 1.0)).sin_cos();
        let incoming = [sin_i, 0.0, cos_i];
        let half = [sin_m * cos_phi, sin_m * sin_phi, cos_m];
        let cos_d = sin_i * half[0] + cos_i * half[2];
        let outgoing: [f64; 3] = std::array::from_fn(|i| 2.0 * cos_d * half[i] - incoming[i]);
        let cos_o = outgoing[2];
        let at = if cos_o >= NEAR_HORIZON[0] {
            [seen(incoming, [sin_m, cos_m], [cos_phi, sin_phi]); 2]
        } else {
            NEAR_HORIZON.map(|cosine| raised(incoming, outgoing, cosine))
        };
        Self { at, cos_o, cos_d }
    }
}

/// A pair of directions with the second one raised to this cosine.
fn raised(incoming: [f64; 3], [x, y, _]: [f64; 3], cosine: f64) -> HalfDifference<f32> {
    let sine = (1.0 - cosine * cosine).sqrt();
    let [x, y] = unit(x, y).map(|along| along * sine);
    let [x, y, z] = [x + incoming[0], y, cosine + incoming[2]];
    let across = x.hypot(y);
    seen(incoming, unit(across, z), unit(x, y))
}

/// A vector of the plane, one long; of none, the first axis.
fn unit(x: f64, y: f64) -> [f64; 2] {
    let length = x.hypot(y);
    if length > 0.0 {
        [x / length, y / length]
    } else {
        [1.0, 0.0]
    }
}

/// BRDF times cos(theta_o) at each place; below the horizon as it goes on from above.
fn times_cosine(brdf: &(impl Brdf + ?Sized), places: &[Place]) -> Result<Vec<[f64; 3]>, NotFinite> {
    let [first, second] = [0, 1].map(|which| {
        let at: Vec<HalfDifference<f32>> = places.iter().map(|place| place.at[which]).collect();
        evaluate(brdf, &at)
    });
    let [low, high] = NEAR_HORIZON;
    let both = first?.into_iter().zip(second?).zip(places);
    let values = both.map(|((first, second), place)| {
        std::array::from_fn(|channel| {
            let [first, second] = [first[channel], second[channel]].map(f64::from);
            if place.cos_o >= low {
                return first * place.cos_o;
            }
            let slope = (second * high - first * low) / (high - low);
            first * low + slope * (place.cos_o - low)
        })
    });
    Ok(values.collect())
}

/// A direction of azimuth 0 as seen from a half vector, by sine and cosine of its theta and cosine and
/// sine of its azimuth.
fn seen(
    [x, _, z]: [f64; 3],
    [sin_h, cos_h]: [f64; 2],
    [cos_phi, sin_phi]: [f64; 2],
) -> HalfDifference<f32> {
    let (along, across) = (x * cos_phi, -x * sin_phi);
    HalfDifference {
        hx: sin_h as f32,
        hz: cos_h as f32,
        dx: (along * cos_h - z * sin_h) as f32,
        dy: across as f32,
        dz: (along * sin_h + z * cos_h) as f32,
    }
}

fn luminance(rgb: [f64; 3]) -> f64 {
    rgb.iter()
        .zip(LUMINANCE)
        .map(|(value, weight)| value * weight)
        .sum()
}

/// A BRDF at places, if it is finite at all of them.
fn evaluate(
    brdf: &(impl Brdf + ?Sized),
    at: &[HalfDifference<f32>],
) -> Result<Vec<[f32; 3]>, NotFinite> {
    let mut values = vec![[0.0; 3]; at.len()];
    brdf.evaluate(at, &mut values);
    for (at, value) in at.iter().zip(&values) {
        NotFinite::check(angles_of(at), *value)?;
    }
    Ok(values)
}
