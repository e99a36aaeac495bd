//! Half and difference vectors, the input of models.

use super::directions::normalize;
use super::{Angles, Directions};
use crate::numeric::{Scalar, Trigonometry, math};

/// Half vector and difference vector in Cartesian coordinates, turned so that phi_h = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HalfDifference<T> {
    /// x of the half vector, sin(theta_h).
    pub hx: T,
    /// z of the half vector, cos(theta_h). (y is 0.)
    pub hz: T,
    /// x of the difference vector, sin(theta_d) cos(phi_d).
    pub dx: T,
    /// y of the difference vector, sin(theta_d) sin(phi_d).
    pub dy: T,
    /// z of the difference vector, cos(theta_d).
    pub dz: T,
}

impl<T: Copy> HalfDifference<T> {
    /// Creates half and difference vectors in the order hx, hz, dx, dy, dz.
    #[inline(always)]
    #[must_use]
    pub const fn from_array([hx, hz, dx, dy, dz]: [T; 5]) -> Self {
        Self { hx, hz, dx, dy, dz }
    }

    /// Returns the coordinates in the order hx, hz, dx, dy, dz.
    #[inline(always)]
    #[must_use]
    pub const fn to_array(self) -> [T; 5] {
        [self.hx, self.hz, self.dx, self.dy, self.dz]
    }
}

impl<S: Scalar> HalfDifference<S> {
    /// Returns coordinates of 0, the initial value for sums of gradients.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::from_array([S::constant(0.0); 5])
    }

    /// Converts angles in radians.
    #[inline]
    pub fn from_angles(angles: Angles<S>) -> Self
    where
        S: Trigonometry,
    {
        let (hx, hz) = angles.theta_h.sin_cos();
        let (sin_d, dz) = angles.theta_d.sin_cos();
        let (sin_phi, cos_phi) = angles.phi_d.sin_cos();
        Self {
            hx,
            hz,
            dx: sin_d * cos_phi,
            dy: sin_d * sin_phi,
            dz,
        }
    }

    /// cos(theta_i), the cosine between normal and incoming direction.
    #[inline(always)]
    pub fn cos_theta_i(&self) -> S {
        self.hz * self.dz - self.hx * self.dx
    }

    /// cos(theta_o), the cosine between normal and outgoing direction.
    #[inline(always)]
    pub fn cos_theta_o(&self) -> S {
        self.hz * self.dz + self.hx * self.dx
    }

    /// The pair of directions, with the half vector in the xz plane.
    #[inline]
    pub fn directions(&self) -> Directions<S> {
        let along = self.dx * self.hz;
        let up = self.dz * self.hx;
        Directions {
            incoming: [up + along, self.dy, self.cos_theta_i()],
            outgoing: [up - along, -self.dy, self.cos_theta_o()],
        }
    }
}

/// The sin(theta_h) below which the half vector counts as the normal.
///
/// In f32, the half vector has an error of about e = 1e-7. This error turns its azimuth, and with it phi_d, by e /
/// sin(theta_h); at the pole, the azimuth is arbitrary. Replacing the half vector by the pole moves it by theta_h. The
/// two errors are equal at theta_h = sqrt(e), 3e-4 rad or 0.02 degrees, which is finer than arms move. Above, the error
/// of phi_d is at most as large (near grazing angles, times 1 / cos(theta_d)).
const POLE: f32 = 3e-4;

/// The cos(theta_d), half the length of the sum of both unit directions, below which they count as opposite.
const OPPOSITE: f32 = 1e-5;

fn length(x: f32, y: f32, z: f32) -> f32 {
    math::sqrt(x * x + y * y + z * z)
}

impl HalfDifference<f32> {
    /// Converts a pair of directions. None if a direction is not finite or not a unit vector within
    /// 0.001, or if the two are opposite and have no half vector. Directions below
    /// the horizon are accepted: see [`is_valid`](Self::is_valid).
    ///
    /// If both directions turn about the normal, the result changes only by rounding. For this, phi_d is 0 if the half
    /// vector is the normal within 3e-4 rad and both directions are above the horizon. There, rounding would determine
    /// phi_d, and an isotropic BRDF does not depend on it. ([`from_angles`](Self::from_angles) keeps any phi_d.)
    #[inline]
    #[must_use]
    pub fn from_directions(directions: &Directions<f32>) -> Option<Self> {
        let [ix, iy, iz] = normalize(directions.incoming)?;
        let [ox, oy, oz] = normalize(directions.outgoing)?;
        let (x, y, z) = (ix + ox, iy + oy, iz + oz);
        let twice = length(x, y, z);
        if twice < 2.0 * OPPOSITE {
            return None;
        }
        let (x, y, hz) = (x / twice, y / twice, z / twice);
        let hx = length(x, y, 0.0);
        if hx < POLE && iz > 0.0 && oz > 0.0 {
            return Some(Self {
                hx: 0.0,
                hz: 1.0,
                dx: 0.5 * length(ix - ox, iy - oy, iz - oz),
                dy: 0.0,
                dz: 0.5 * twice,
            });
        }
        // Turn about z by -phi_h, then about y by -theta_h.
        let (cos, sin) = if hx > 0.0 {
            (x / hx, y / hx)
        } else {
            (1.0, 0.0)
        };
        let turned = ix * cos + iy * sin;
        Some(Self {
            hx,
            hz,
            dx: turned * hz - iz * hx,
            dy: iy * cos - ix * sin,
            dz: turned * hx + iz * hz,
        })
    }

    /// Returns true if both directions are above the horizon: cos(theta_i) > 0 and cos(theta_o) > 0.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.cos_theta_i() > 0.0 && self.cos_theta_o() > 0.0
    }
}
