//! Lights that chrome balls reflect.

use std::array::from_fn;

use super::ball::{Ball, PixelView, dot, unit};
use super::picture::LinearPicture;

/// The cosine of the largest angle between a light's middle and its edge, 15 degrees.
const MIN_COSINE: f64 = 0.9659;
/// The smallest z of a light whose reflection is not at the rim.
const MIN_Z: f64 = -0.9;

/// A reason for which the direction of a light is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChromeError {
    /// The brightest pixels are not together, or are a large part of the ball.
    #[error("the chrome ball has no single small highlight; darken the room, or move the lamp")]
    Spread,
    /// The highlight is at the rim.
    #[error("the highlight is at the chrome ball's rim; move the lamp toward the camera")]
    Rim,
}

/// Finds the unit vector toward the light that a chrome ball reflects: the normal at the highlight is half-way between it and
/// the camera.
///
/// The light is the middle of what is at least half as bright as the brightest pixel. Far reflections of it may be a quarter of
/// that.
///
/// # Errors
/// If the ball has several highlights, a large one, or one at the rim.
pub fn chrome_light(picture: &LinearPicture, ball: &Ball) -> Result<[f64; 3], ChromeError> {
    let pixels = picture.pixels.iter().enumerate();
    let lights = pixels.filter_map(|(index, pixel)| {
        let PixelView { normal, outgoing } = ball.view(picture.place(index))?;
        let factor = 2.0 * dot(normal, outgoing);
        let light = from_fn(|axis| factor * normal[axis] - outgoing[axis]);
        Some((light, pixel.iter().sum::<f32>()))
    });
    let brightest = lights.clone().map(|light| light.1).fold(0.0, f32::max);
    let bright = lights.filter(|light| light.1 >= 0.5 * brightest);
    let bright: Vec<[f64; 3]> = bright.map(|light| light.0).collect();
    let first = middle(&bright);
    let mut near = bright.clone();
    near.retain(|light| dot(*light, first) > MIN_COSINE);
    match middle(&near) {
        _ if 4 * near.len() <= 3 * bright.len() => Err(ChromeError::Spread),
        [_, _, z] if z < MIN_Z => Err(ChromeError::Rim),
        light => Ok(light),
    }
}

/// Returns the middle of directions; NaN if there are none.
fn middle(directions: &[[f64; 3]]) -> [f64; 3] {
    let sum = |axis: usize| directions.iter().map(|direction| direction[axis]).sum();
    unit(from_fn(sum))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::Camera;

    /// Traces rays of a camera over a mirror of radius 1 to lights of radius 2 degrees.
    fn trace(focal_length: f64, lights: &[[f64; 3]]) -> LinearPicture {
        let toward = |x: f64, y: f64| unit([x - 200.0, 200.0 - y, -focal_length]);
        let middle = toward(210.0, 190.0);
        let distance = (1.0 - dot(middle, toward(360.0, 190.0)).powi(2)).powf(-0.5);
        let pixel = |index: u32| {
            let ray = toward((index % 400).into(), (index / 400).into());
            let along = distance * dot(middle, ray);
            let hit = along - (along * along - distance * distance + 1.0).sqrt();
            let normal: [f64; 3] = from_fn(|axis| hit * ray[axis] - distance * middle[axis]);
            let reflected = from_fn(|axis| ray[axis] - 2.0 * dot(ray, normal) * normal[axis]);
            let is_lit = |light: &[f64; 3]| dot(*light, reflected) > 0.9994;
            [if lights.iter().any(is_lit) { 0.9 } else { 0.1 }; 3]
        };
        LinearPicture {
            width: 400,
            height: 400,
            pixels: (0..160_000).map(pixel).collect(),
        }
    }

    #[test]
    fn traced_lights_are_found() {
        let axis = [200.0; 2];
        for (focal_length, is_far) in [(1e6, true), (400.0, false)] {
            let camera = Camera { focal_length, axis };
            let ball = Ball {
                center: [210.0, 190.0],
                radius: 150.0,
                camera: (!is_far).then_some(camera),
            };
            let find = |lights: &[[f64; 3]]| chrome_light(&trace(focal_length, lights), &ball);
            for light in [
                [0.0, 0.0, 1.0],
                [-0.48, 0.64, 0.6],
                [0.6, 0.0, 0.8],
                [0.0, -0.8, -0.6],
            ] {
                let found = find(&[light]).unwrap();
                assert!(dot(found, light) > 0.99996, "{light:?}: {found:?}"); // 0.5 degrees
            }
            assert_eq!(find(&[]), Err(ChromeError::Spread));
            assert_eq!(
                find(&[[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]]),
                Err(ChromeError::Spread)
            );
            assert_eq!(find(&[[0.0, 0.4, -0.9165]]), Err(ChromeError::Rim));
        }
    }
}
