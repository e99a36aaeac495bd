//! Settings in error messages.
//!
//! The name of a setting depends on the front end: the command line has options, Python has parameters. An error
//! therefore holds a [`Setting`], and the front end inserts its own name.

macro_rules! settings {
    ($($(#[$description:meta])* $setting:ident $name:literal,)+) => {
        /// A setting that an error message refers to.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Setting { $($(#[$description])* $setting,)+ }

        impl Setting {
            /// Returns the default name, for callers without a front end.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$setting => $name,)+ }
            }
        }
    };
}

settings! {
    /// Additive noise in training.
    Additive "additive",
    /// Sources of training materials.
    Materials "materials",
    /// The largest polar angle of the light.
    MaxThetaI "max_theta_i",
    /// The largest polar angle of the sensor.
    MaxThetaO "max_theta_o",
    /// The evaluated method.
    Method "method",
    /// The smallest angle between light and sensor.
    MinSeparation "min_separation",
    /// The share of training tasks with missing readings.
    Missing "missing",
    /// Relative noise in training.
    Noise "noise",
    /// The share of procedural materials.
    Procedural "procedural",
    /// The evaluated recipe.
    Recipe "recipe",
    /// The training schedule.
    Schedule "schedule",
    /// The share of each source in training.
    Share "share",
}

/// A function that returns a front end's name of a setting.
pub type SettingNames = fn(Setting) -> &'static str;

/// An error whose message names settings. Its `Display` uses [`Setting::name`].
pub trait SettingError {
    /// Returns the message with the setting names of a front end.
    fn message(&self, name: SettingNames) -> String;
}
