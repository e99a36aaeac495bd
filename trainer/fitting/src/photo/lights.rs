//! Lights of photographs.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;

use super::ball::unit;
use crate::measurement::{Table, TableError};

/// The columns of a table of lights; the last three are optional.
const COLUMNS: [&str; 7] = ["picture", "x", "y", "z", "r", "g", "b"];

/// A light far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// The unit vector toward it: x right, y up, z toward the camera.
    pub direction: [f64; 3],
    /// The positive intensity of each channel: a pixel divided by it is BRDF times cos(theta_i). None if it is unknown.
    pub intensity: Option<[f64; 3]>,
}

impl Light {
    /// Creates a light from a vector toward it of any length. None if it does not reach the visible half of the ball, or a number
    /// is not finite, or an intensity not positive.
    #[must_use]
    pub fn new(vector: [f64; 3], intensity: Option<[f64; 3]>) -> Option<Self> {
        let direction = unit(vector);
        let mut intensities = intensity.iter().flatten();
        let is_valid = (-0.999_999..1.1).contains(&direction[2])
            && intensities.all(|channel| (1e-9..1e9).contains(channel));
        is_valid.then_some(Self {
            direction,
            intensity,
        })
    }

    /// Reads a CSV file of lights with the columns `picture`, `x`, `y`, `z`, and `r`, `g`, `b` if intensities are known, in any
    /// order. Returns the lights by the file name of the picture.
    ///
    /// # Errors
    /// If the file cannot be read, or a row is not a light or names the picture of another row.
    pub fn read_table(path: &Path) -> Result<BTreeMap<String, Self>, TableError> {
        let table = Table::read(path, &[])?;
        let count = table.layout.columns.len();
        let names = &COLUMNS[..count.clamp(4, 7)];
        if count != names.len() || !table.has(names) {
            let defect = "but picture, x, y, z or also r, g, b are needed; correct the names";
            return Err(table.columns_error(defect));
        }
        let mut lights = BTreeMap::new();
        for row in &table.rows {
            let remedy = "give the vector toward a light that reaches the visible half of the ball";
            let is_finite = |number: &f64| number.abs() < 1e9;
            let vector = table.numbers(row, &COLUMNS[1..4], is_finite, remedy)?;
            let is_intensity = |number: &f64| (1e-9..1e9).contains(number);
            let intensity = table.numbers(row, &COLUMNS[4..], is_intensity, "give one above 0")?;
            let light = Self::new(
                vector.try_into().unwrap_or_default(),
                intensity.try_into().ok(),
            );
            let message = format!("columns x, y, z: they are not valid; {remedy}");
            let light = light.ok_or_else(|| table.line_error(row.line, &message))?;
            let name = Path::new(table.cell(row, "picture")).file_name();
            let name = name.and_then(OsStr::to_str).unwrap_or_default();
            if lights.insert(name.to_owned(), light).is_some() {
                let message = "column picture: an earlier row has the same name; remove one";
                return Err(table.line_error(row.line, message));
            }
        }
        Ok(lights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_belong_to_pictures_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lights.csv");
        let read = |text: String| {
            std::fs::write(&path, text).unwrap();
            Light::read_table(&path)
        };
        let names = "picture,x,y,z,r,g,b\n1.png,0,4,3,1,2,3";
        let lights = read(format!("{names}\na/2.png,0,0,2,,,")).unwrap();
        assert_eq!(lights["2.png"], Light::new([0.0, 0.0, 1.0], None).unwrap());
        assert_eq!(lights["1.png"].direction, [0.0, 0.8, 0.6]);
        assert_eq!(lights["1.png"].intensity, Some([1.0, 2.0, 3.0]));
        for row in [
            "1.png,0,0,1,,,",
            "2.png,0,0,0,,,",
            "2.png,0,0,-1,,,",
            "2.png,0,0,1,1,0,1",
        ] {
            let message = read(format!("{names}\n{row}")).unwrap_err().to_string();
            assert!(message.contains("line 3"), "{message}");
        }
        for names in ["picture,x,y", "picture,x,y,z,w", "picture,x,y,z,z"] {
            read(format!("{names}\n2.png,0,0,1\n1.png,0,0,1")).unwrap_err();
        }
    }
}
