//! The error of all fallible functions, with stable numbers for the link and for C.

use serde::{Deserialize, Serialize};

/// An error: its code, the field of a recipe that it concerns, and two numbers.
///
/// The link transmits it without the field. A host also receives and prints codes that it does not know.
///
/// ```
/// use glimpse_core::error::{Error, ErrorCode};
///
/// let error = Error::with(ErrorCode::Memory, [120, 100]);
/// assert_eq!(error.code.number(), 50);
/// assert_eq!(
///     error.to_string(),
///     "the recipe needs more memory than the firmware has: compute the length with `recipe::memory_words`, \
///      or `glimpse_scan_bytes` in C (words needed: 120, words available: 100)"
/// );
///
/// let newer = Error::with(ErrorCode::from_number(999), [7, 0]);
/// assert_eq!(
///     newer.to_string(),
///     "an error that this version does not know: update it (code: 999, details: 7, 0)"
/// );
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Error {
    /// The kind of error.
    pub code: ErrorCode,
    /// The name of the recipe's field, such as "ridge.rows", as in `core/docs/recipe.md`. Empty for most errors.
    #[serde(skip)]
    pub field: &'static str,
    /// Numbers whose meaning depends on the code. The documentation of each code lists them in order. Unused ones are
    /// 0. An angle is the bits of an f32, in radians.
    pub details: [u32; 2],
}

impl Error {
    /// Creates an error without details.
    #[must_use]
    pub const fn new(code: ErrorCode) -> Self {
        Self::with(code, [0; 2])
    }

    /// Creates an error with details.
    #[must_use]
    pub const fn with(code: ErrorCode, details: [u32; 2]) -> Self {
        Self {
            code,
            field: "",
            details,
        }
    }

    /// Creates an error that concerns this field.
    #[must_use]
    pub const fn in_field(code: ErrorCode, field: &'static str) -> Self {
        Self {
            field,
            ..Self::new(code)
        }
    }

    /// Returns true if the fit has a result, but its readings are unlikely to come from a material.
    #[must_use]
    pub const fn is_implausible(&self) -> bool {
        matches!(self.code.0, 84..=95)
    }
}

impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.code.text())?;
        let Some(formats) = self.code.details() else {
            let [first, second] = self.details;
            return write!(f, " (code: {}, details: {first}, {second})", self.code.0);
        };
        let mut separator = " (";
        if !self.field.is_empty() {
            write!(f, "{separator}field: {}", self.field)?;
            separator = ", ";
        }
        for ((format, label), value) in formats.iter().zip(self.details) {
            let name =
                |names: &[&'static str]| names.get(value as usize).copied().unwrap_or("unknown");
            match format {
                Format::Section if value == 0 => continue,
                Format::Number | Format::Section => write!(f, "{separator}{label}: {value}"),
                Format::Checksum => write!(f, "{separator}{label}: {value:08x}"),
                Format::Model => write!(f, "{separator}{label}: {}", name(&MODELS)),
                Format::Arm => write!(f, "{separator}{label}: {}", name(&ARMS)),
                Format::Signed => write!(f, "{separator}{label}: {}", value.cast_signed()),
                Format::Axis => write!(f, "{separator}{label}: {}", name(&AXES)),
                Format::Angle => {
                    let degrees = Decimal(f32::from_bits(value).to_degrees());
                    write!(f, "{separator}{label}: {degrees} degrees")
                }
            }?;
            separator = ", ";
        }
        f.write_str(if separator == ", " { ")" } else { "" })
    }
}

impl core::error::Error for Error {}

/// The format of a detail in a message.
enum Format {
    Number,
    /// The kind of a recipe's section. It is omitted if it is 0.
    Section,
    Checksum,
    /// The number of a model.
    Model,
    /// The number of an arm.
    Arm,
    /// The number of an axis.
    Axis,
    /// The bits of an i32.
    Signed,
    /// The bits of an f32 in radians.
    Angle,
}

/// The models' names by number.
const MODELS: [&str; 4] = ["phong", "neural", "cook-torrance", "linear"];
/// The arms' names by number.
const ARMS: [&str; 2] = ["light", "sensor"];
/// The axes' names by number.
const AXES: [&str; 4] = [
    "theta_i (lamp)",
    "phi_i (lamp)",
    "theta_o (sensor)",
    "phi_o (sensor)",
];

/// A number from 0 to 4 million, formatted with three decimals. Other numbers are clamped.
///
/// The formatting uses integers, because the core library's formatting of floats takes more flash and can panic.
pub(crate) struct Decimal(pub(crate) f32);

impl core::fmt::Display for Decimal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let thousandths = (1000.0 * self.0 + 0.5) as u32; // saturates
        write!(f, "{}.{:03}", thousandths / 1000, thousandths % 1000)
    }
}

/// A stable number for each kind of error.
///
/// The link transmits these numbers, and the C library returns them. The meaning of a number never changes. Of the
/// numbers that are not listed here, the C library uses 7, 16, 17, 19, 21, 83, and negative ones. 40 to 42, 49, 91 and
/// 107 are not used.
///
/// ```
/// use glimpse_core::error::ErrorCode;
///
/// assert_eq!(ErrorCode::RecipeMagic.number(), 32);
/// assert_eq!(ErrorCode::from_number(32), ErrorCode::RecipeMagic);
/// assert_eq!(format!("{:?}", ErrorCode::RecipeMagic), "RecipeMagic");
/// assert_eq!(format!("{:?}", ErrorCode::from_number(9_999)), "ErrorCode(9999)");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(transparent)]
pub struct ErrorCode(u16);

impl ErrorCode {
    /// Returns the code with this number. This version may not know it.
    #[must_use]
    pub const fn from_number(number: u16) -> Self {
        Self(number)
    }

    /// Returns the code's number.
    #[must_use]
    pub const fn number(self) -> u16 {
        self.0
    }
}

impl core::fmt::Debug for ErrorCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.name() {
            Some(name) => f.write_str(name),
            None => write!(f, "ErrorCode({})", self.0),
        }
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for ErrorCode {
    fn format(&self, f: defmt::Formatter<'_>) {
        match self.name() {
            Some(name) => defmt::write!(f, "{=str}", name),
            None => defmt::write!(f, "ErrorCode({=u16})", self.0),
        }
    }
}

/// Defines the codes with their numbers, texts, and details: the format and the label of each. The first line is the
/// text of an unknown code.
macro_rules! error_codes {
    (
        _, $unknown:literal;
        $($name:ident = $number:literal, $text:literal $(, $format:ident $label:literal)*;)+
    ) => {
        #[allow(non_upper_case_globals)]
        impl ErrorCode {
            $(
                #[doc = concat!("Number ", $number, ": ", $text, ".")]
                $(#[doc = concat!("\n- ", $label)])*
                pub const $name: Self = Self($number);
            )+

            /// All codes of this version.
            pub const ALL: &'static [Self] = &[$(Self::$name,)+];

            /// Returns a description without details: what is wrong, and what to do.
            #[must_use]
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)+
                    _ => $unknown,
                }
            }

            /// Returns the [text](Self::text) for C, with a zero byte at its end.
            #[must_use]
            pub const fn zero_terminated_text(self) -> &'static str {
                match self {
                    $(Self::$name => concat!($text, "\0"),)+
                    _ => concat!($unknown, "\0"),
                }
            }

            const fn name(self) -> Option<&'static str> {
                match self {
                    $(Self::$name => Some(stringify!($name)),)+
                    _ => None,
                }
            }

            /// Returns the format and the label of each detail; None for an unknown code.
            const fn details(self) -> Option<&'static [(Format, &'static str)]> {
                match self {
                    $(Self::$name => Some(&[$((Format::$format, $label),)*]),)+
                    _ => None,
                }
            }
        }
    };
}

error_codes! {
    _, "an error that this version does not know: update it";

    BufferTooSmall = 5, "the buffer is too small for the result: use a larger one";

    Incomplete = 18, "readings are missing: record them",
        Number "missing readings", Number "first";
    Unfinished = 20, "the fit is not complete: advance it until all units are done",
        Number "units done", Number "units in all";
    NotScanning = 22, "the scan is finished, has failed, or does not exist: resume or restart it before readings";
    StoreLayout = 23, "the store's areas are too small, beyond the flash, or not whole sectors: change the layout";
    WhiteNotBrighter = 25, "the white is not brighter than dark: check the lamp, and the order of both",
        Number "channel";
    WhiteReflectance = 26, "the white's reflectance is not above 0 and at most 2: give a fraction, not per cent",
        Number "channel";
    WhiteSaturated = 27, "the white is saturated: reduce the exposure of white and sample",
        Number "channel";
    ChannelNonFinite = 28, "a channel of dark, white or sample is not a finite number: read it again",
        Number "channel";

    RecipeMagic = 32, "the bytes are not a recipe, which starts with GLMP: train one with `trainer train`";
    RecipeVersion = 33, "the recipe has an unknown format version: train again, or update the firmware",
        Number "version";
    RecipeLength = 34, "the recipe was cut or padded: store all of its bytes again",
        Number "bytes by the header", Number "bytes found";
    RecipeChecksum = 35, "the recipe's checksum is wrong, because its bytes were altered: store it again";
    RecipeMalformed = 36, "the recipe's body does not follow the format: train again";
    RecipeCount = 37, "a field of the recipe has an impossible count: train again";
    RecipeNonFinite = 38, "a field of the recipe holds a NaN or an infinity: train again";
    RecipeBelowHorizon = 39, "a direction of the recipe's pattern is below the horizon: train again",
        Number "sample";
    RecipeRange = 43, "a field of the recipe holds a number out of range: train again";
    Limits = 44, "the machine's limits are invalid: polar angles have to be above 0 and at most pi/2 (radians), the separation from 0 to their sum";
    RecipeUnknown = 45, "the recipe has a required section that the firmware does not know: enable the feature `ridge`, or update the firmware",
        Section "section";
    RecipeSections = 46, "a section of the recipe is missing, out of order, or does not follow the format: train again",
        Section "section";
    RecipeHeader = 47, "the recipe's header states other sizes than its sections have: train again",
        Number "samples stated", Number "words stated";

    Model = 48, "the recipe's model is not the firmware's: change the firmware's model or the recipe",
        Model "firmware", Model "recipe";
    Memory = 50, "the recipe needs more memory than the firmware has: compute the length with `recipe::memory_words`, or `glimpse_scan_bytes` in C",
        Number "words needed", Number "words available";
    Basis = 51, "the basis is not the one that the recipe names: export the recipe's basis, or use none if the recipe names none",
        Checksum "named by the recipe", Checksum "of this basis";
    BasisMagic = 52, "the bytes are not a compact basis, which starts with GLMC: `trainer export --format basis` writes one";
    BasisVersion = 53, "the compact basis has an unknown format version: export it again",
        Number "version";
    BasisLength = 54, "the compact basis was cut or padded: export it again",
        Number "bytes by the header", Number "bytes found";
    BasisChecksum = 55, "the compact basis's checksum is wrong, because its bytes were altered: export it again";
    BasisMalformed = 56, "the compact basis has an impossible count or scale: export it again";

    ReadingNonFinite = 64, "a channel of the reading is not a finite number: read it again",
        Number "sample", Number "channel";
    ReadingNegative = 65, "a channel of the reading is below -1 sr^-1, too far below 0 to be noise: check the dark reading",
        Number "sample", Number "channel";
    ReadingIndex = 66, "the recipe's pattern has no sample with this index: use an index below the number of samples",
        Number "index", Number "samples";
    ReadingRequired = 67, "a sample was skipped, but the recipe needs every reading: train one with `--missing`",
        Number "sample";

    ReadingsTooLarge = 80, "more than three quarters of the readings are too large for a BRDF: convert counts or percent to sr^-1",
        Number "limit in sr^-1";
    Diverged = 81, "the fit diverged, because the recipe describes no material with such readings: check the units (sr^-1, not counts) and the sensor's range";
    Directions = 82, "a direction is not a finite unit vector above the horizon: its length has to be 1 within 0.001, and z positive, along the sample's normal",
        Arm "arm";
    Dark = 84, "the readings are not above 0: check the dark reading";
    Repeated = 85, "all readings are equal: check that the sensor is not stuck";
    DeadRed = 86, "the red channel reads 0 while others do not: check its filter and amplifier";
    DeadGreen = 87, "the green channel reads 0 while others do not: check its filter and amplifier";
    DeadBlue = 88, "the blue channel reads 0 while others do not: check its filter and amplifier";
    Albedo = 89, "the material reflects several times the light it receives: the readings may be percent, pi times the BRDF, or not divided by the white reading";
    Residual = 90, "the fit explains its readings far worse than expected: check alignment, units and the sensor";
    RoomLight = 92, "the readings with the lamp off are too large a part of those with it: check the lamp, darken the room, and calibrate again";
    Drift = 93, "the sample read again at the end differs: let the lamp warm up, keep the room light constant, and check the axes";
    Saturated = 94, "too many readings are saturated: reduce the exposure of white and sample";
    Restored = 95, "all readings are from before a restart of the device: if the material has changed since, scan it again";

    Machine = 96, "the device's own arms or sensor failed: see its log";
    Protocol = 97, "the host speaks another version of the protocol: update the device or the host",
        Number "device", Number "host";
    NoReply = 98, "the host does not reply: check that it runs, and the line";
    RefusedNoScan = 99, "the host refused because no scan has begun: begin again with a hello";
    RefusedDirections = 100, "the host refused because it cannot reach these directions: train within its limits";
    RefusedValues = 101, "the host refused because the model has another number of values: update the device or the host";
    RefusedModel = 102, "the host refused because it does not support this model: use another recipe";
    RefusedRestored = 103, "the host refused because it has not sent this reading: read all samples again";
    OutOfReach = 105, "samples of the recipe are out of reach: train within the machine's limits",
        Number "first sample", Number "samples";
    RefusedRequest = 106, "the host refused because it does not support this request: update the host";
    Storage = 108, "the flash could not be read, written or erased: check the layout's offset";
    FrameTooLong = 109, "the frame is too long: use a buffer of `FRAME_BYTES`";
    FrameDamaged = 110, "the frame was cut or altered in transit: ignore it, because the device sends it again";
    FrameUnknown = 111, "the frame holds an unknown message: compare the protocol versions";

    MaxThetaI = 112, "the light's polar angle is above the limit `max_theta_i`: choose a direction within reach",
        Angle "excess";
    MaxThetaO = 113, "the sensor's polar angle is above the limit `max_theta_o`: choose a direction within reach",
        Angle "excess";
    MinSeparation = 114, "light and sensor are closer than the limit `min_separation`: choose a direction within reach",
        Angle "deficit";
    InPlane = 115, "light, normal and sensor are not in one plane, as the limit `in_plane` requires: choose a direction within reach",
        Angle "deviation";
    MissingAxis = 116, "the directions need an axis that the machine lacks, because its speed is 0: choose a direction within reach";

    TileTooFew = 120, "the tile has fewer than three readings: take more";
    TileReading = 121, "a reading of the tile is not positive and finite, or its directions are not unit vectors above the horizon: read it again, and check the angles of the arms",
        Number "reading";
    TileSpread = 122, "the tile's readings scatter about every known quantity: average more of them, and check for stray light, and microsteps and gear of the lamp's polar axis",
        Number "per cent";
    TileAmbiguous = 123, "more than one quantity explains the tile's readings: spread theta_i and theta_o independently over 0 to 60 degrees, or average more readings";
    TileOther = 124, "the tile's readings are not the BRDF: check the larger spot, and the microsteps, gear and switch of the lamp's polar axis",
        Number "quantity, 1: times cos(theta_i), 2: times cos(theta_o)";

    Stopped = 128, "the operator stopped the arms: go on with a command";
    LostSteps = 129, "steps were lost between two homings: check current, speed and bearings, and read the samples again",
        Axis "axis", Signed "steps";
    SwitchOpened = 130, "the home switch opened away from home: check its contact, and the axis for lost steps",
        Axis "axis", Signed "steps from home";
    SwitchStuck = 131, "the home switch stays open while the axis leaves it: check its wiring (normally closed), the motor's supply, and `reversed`",
        Axis "axis";
    SwitchNotFound = 132, "the home switch did not open within the travel: check the motor's supply and the switch; then reset the device",
        Axis "axis";
    SwitchBounces = 133, "the home switch's contact never settles: check its plug and the cable's shield",
        Axis "axis";
    Pin = 134, "a pin of the axis returned an error: check its configuration",
        Axis "axis";
    NotHomed = 135, "the arms have to be homed before a move: home them";
    Moving = 136, "the arms are moving: wait until they rest";
    NoSafeRoute = 137, "no route keeps lamp and sensor apart: check `min_separation`, and the limits of the azimuths";
    AxisReach = 138, "the angle is out of the axis's reach: check its limits, and those of the recipe",
        Axis "axis", Angle "angle";
    AxisSettings = 139, "a field of the axis's settings is out of range: see its documentation",
        Axis "axis";
    HomeTooClose = 140, "lamp and sensor come closer than `min_separation` while they are homed: move a home switch";
    Scale = 141, "the far switch is not at its angle: check microsteps, gear and `steps_per_radian`",
        Axis "axis", Signed "steps from there";
    Direction = 142, "the home switch did not open within 5 degrees of the first move: turn the arm onto its switch by hand with the power off; if it is there, change `reversed`",
        Axis "axis";
    LampPin = 143, "the pin of the lamp returned an error: check its configuration";
    Sensor = 144, "the sensor does not answer: check its wiring and supply";
    SensorReset = 145, "the sensor has lost its settings, or has no valid counts: check its supply";
    SensorStuck = 146, "the sensor's counts stay the same, bit for bit, at different directions: check the sensor";
    LampStuck = 147, "the counts with the lamp off are too large: check the lamp's switch, and darken the room",
        Number "counts";
    NotCalibrated = 148, "the device has no calibration: put the white tile on the sample's place, and hold the button";
}

impl ErrorCode {
    /// Returns true if the device's own arms, sensor, lamp or operator caused the error.
    #[must_use]
    pub const fn is_machine(self) -> bool {
        matches!(self.0, 96 | 128..=159)
    }
}
