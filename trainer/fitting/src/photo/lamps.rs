//! The lamps of the photographs to take next.

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use crate::linear::{Posterior, PosteriorReading};
use crate::measurement::NextReading;

/// The numbers of theta_h and phi_d among the pixels.
const PIXELS: [u8; 2] = [12, 6];
/// The smallest cosine of lamp or camera to the normal.
const MIN_COSINE: f32 = 0.12;

/// Returns about 60 pixels of a ball, without their values, with the lamp at an angle from the camera in degrees. At all of them
/// theta_d is half of it. They are denser around the highlight, with theta_h up to 80 degrees.
fn pixels(lamp: f32) -> Vec<PosteriorReading> {
    let [rings, turns] = PIXELS;
    let pixels = (0..rings * turns).filter_map(|index| {
        let ring = (f32::from(index / turns) + 0.5) / f32::from(rings);
        let turn = f32::from(index % turns) / f32::from(turns);
        let degrees = [80.0 * ring * ring, 0.5 * lamp, 180.0 * turn];
        let angles = Angles::from_array(degrees.map(f32::to_radians));
        let at = HalfDifference::from_angles(angles);
        let is_lit = at.cos_theta_i().min(at.cos_theta_o()) > MIN_COSINE;
        is_lit.then(|| PosteriorReading::new(angles, [0.0; 3]))
    });
    pixels.collect()
}

/// Proposes up to `count` lamps at 10, 20 ... 120 degrees from the camera, each one given that photographs of a ball with the
/// earlier ones have their expected pixels: those that leave the smallest expected loss.
#[must_use]
pub fn next_lamps(posterior: &Posterior, count: usize) -> Vec<NextReading> {
    let mut open: Vec<f32> = (1..=12_u8).map(|step| f32::from(10 * step)).collect();
    let mut known = Vec::new();
    let lamps = (0..count).map_while(|_| {
        let after = |lamp: &f32| {
            let readings = [&known[..], &pixels(*lamp)].concat();
            (*lamp, posterior.expected_loss_after(&readings))
        };
        let after = open.par_iter().map(after);
        let (lamp, prediction) = after.min_by(|a, b| a.1.loss.total_cmp(&b.1.loss))?;
        open.retain(|other| *other != lamp);
        known.extend(pixels(lamp));
        Some(NextReading {
            lamp: Some(lamp),
            expected_loss: prediction.loss,
            bound: prediction.bound.unwrap_or(f32::INFINITY),
            ..NextReading::default()
        })
    });
    lamps.collect()
}

#[cfg(test)]
mod tests {
    use glimpse_core::model::ModelKind;

    use super::*;
    use crate::measurement::NamedRecipe;

    #[test]
    fn first_lamp_leaves_the_smallest_loss() {
        let posterior = Posterior::new(&NamedRecipe::any(ModelKind::Linear).prior, &[]);
        let posterior = posterior.expect("finite");
        let lamps = next_lamps(&posterior, 2);
        assert!(lamps[1].expected_loss < lamps[0].expected_loss);
        for lamp in [10.0, 50.0, 90.0, 120.0] {
            let pixels = pixels(lamp);
            assert!(
                (30..=72).contains(&pixels.len()),
                "{lamp}: {}",
                pixels.len()
            );
            let loss = posterior.expected_loss_after(&pixels).loss;
            assert!(lamps[0].expected_loss <= loss, "{lamp}: {loss}");
        }
    }
}
