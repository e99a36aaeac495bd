//! Directions at a ball's pixels.

use glimpse_core::geometry::Angles;
use nalgebra::{Rotation3, Vector3};

use crate::measurement::angles_from_vectors;

/// A pinhole camera near the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The distance of the picture's plane, in pixels.
    pub focal_length: f64,
    /// The position of the optical axis in the picture, in pixels.
    pub axis: [f64; 2],
}

/// The outline of a ball in a picture, in pixels from the middle of the top left pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The middle: right and down.
    pub center: [f64; 2],
    /// The radius.
    pub radius: f64,
    /// The camera; None if it is far away.
    pub camera: Option<Camera>,
}

/// A pixel of a ball: unit vectors, with x right, y up and z toward the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelView {
    /// The normal of the surface.
    pub normal: [f64; 3],
    /// The direction toward the camera.
    pub outgoing: [f64; 3],
}

pub(super) fn dot(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

pub(super) fn unit(vector: [f64; 3]) -> [f64; 3] {
    let length = dot(vector, vector).sqrt();
    vector.map(|component| component / length)
}

impl PixelView {
    /// Returns the angles with the light in a direction, a unit vector; None if light or camera is not above the horizon.
    #[must_use]
    pub fn angles(&self, light: [f64; 3]) -> Option<Angles<f32>> {
        let to_local = Rotation3::rotation_between(&self.normal.into(), &Vector3::z())?;
        let local = |direction: [f64; 3]| (to_local * Vector3::from(direction)).into();
        angles_from_vectors(local(light), local(self.outgoing))
    }
}

impl Camera {
    /// Creates a camera whose axis is at the middle of a picture, from the full angle of the picture's width in degrees.
    #[must_use]
    pub fn new(field_of_view: f64, width: usize, height: usize) -> Self {
        let middle = |side: usize| 0.5 * (side as f64 - 1.0);
        Self {
            focal_length: 0.5 * width as f64 / (0.5 * field_of_view.to_radians()).tan(),
            axis: [middle(width), middle(height)],
        }
    }

    /// Returns the unit vector from the camera through a position of the picture.
    fn ray(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        unit([x - self.axis[0], self.axis[1] - y, -self.focal_length])
    }
}

impl Ball {
    /// Creates a ball with a circle as its outline, far from the camera.
    #[must_use]
    pub fn distant([x, y, radius]: [f64; 3]) -> Self {
        Self {
            center: [x, y],
            radius,
            camera: None,
        }
    }

    /// Returns what the picture shows at a position (right and down); None off the ball.
    #[must_use]
    pub fn view(&self, [x, y]: [f64; 2]) -> Option<PixelView> {
        let Some(camera) = &self.camera else {
            let [right, up] = [x - self.center[0], self.center[1] - y].map(|d| d / self.radius);
            let square = 1.0 - right * right - up * up;
            return (square > 0.0).then(|| PixelView {
                normal: [right, up, square.sqrt()],
                outgoing: [0.0, 0.0, 1.0],
            });
        };
        // With the camera at the origin and a ball of radius 1, tangent to the rays through its outline.
        let middle = camera.ray(self.center);
        let rim = camera.ray([self.center[0] + self.radius, self.center[1]]);
        let distance = 1.0 / (1.0 - dot(middle, rim).powi(2)).sqrt();
        let ray = camera.ray([x, y]);
        let along = distance * dot(middle, ray);
        let square = 1.0 + along * along - distance * distance;
        (square > 0.0).then(|| {
            let hit = along - square.sqrt();
            PixelView {
                normal: std::array::from_fn(|axis| hit * ray[axis] - distance * middle[axis]),
                outgoing: ray.map(|component| -component),
            }
        })
    }
}
