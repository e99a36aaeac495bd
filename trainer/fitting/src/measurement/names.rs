//! The roles of a table's columns, by their names.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// The role of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// An angle of the directions.
    Direction,
    /// The index of a recipe's sample.
    Index,
    /// Readings, or those of one channel or band.
    Reading,
    /// The quantity of the readings.
    Quantity,
    /// The noise of the readings.
    Noise,
    /// True for a saturated reading.
    Saturated,
    /// True or `ok` for a valid reading.
    Valid,
    /// The exposure of counts.
    Exposure,
    /// BRDF or BTDF.
    Scatter,
    /// The name of the sample.
    Sample,
    /// The instrument, which is not supported yet.
    Instrument,
    /// A coordinate of a color that is not linear RGB, which is not supported.
    Color,
    /// The wavelength or the channel of a row's reading.
    Channel,
    /// A result of this program, which is not read.
    Output,
    /// A note, a time or a number of the row, which is not read.
    Note,
    /// Any other column with the same text in all rows.
    Constant,
    /// A column of the option `--ignore`.
    Ignored,
}

/// Roles, the names by which readers know columns, and other names. Only their letters and digits count. A name that could have
/// two meanings (`theta_s`, of a source or of scattered light) is not listed.
const NAMES: &str = "\
direction theta_h thetahalf
direction theta_d thetadiff
direction phi_d phidiff
direction theta_i thetain thetainc thetaincident thetaincidence thetalight incidentangle incidenceangle angleofincidence θi
direction phi_i phiin phiinc phiincident phiincidence philight φi
direction theta_o thetaout thetaoutgoing thetar thetareflected thetaview thetav thetasensor thetadetector θo θr
direction phi_o phiout phioutgoing phir phireflected phiview phiv phisensor phidetector φo φr
direction phi deltaphi dphi relativeazimuth φ
index index
reading r red brdfr brdfred
reading g green brdfg brdfgreen
reading b blue brdfb brdfblue
reading value brdf bsdf reflectancefactor radiancefactor counts
quantity quantity
noise noise relativenoise
saturated saturated issaturated overflow overrange overexposed clipped
valid valid isvalid
valid flag quality qualityflag status
exposure exposure exposuretime integrationtime
scatter scatter scattertype scattermode measurement measurementtype bsdftype
sample material materialname
sample sample samplename sampleid specimen
instrument instrument device
color hue saturation chroma lightness l
channel wavelength lambda wl
channel channel color colour
note note notes comment comments remark remarks operator user date time datetime timestamp no nr number row line point id \
file filename seconds aspecular deltae temperature humidity";

/// Units at the end of names, and the role of columns whose names may have them.
const UNITS: [(&str, Option<Role>); 9] = [
    ("", None),
    ("nm", Some(Role::Channel)),
    ("ms", Some(Role::Exposure)),
    ("us", Some(Role::Exposure)),
    ("s", Some(Role::Exposure)),
    ("deg", Some(Role::Direction)),
    ("degrees", Some(Role::Direction)),
    ("rad", Some(Role::Direction)),
    ("radians", Some(Role::Direction)),
];

/// A name that is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownName {
    pub(super) role: Role,
    /// The name by which readers know the column.
    pub(super) name: &'static str,
    /// The unit at the end of the name, or nothing.
    pub(super) unit: &'static str,
}

/// Returns the letters and digits of a name, in lowercase.
pub(super) fn simplified(name: &str) -> String {
    let characters = name.chars().filter(|c| c.is_alphanumeric());
    characters.flat_map(char::to_lowercase).collect()
}

/// Returns true if two names differ only in capitals and separators of words.
pub(super) fn is_same(one: &str, other: &str) -> bool {
    one.to_lowercase() == other.to_lowercase()
        || !simplified(one).is_empty() && simplified(one) == simplified(other)
}

impl KnownName {
    /// Finds a name, or else the same name with a unit at its end. An asterisk is part of a name, such as of b*.
    pub(super) fn find(label: &str) -> Option<Self> {
        let label = Some(label)
            .filter(|label| !label.contains('*'))
            .map(simplified)?;
        UNITS.into_iter().find_map(|(unit, only)| {
            let label = label.strip_suffix(unit)?;
            let mut lines = NAMES.lines().map(|line| line.split(' '));
            let mut words =
                lines.find(|words| words.clone().skip(1).any(|word| simplified(word) == label))?;
            let role = Role::from_str(words.next()?, false).ok()?;
            let name = words.next()?;
            only.is_none_or(|only| only == role)
                .then_some(Self { role, name, unit })
        })
    }

    /// Returns true if a table has at most one column of the name.
    pub(super) fn is_unique(&self) -> bool {
        self.has_numbers() || matches!(self.role, Role::Quantity | Role::Saturated | Role::Channel)
    }

    /// Returns true if the name is characteristic of a table of readings.
    pub(super) fn is_characteristic(&self) -> bool {
        self.is_unique() && self.role != Role::Exposure && self.role != Role::Channel
            || self.name == "material"
    }

    /// Returns true if the cells of the column are numbers.
    pub(super) fn has_numbers(&self) -> bool {
        use Role::{Direction, Exposure, Index, Noise, Reading};
        matches!(self.role, Direction | Index | Reading | Noise | Exposure)
            || self.name == "wavelength"
    }
}
