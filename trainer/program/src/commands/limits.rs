//! Limits of a machine's arms as text.

use glimpse_core::gonio::Limits;

/// Describes limits, in degrees.
pub(super) fn describe(limits: Limits) -> String {
    let plane = match limits.in_plane {
        true => ", in one plane with the normal",
        false => "",
    };
    format!(
        "theta_i up to {:.1}, theta_o up to {:.1}, separation at least {:.1} (degrees){plane}",
        limits.max_theta_i.to_degrees(),
        limits.max_theta_o.to_degrees(),
        limits.min_separation.to_degrees(),
    )
}
