//! Settings that errors name.
//!
//! The library does not know what a front end calls a setting: the command line has options, Python has
//! parameters. An error therefore holds a [`Setting`], and the front end puts in the name.

/// A setting that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// Additive noise that training prepares for.
    Additive,
    /// Sources of training materials.
    Materials,
    /// The largest polar angle of the light.
    MaxThetaI,
    /// The largest polar angle of the sensor.
    MaxThetaO,
    /// The method that is evaluated.
    Method,
    /// The least angle between light and sensor.
    MinSeparation,
    /// The share of training tasks with missing readings.
    Missing,
    /// Relative noise that training prepares for.
    Noise,
    /// The share of procedural materials.
    Procedural,
    /// The recipe that is evaluated.
    Recipe,
    /// The schedule of training.
    Schedule,
    /// The proportions of several sources.
    Share,
}

impl Setting {
    /// Its name where no front end gives it another one.
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

/// The name that a front end gives to a setting.
pub type SettingNames = fn(Setting) -> &'static str;

/// An error that names settings.
pub trait SettingError {
    /// The message, with the names of a front end.
    fn message(&self, name: SettingNames) -> String;
}

/// Implements `Display` for an error that names settings: by the names of [`Setting::name`].
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
