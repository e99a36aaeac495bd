//! The directions at which a material was measured.

use std::fmt;
use std::path::PathBuf;

/// The directions at which a material was measured. `trainer/docs/formats.md` states the rules.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Coverage {
    /// The BRDF is known at all directions.
    #[default]
    Complete,
    /// A table with unmeasured nodes, which are filled from measured ones.
    Filled {
        /// The share of these nodes among those above the horizon, 0 to 0.5.
        share: f64,
    },
    /// Files with one incoming direction each.
    Incidences {
        /// Each file and its theta_i in degrees, sorted by theta_i.
        files: Vec<(PathBuf, f64)>,
        /// The share of directions at which the BRDF is unknown, 0 to 1.
        unknown: f64,
    },
}

impl Coverage {
    /// Returns the share of directions at which the BRDF is unknown, 0 to 1. It is NaN there.
    #[must_use]
    pub fn unknown(&self) -> f64 {
        match self {
            Self::Incidences { unknown, .. } => *unknown,
            Self::Complete | Self::Filled { .. } => 0.0,
        }
    }
}

impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Complete => write!(f, "measured at all directions"),
            Self::Filled { share } => write!(
                f,
                "{:.2} % of its directions were not measured, and are filled from neighboring ones",
                100.0 * share
            ),
            Self::Incidences { files, unknown } => {
                let files = files.iter().map(|(path, theta_i)| {
                    let name = path.file_name().unwrap_or_default();
                    format!("{theta_i} ({})", name.to_string_lossy())
                });
                let files: Vec<String> = files.collect();
                write!(f, "measured at theta_i {} degrees", files.join(", "))?;
                match unknown {
                    0.0 => Ok(()),
                    _ => write!(
                        f,
                        "; its BRDF is unknown at {:.1} % of all directions",
                        100.0 * unknown
                    ),
                }
            }
        }
    }
}
