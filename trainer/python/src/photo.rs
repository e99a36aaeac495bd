//! Readings of photographs.

use glimpse_fitting::photo::{Ball, Camera, Light, LinearPicture, Photograph, choose, set_albedo};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, directions_of, numbers, rows};
use crate::error::{Result, reject};
use crate::interruptible::run_detached;

/// Turns linear photographs of a ball under distant lights into readings at directions, as `trainer photo` does.
///
/// `pictures` has the shape (k, height, width, 3). Saturated pixels are inf, and unknown ones NaN. `lights` are the
/// vectors toward the light of each, (k, 3): x right, y up, z toward the camera. A pixel divided by `intensities`, (k, 3), is
/// the BRDF times cos(theta_i). Without them, pass `albedo`, the median of pi times the BRDF, to which the values are then relative.
/// `circle` is the ball's outline: column, row, radius in pixels; by default it is found. `field_of_view_degrees`
/// is the full angle of the width, of a camera that is near.
///
/// Returns a dict: directions, float64 of shape (n, 2, 3); brdf (n, 3) and noise (n,), for `Recipe.fit`; pixels, int64 of shape
/// (n, 3): photograph, column, row; and circle.
#[pyfunction]
#[pyo3(signature = (pictures, lights, *, intensities=None, albedo=None, circle=None, field_of_view_degrees=None))]
pub(crate) fn photo<'py>(
    py: Python<'py>,
    pictures: &Bound<'py, PyAny>,
    lights: &Bound<'py, PyAny>,
    intensities: Option<&Bound<'py, PyAny>>,
    albedo: Option<f64>,
    circle: Option<[f64; 3]>,
    field_of_view_degrees: Option<f64>,
) -> Result<Bound<'py, PyDict>> {
    let array = numbers(pictures, "pictures")?;
    let &[count, height, width, 3] = array.shape() else {
        return reject("pictures must have the shape (k, height, width, 3)");
    };
    if intensities.is_none() && albedo.is_none() {
        return reject("the scale is unknown: pass intensities, or albedo for relative values");
    }
    let flat: Vec<f32> = array.iter().map(|value| *value as f32).collect();
    let pixels = flat.as_chunks().0.chunks((width * height).max(1));
    let pictures = pixels.map(|pixels| LinearPicture {
        width,
        height,
        pixels: pixels.to_vec(),
    });
    let pictures: Vec<LinearPicture> = pictures.collect();
    let vectors = |argument, name| -> Result<Vec<[f64; 3]>> {
        let flat: Vec<f64> = rows(argument, name, (Some(count), 3), "")?
            .into_iter()
            .collect();
        Ok(flat.as_chunks().0.to_vec())
    };
    let lights = vectors(lights, "lights")?;
    let intensities = intensities.map(|array| vectors(array, "intensities"));
    let intensities = intensities.transpose()?;
    let (readings, ball) = run_detached(py, || {
        let found = circle.map(Ball::distant).or_else(|| Ball::find(&pictures));
        let Some(mut ball) = found else {
            return reject("no circle is found: pass circle");
        };
        ball.camera = field_of_view_degrees.map(|angle| Camera::new(angle, width, height));
        let mut photographs = Vec::new();
        for (index, (picture, vector)) in pictures.into_iter().zip(lights).enumerate() {
            let light = Light::new(vector, intensities.as_ref().map(|all| all[index]));
            let invalid = || format!("light {index} does not reach the visible half of the ball");
            photographs.push(Photograph {
                name: index.to_string(),
                picture,
                light: light.map_or_else(|| reject(invalid()), Ok)?,
                ball,
            });
        }
        if let Some(albedo) = albedo {
            set_albedo(&mut photographs, albedo);
        }
        let mut uses: Vec<_> = photographs.iter().map(Photograph::uses).collect();
        Ok((choose(&photographs, &mut uses), ball))
    })??;
    let found = PyDict::new(py);
    let directions = readings
        .iter()
        .map(|one| directions_of(one.angles.map(|angle| angle as f32)));
    found.set_item("directions", Array::pairs(directions))?;
    found.set_item("brdf", Array::rows(readings.iter().map(|one| one.brdf)))?;
    found.set_item("noise", Array::list(readings.iter().map(|one| one.noise)))?;
    let pixels = readings.iter().map(|one| {
        [one.photograph, one.index % width, one.index / width].map(|place| place as i64)
    });
    found.set_item("pixels", Array::rows(pixels))?;
    found.set_item("circle", (ball.center[0], ball.center[1], ball.radius))?;
    Ok(found)
}
