//! Settings in error messages.
//!
//! The name of a setting depends on the front end: the command line has options, Python has parameters. An error
//! therefore holds a [`Setting`], and the front end inserts its own name.

/// A setting that an error message refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// Additive noise in training.
    Additive,
    /// Sources of training materials.
    Materials,
    /// The largest polar angle of the light.
    MaxThetaI,
    /// The largest polar angle of the sensor.
    MaxThetaO,
    /// The evaluated method.
    Method,
    /// The smallest angle between light and sensor.
    MinSeparation,
    /// The share of training tasks with missing readings.
    Missing,
    /// Relative noise in training.
    Noise,
    /// The share of procedural materials.
    Procedural,
    /// The evaluated recipe.
    Recipe,
    /// The training schedule.
    Schedule,
    /// The share of each source in training.
    Share,
}

impl Setting {
    /// Returns the default name, for callers without a front end.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Additive => "additive",
            Self::Materials => "materials",
            Self::MaxThetaI => "max_theta_i",
            Self::MaxThetaO => "max_theta_o",
            Self::Method => "method",
            Self::MinSeparation => "min_separation",
            Self::Missing => "missing",
            Self::Noise => "noise",
            Self::Procedural => "procedural",
            Self::Recipe => "recipe",
            Self::Schedule => "schedule",
            Self::Share => "share",
        }
    }
}

/// A function that returns a front end's name of a setting.
pub type SettingNames = fn(Setting) -> &'static str;

/// An error whose message names settings.
pub trait SettingError {
    /// Returns the message with the setting names of a front end.
    fn message(&self, name: SettingNames) -> String;
}

/// Implements `Display` for a [`SettingError`](crate::setting::SettingError) with the names of [`Setting::name`].
#[macro_export]
macro_rules! display_with_setting_names {
    ($error:ty) => {
        impl std::fmt::Display for $error {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let name = $crate::setting::Setting::name;
                f.write_str(&$crate::setting::SettingError::message(self, name))
            }
        }
    };
}
