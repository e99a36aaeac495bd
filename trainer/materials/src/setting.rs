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
            pub fn name(self) -> String {
                match self { $(Self::$setting => $name,)+ }.to_owned()
            }
        }
    };
}

settings! {
    /// Additive noise.
    Additive "additive",
    /// The choice to write tables as fitted.
    AsFitted "as_fitted",
    /// The number of principal components of the model linear.
    Bases "bases",
    /// The precision of the coefficients of the model linear.
    Eta "eta",
    /// The number of leading readings in an evaluation.
    First "first",
    /// The format of a written material.
    Format "format",
    /// The restriction of a machine to one plane.
    InPlane "in_plane",
    /// The number of quantization levels.
    Levels "levels",
    /// The number of readings to drop in an evaluation.
    Lose "lose",
    /// Sources of training materials.
    Materials "materials",
    /// The largest polar angle of the light.
    MaxThetaI "max_theta_i",
    /// The largest polar angle of the sensor.
    MaxThetaO "max_theta_o",
    /// The smallest angle between light and sensor.
    MinSeparation "min_separation",
    /// The share of training tasks with missing readings.
    Missing "missing",
    /// The model.
    Model "model",
    /// Relative noise.
    Noise "noise",
    /// Directions that the instrument fixes.
    Pattern "pattern",
    /// The share of procedural materials.
    Procedural "procedural",
    /// The evaluated recipe.
    Recipe "recipe",
    /// The number of samples.
    Samples "samples",
    /// The longest time of a scan.
    ScanSeconds "scan_seconds",
    /// The training schedule.
    Schedule "schedule",
    /// The time at each sample.
    Settle "settle",
    /// The share of each source in training.
    Share "share",
    /// The speeds of the axes.
    Speed "speed",
}

impl Setting {
    /// The limits of a machine's arms.
    pub const LIMITS: [Self; 3] = [Self::MaxThetaI, Self::MaxThetaO, Self::MinSeparation];
}

/// A function that returns a front end's name of a setting.
pub type SettingNames = fn(Setting) -> String;

/// An error whose message names settings. Its `Display` uses [`Setting::name`].
pub trait SettingError {
    /// Returns the message with the setting names of a front end.
    fn message(&self, name: SettingNames) -> String;
}
