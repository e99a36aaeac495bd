//! Stable numbers of all errors, for the link and for C.

/// Defines the codes with their numbers and texts.
macro_rules! error_codes {
    ($($name:ident = $code:literal, $text:literal;)+) => {
        /// A stable number for each kind of error.
        ///
        /// The link transmits these numbers, and the C library returns them. The meaning of a number never changes.
        /// Of the numbers that are not listed here, the C library uses 82, 83, some up to 31, and negative ones. 49 is no
        /// longer used.
        ///
        /// ```
        /// use glimpse_core::error_code::ErrorCode;
        /// use glimpse_core::recipe::Recipe;
        ///
        /// let error = Recipe::parse(b"not a recipe").err().unwrap();
        /// assert_eq!(error.code, ErrorCode::RecipeMagic);
        /// assert_eq!(error.code.code(), 32);
        /// assert_eq!(ErrorCode::from_code(32), Some(ErrorCode::RecipeMagic));
        /// assert_eq!(ErrorCode::from_code(9_999), None); // unknown to this version
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        #[repr(u16)]
        pub enum ErrorCode {
            $(#[doc = $text] $name = $code,)+
        }

        impl ErrorCode {
            /// All codes of this version.
            pub const ALL: &'static [Self] = &[$(Self::$name,)+];

            /// Returns the number.
            #[must_use]
            pub const fn code(self) -> u16 {
                self as u16
            }

            /// Returns the error with this number, or None if this version does not know it.
            #[must_use]
            pub const fn from_code(code: u16) -> Option<Self> {
                Some(match code {
                    $($code => Self::$name,)+
                    _ => return None,
                })
            }

            /// Returns a description without details such as indices.
            #[must_use]
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)+
                }
            }
        }
    };
}

error_codes! {
    BufferTooSmall = 5, "the buffer is too small for the result";

    Incomplete = 18, "a reading is missing";
    Unfinished = 20, "the fit is not complete";
    NotScanning = 22, "the scan is finished, has failed, or does not exist: it takes no readings";

    RecipeMagic = 32, "the bytes are not a recipe";
    RecipeVersion = 33, "the recipe has an unknown format version: train again, or update the firmware";
    RecipeLength = 34, "the recipe was cut or padded";
    RecipeChecksum = 35, "the recipe's checksum is wrong: its bytes were altered";
    RecipeMalformed = 36, "the recipe's body does not follow the format";
    RecipeCount = 37, "a field of the recipe has an impossible count";
    RecipeNonFinite = 38, "a field of the recipe holds a NaN or an infinity";
    RecipeBelowHorizon = 39, "a direction of the recipe's pattern is below the horizon";
    RecipeRange = 43, "a field of the recipe holds a number out of range";
    RecipeUnknown = 45, "the recipe has a required section that the firmware does not know: update the firmware";
    RecipeSections = 46, "a section of the recipe is missing, out of order, or does not follow the format";
    RecipeHeader = 47, "the recipe's header states other sizes than its sections";

    Model = 48, "the recipe's model is not the firmware's";
    Memory = 50, "the recipe needs more memory than the firmware has";
    Basis = 51, "the basis is not the one that the recipe names";
    BasisMagic = 52, "the bytes are not a compact basis";
    BasisVersion = 53, "the compact basis has an unknown format version: export it again";
    BasisLength = 54, "the compact basis was cut or padded";
    BasisChecksum = 55, "the compact basis's checksum is wrong: its bytes were altered";
    BasisMalformed = 56, "the compact basis has an impossible count or scale";

    ReadingNonFinite = 64, "a channel of the reading is not a finite number";
    ReadingNegative = 65, "a channel of the reading is too far below 0 to be noise: check the dark reading";
    ReadingIndex = 66, "the recipe's pattern has no sample with this index";
    ReadingRequired = 67, "a sample was skipped, but the recipe needs every reading";

    TooLarge = 80, "the readings are too large for a BRDF: they have to be in sr^-1, not counts";
    Diverged = 81, "the fit diverged: the recipe describes no material with such readings";
    Dark = 84, "the readings are not above 0: check the dark reading";
    Repeated = 85, "all readings are equal: check that the sensor is not stuck";
    DeadRed = 86, "the red channel reads 0 while others do not: check its filter and amplifier";
    DeadGreen = 87, "the green channel reads 0 while others do not: check its filter and amplifier";
    DeadBlue = 88, "the blue channel reads 0 while others do not: check its filter and amplifier";
    Albedo = 89, "the material reflects several times the light it receives: divide readings by the white reading";
    Residual = 90, "the fit explains its readings far worse than expected: check alignment, units and the sensor";
    ImplausibleOther = 91, "the fit is implausible for a reason that this version does not know";

    Machine = 96, "the device's own arms or sensor failed: see its log";
    Protocol = 97, "the host speaks another version of the protocol";
    NoReply = 98, "the host does not reply";
    RefusedNoScan = 99, "the host refused: no scan has begun";
    RefusedDirections = 100, "the host refused: it cannot reach these directions";
    RefusedValues = 101, "the host refused: the model has another number of values";
    RefusedModel = 102, "the host refused: it does not support this model";
    RefusedSaved = 103, "the host refused: it has not sent this reading";
    RefusedRecipe = 104, "the host refused: this is not the recipe that it offered";
    OutOfReach = 105, "samples of the recipe are out of reach: train within the machine's limits";
    RefusedRequest = 106, "the host refused: it does not support this request";
    RefusedOther = 107, "the host refused for a reason that the device does not know";
    Storage = 108, "the device could not store the recipe: check its flash";
}

impl core::fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.text())
    }
}

/// An error of a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RecipeError {
    /// The code.
    pub code: ErrorCode,
    /// The section and the field, as `ridge.center`; empty if the error is not one of a field.
    pub field: &'static str,
    /// Details. Unused ones are 0.
    pub details: [u32; 2],
}

impl RecipeError {
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
}

impl core::fmt::Display for RecipeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} {} {:?}", self.code, self.field, self.details)
    }
}

impl core::error::Error for RecipeError {}
