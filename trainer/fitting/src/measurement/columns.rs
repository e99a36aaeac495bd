//! Columns of a table: their roles and names, and their units.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use super::conventions::AngleUnit;

/// The column of sample indices in a measurement plan of `trainer plan`.
pub(super) const INDEX: &str = "index";
/// The columns of readings by a sensor with three channels.
pub(super) const CHANNELS: [&str; 3] = ["r", "g", "b"];
/// The column of readings by a sensor with one channel.
pub(super) const MONOCHROME: &str = "value";

/// The columns of readings in CIELAB.
pub(super) const CIELAB: [&str; 3] = ["l*", "a*", "b*"];
/// The column of instruments.
pub(super) const INSTRUMENT: &str = "instrument";

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
    /// Marks of valid and invalid rows, or of BRDFs and BTDFs.
    Selection,
    /// The exposure of counts.
    Exposure,
    /// The name of the sample.
    Sample,
    /// The wavelength or the channel of a row's reading.
    Channel,
    /// The instrument of the readings.
    Instrument,
    /// The full angle of a cone of light or sensor.
    Spread,
    /// The place of the reading, such as a pixel, by its name in reports.
    Place,
    /// A coordinate of a color that is neither linear RGB nor CIELAB, which are not supported.
    Unsupported,
    /// A note, a result of this program, or the same text in all rows, which is not read.
    Unused,
    /// A column of the option `--ignore`.
    Ignored,
}

/// Roles, the names by which readers know columns, and other names. Only their letters, digits and asterisks count. A name that
/// could have two meanings (`theta_s`, of a source or of scattered light) is not listed.
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
reading l* l ciel* cielab-l*
reading a* ciea* cielab-a*
reading b* cieb* cielab-b*
reading value brdf bsdf reflectancefactor radiancefactor counts
quantity quantity
noise noise relativenoise
saturated saturated issaturated overflow overrange overexposed clipped
selection valid isvalid flag quality qualityflag status
selection scatter scattertype scattermode measurement measurementtype bsdftype
exposure exposure exposuretime integrationtime
sample sample samplename sampleid specimen material materialname
instrument instrument device
spread spread_i
spread spread_o
place place
unsupported color hue saturation chroma lightness
channel wavelength lambda wl
channel channel color colour
unused note notes comment comments remark remarks operator user date time datetime timestamp no nr number row line point id \
file filename seconds aspecular deltae temperature humidity";

/// Units at the end of names.
const SUFFIXES: [&str; 9] = [
    "", "nm", "ms", "us", "s", "deg", "degrees", "rad", "radians",
];

/// The meaning of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unit {
    /// That of angles.
    Angle(AngleUnit),
    /// The factor of relative numbers, s or nm.
    Factor(f32),
    /// That of a BRDF, with or without cosines.
    PerSteradian,
    /// That of another quantity of readings, by its name.
    Quantity(&'static str),
}

impl Unit {
    /// Returns the meaning of a text, in lowercase and without white space, in a column of a role; None if it has none.
    pub(super) fn find(role: Role, text: &str) -> Option<Self> {
        use Role::{Channel, Direction, Exposure, Noise, Reading, Spread};
        Some(match (role, text) {
            (Direction | Spread, "deg" | "degree" | "degrees" | "°" | "º") => {
                Self::Angle(AngleUnit::Degrees)
            }
            (Direction, "rad" | "radian" | "radians") => Self::Angle(AngleUnit::Radians),
            (Reading, "1/sr" | "sr^-1" | "sr-1" | "sr⁻¹" | "/sr") => Self::PerSteradian,
            (Reading, "%" | "percent") => Self::Quantity("reflectance-percent"),
            (Reading, "counts" | "count" | "dn" | "adu") => Self::Quantity("counts"),
            (Noise, "%" | "percent") => Self::Factor(0.01),
            (Exposure, "ms") => Self::Factor(1e-3),
            (Exposure, "us" | "µs" | "μs") => Self::Factor(1e-6),
            (Channel, "um" | "µm" | "μm") => Self::Factor(1e3),
            (Reading | Noise, "1" | "-") | (Exposure, "s") | (Channel, "nm") => Self::Factor(1.0),
            _ => return None,
        })
    }

    /// Returns the factor of numbers.
    pub(super) fn factor(self) -> f32 {
        match self {
            Self::Factor(factor) => factor,
            _ => 1.0,
        }
    }
}

/// A column of a table.
#[derive(Clone)]
pub(crate) struct Column {
    /// The name in the file in lowercase, without a unit.
    pub(super) label: String,
    /// The name by which readers know the column, or else the label.
    pub(super) name: String,
    /// None if the name is unknown.
    pub(super) role: Option<Role>,
    /// The lines that state a unit, and its text in lowercase, without white space and brackets.
    pub(super) units: Vec<(usize, String)>,
}

impl Column {
    /// Reads the name in a cell of a line, and the unit after it, in brackets or at the end of the name.
    pub(super) fn new(line: usize, cell: &str) -> Self {
        let unit = cell.find(['(', '[']).filter(|_| cell.ends_with([')', ']']));
        let (label, unit) = cell.split_at(unit.unwrap_or(cell.len()));
        let label = label.trim().to_lowercase();
        let band = wavelength(&label).map(|_| Role::Reading);
        let (known, suffix) = find(&label).unzip();
        let mut column = Self {
            name: known.map_or(label.clone(), |(_, name)| name.to_owned()),
            role: known.map_or(band, |(role, _)| Some(role)),
            label,
            units: Vec::new(),
        };
        column.add_unit(line, suffix.filter(|_| unit.is_empty()).unwrap_or(unit));
        column
    }

    /// Adds the unit in a cell. Returns true if its meaning is known.
    pub(super) fn add_unit(&mut self, line: usize, cell: &str) -> bool {
        let is_kept = |c: &char| !c.is_whitespace() && !"()[]".contains(*c);
        let text: String = cell.to_lowercase().chars().filter(is_kept).collect();
        if text.is_empty() || text == "nm" && wavelength(&self.name).is_some() {
            return false;
        }
        let is_known = self
            .role
            .is_some_and(|role| Unit::find(role, &text).is_some());
        self.units.push((line, text));
        is_known
    }

    /// Returns true if the cells are numbers.
    pub(super) fn has_numbers(&self) -> bool {
        use Role::{Channel, Direction, Exposure, Index, Noise, Reading, Spread};
        matches!(
            self.role,
            Some(Direction | Index | Reading | Noise | Exposure | Channel | Spread)
        )
    }

    /// Returns true if a table of readings has at most one column of the name.
    pub(super) fn is_unique(&self) -> bool {
        let others = [Role::Quantity, Role::Saturated, Role::Instrument];
        self.has_numbers() || self.role.is_some_and(|role| others.contains(&role))
    }
}

/// Finds the role, the name by which readers know it, and the unit at the end of a column's name.
fn find(label: &str) -> Option<((Role, &'static str), &'static str)> {
    let label = simplified(label);
    SUFFIXES.into_iter().find_map(|suffix| {
        let label = label.strip_suffix(suffix)?;
        let mut lines = NAMES.lines().map(|line| line.split(' '));
        let mut words =
            lines.find(|words| words.clone().skip(1).any(|word| simplified(word) == label))?;
        let role = Role::from_str(words.next()?, false).ok()?;
        let is_unit = suffix.is_empty() || Unit::find(role, suffix).is_some();
        words
            .next()
            .filter(|_| is_unit)
            .map(|name| ((role, name), suffix))
    })
}

/// Returns the letters and digits of a name, in lowercase, and asterisks, such as that of b*.
pub(super) fn simplified(name: &str) -> String {
    let characters = name.chars().filter(|c| c.is_alphanumeric() || *c == '*');
    characters.flat_map(char::to_lowercase).collect()
}

/// Returns true if two names differ only in capitals and separators of words.
pub(super) fn is_same(one: &str, other: &str) -> bool {
    let name = simplified(one);
    one == other || !name.is_empty() && name == simplified(other)
}

/// Returns the wavelength in nm of a column of readings in a band: `390`, `390nm` or `w390`.
pub(super) fn wavelength(name: &str) -> Option<f32> {
    let number = name.strip_prefix('w').unwrap_or(name);
    let number = number.strip_suffix("nm").unwrap_or(number);
    let is_number = number.starts_with(|first: char| first.is_ascii_digit());
    let wavelength = number.trim_end().parse().ok().filter(|_| is_number);
    wavelength.filter(|wavelength| (200.0..=2600.0).contains(wavelength))
}
