//! Half and difference vectors, which models read.

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

impl<S: Scalar> HalfDifference<S> {
    /// All coordinates 0: no direction, but where sums of gradients begin.
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = S::constant(0.0);
        Self {
            hx: zero,
            hz: zero,
            dx: zero,
            dy: zero,
            dz: zero,
        }
    }

    /// From angles in radians.
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

impl HalfDifference<f32> {
    /// From a pair of unit directions. None if a direction is not finite or the two are
    /// opposite, so that no half vector exists.
    #[must_use]
    pub fn from_directions(directions: &Directions<f32>) -> Option<Self> {
        let [ix, iy, iz] = directions.incoming;
        let [ox, oy, oz] = directions.outgoing;
        let (x, y, z) = (ix + ox, iy + oy, iz + oz);
        let length = math::sqrt(x * x + y * y + z * z);
        // Written so that a NaN is refused as well.
        if !(length > 1e-6 && length.is_finite()) {
            return None;
        }
        let (x, y, hz) = (x / length, y / length, z / length);
        let hx = math::sqrt(x * x + y * y);
        // Turn about z by -phi_h, then about y by -theta_h. At the pole phi_h = 0.
        let (cos, sin) = if hx > 1e-7 {
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

    /// True if both directions are above the horizon: cos(theta_i) > 0 and cos(theta_o) > 0.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.cos_theta_i() > 0.0 && self.cos_theta_o() > 0.0
    }
}
