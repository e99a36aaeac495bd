//! Names of settings in error messages.
//!
//! The same setting is an option on the command line and a parameter in Python. An error message refers to it by
//! [`Name`], which follows the style of the front end.

use std::fmt;
use std::sync::OnceLock;

static STYLE: OnceLock<fn(&str) -> String> = OnceLock::new();

/// Sets the style of all names in this process, once. By default they are the names of Python's parameters.
pub fn set_name_style(style: fn(&str) -> String) {
    // A second call would have the same style: a process has one front end.
    let _ = STYLE.set(style);
}

/// A setting in a message, by the name of its parameter in Python, with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name<'a>(pub &'a str);

impl Name<'_> {
    /// The largest polar angle of the light.
    pub const MAX_THETA_I: Name<'static> = Name("max_theta_i_degrees");
    /// The largest polar angle of the sensor.
    pub const MAX_THETA_O: Name<'static> = Name("max_theta_o_degrees");
    /// The smallest angle between light and sensor.
    pub const MIN_SEPARATION: Name<'static> = Name("min_separation_degrees");
    /// The restriction to one plane.
    pub const IN_PLANE: Name<'static> = Name("in_plane");
    /// The speeds of the axes.
    pub const SPEED: Name<'static> = Name("speed_degrees_per_second");
    /// The time at each sample.
    pub const SETTLE: Name<'static> = Name("settle_seconds");
}

impl fmt::Display for Name<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match STYLE.get() {
            Some(style) => f.write_str(&style(self.0)),
            None => f.write_str(self.0),
        }
    }
}
