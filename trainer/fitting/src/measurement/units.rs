//! Stated units of a table's columns.

use glimpse_materials::untrusted::escaped;

use super::conventions::AngleUnit;
use super::layout::{DEGREES, PER_STERADIAN, RADIANS, Unit, is_value, wavelength};
use super::names::simplified;
use super::table::{Table, TableError};

impl Table {
    /// Returns the stated unit of a column of angles: DEGREES or RADIANS.
    ///
    /// # Errors
    /// If a unit is unknown, or differs from another one of the column.
    pub(super) fn angle_unit(&self, column: &str) -> Result<Option<AngleUnit>, TableError> {
        let mut stated = None;
        let units = self.layout.units.iter();
        for unit in units.filter(|unit| unit.column == column) {
            let angle_unit = match &unit.text[..] {
                text if DEGREES.contains(&text) => AngleUnit::Degrees,
                text if RADIANS.contains(&text) => AngleUnit::Radians,
                _ => return Err(self.unit_error(unit, "deg or rad")),
            };
            if *stated.get_or_insert(angle_unit) != angle_unit {
                return Err(self.unit_error(unit, "one unit for the column"));
            }
        }
        Ok(stated)
    }

    /// Returns the line, the column and the quantity of each statement in the names and units of readings.
    ///
    /// # Errors
    /// If a unit is unknown, or differs from that of another column.
    pub(super) fn stated_quantities(&self) -> Result<Vec<(usize, String, String)>, TableError> {
        let labels = self.layout.labels.iter().zip(&self.layout.names);
        let named = labels.filter_map(|(label, name)| {
            let quantity = match &simplified(label)[..] {
                "counts" => "counts",
                "reflectancefactor" | "radiancefactor" => "reflectance-factor",
                other if is_value(name) && (other.starts_with("brdf") || other == "bsdf") => "brdf",
                _ => return None,
            };
            Some((self.layout.line, name.clone(), quantity.to_owned())).filter(|_| is_value(name))
        });
        let mut stated: Vec<_> = named.collect();
        let units = self.layout.units.iter();
        let mut first = None;
        for unit in units.filter(|unit| is_value(&unit.column)) {
            let text = &unit.text[..];
            let is_wavelength = text == "nm" && wavelength(&unit.column).is_some();
            let quantity = match text {
                "%" | "percent" => Some("reflectance-percent"),
                "counts" | "count" | "dn" | "adu" => Some("counts"),
                _ if PER_STERADIAN.contains(&text) => None,
                _ if is_wavelength || ["1", "-"].contains(&text) => continue,
                _ if text.starts_with("count") => {
                    let remedy = "no unit, --white in counts per the same time, and subtract the dark counts from both";
                    return Err(self.unit_error(unit, remedy));
                }
                _ => {
                    let remedy = "1/sr, or no unit and the quantity of the readings as an option";
                    return Err(self.unit_error(unit, remedy));
                }
            };
            if *first.get_or_insert(quantity) != quantity {
                return Err(self.unit_error(unit, "the same unit for all readings"));
            }
            let quantity =
                quantity.map(|quantity| (unit.line, unit.column.clone(), quantity.to_owned()));
            stated.extend(quantity);
        }
        Ok(stated)
    }

    /// Returns the factor of a column's unit among some units; 1 without a unit.
    pub(super) fn factor(&self, column: &str, units: &[(&str, f32)]) -> Result<f32, TableError> {
        let mut stated = self.layout.units.iter();
        let Some(stated) = stated.find(|unit| unit.column == column) else {
            return Ok(1.0);
        };
        let factor = units.iter().find(|(unit, _)| *unit == stated.text);
        let names: Vec<&str> = units.iter().map(|(unit, _)| *unit).collect();
        let error = || self.unit_error(stated, &names.join(" or "));
        factor.map(|(_, factor)| *factor).ok_or_else(error)
    }

    fn unit_error(&self, Unit { line, column, text }: &Unit, remedy: &str) -> TableError {
        let text = escaped(text);
        let message = format!("column {column}: its unit is `{text}`; give {remedy}");
        self.line_error(*line, &message)
    }
}
