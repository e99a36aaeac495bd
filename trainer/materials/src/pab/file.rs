//! One file: a header, and values by outgoing direction.

use super::{FROM_XYZ, times};
use crate::untrusted::escaped;

/// What a line of the header may begin with; others are passed over.
const KEYS: [&str; 4] = [
    "#format: theta phi",
    "#intheta",
    "#incident_angle",
    "#colorimetry:",
];

/// Where the header says how many lines of values follow, and all theta_i of the set, in degrees. They
/// are this program's own.
pub(super) const VALUES: &str = "#values";
pub(super) const SET: &str = "#set_intheta";

/// True of bytes that begin as such a file does.
pub(crate) fn begins(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    text.starts_with('#') && KEYS.iter().any(|key| text.contains(key))
}

/// The name of the sample that a file says it is of.
pub(super) fn sample_of(text: &str) -> Option<&str> {
    entry_of(text, "#sample_name")
}

/// What follows a key in a file's header.
fn entry_of<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let lines = text.lines().take_while(|line| line.starts_with('#'));
    lines
        .filter_map(|line| line.strip_prefix(key))
        .map(str::trim)
        .next()
}

/// theta_o and phi_o in degrees, and the BRDF in linear RGB, sr^-1.
pub(super) type Value = ([f64; 2], [f32; 3]);

/// What was measured at one incoming direction.
pub(super) struct Incidence {
    /// Degrees.
    pub(super) theta_i: f64,
    pub(super) phi_i: f64,
    pub(super) values: Vec<Value>,
    /// All theta_i of its set, if it says them: this program's files do.
    pub(super) set: Option<Vec<f64>>,
}

/// Numbers of a line beside its angles.
#[derive(Clone, Copy)]
enum Colors {
    Gray,
    Xyz,
}

impl Incidence {
    /// Reads a file's text.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        // What is cut in a number is a number still.
        if !text.ends_with('\n') {
            let last = text.lines().last().unwrap_or_default();
            return Err(format!(
                "its last line, `{}`, has no end: it was cut short; get it again, or end the line if \
                 it is whole",
                escaped(last)
            ));
        }
        let (mut colors, mut times_cosine) = (Colors::Gray, None);
        let (mut theta_i, mut phi_i) = (None, None);
        let header = text.lines().take_while(|line| line.starts_with('#'));
        for line in header.clone() {
            let mut words = line[1..].split_whitespace();
            let key = words.next().unwrap_or_default();
            let words: Vec<&str> = words.collect();
            match (key, &words[..]) {
                ("colorimetry:", [kind]) => {
                    colors = match kind.to_ascii_uppercase().as_str() {
                        "CIE-XYZ" => Colors::Xyz,
                        "CIE-Y" => Colors::Gray,
                        _ => {
                            return Err(format!(
                                "its colorimetry is {}, and CIE-XYZ and CIE-Y are read; convert its values",
                                escaped(kind)
                            ));
                        }
                    }
                }
                ("format:", ["theta", "phi", kind]) => {
                    times_cosine = match kind.to_ascii_uppercase().as_str() {
                        "BRDF" | "BSDF" => Some(false),
                        "DSF" => Some(true),
                        _ => {
                            return Err(format!(
                                "its format is {}, and BRDF, BSDF and DSF are read; take it away",
                                escaped(kind)
                            ));
                        }
                    }
                }
                ("intheta", [value]) => theta_i = Some(number("intheta", value)?),
                ("inphi", [value]) => phi_i = Some(number("inphi", value)?),
                ("incident_angle", [theta, phi]) => {
                    theta_i = Some(number("incident_angle", theta)?);
                    phi_i = Some(number("incident_angle", phi)?);
                }
                _ => {}
            }
        }
        let lacks = |what: &str| format!("its header has no line {what}; add it");
        let times_cosine = times_cosine.ok_or_else(|| lacks("#format: theta phi BRDF"))?;
        let theta_i = theta_i.ok_or_else(|| lacks("#intheta DEGREES"))?;
        let phi_i = phi_i.ok_or_else(|| lacks("#inphi DEGREES"))?;
        if !(0.0..90.0).contains(&theta_i) {
            return Err(format!(
                "its intheta is {theta_i}, and light from 0 up to 90 degrees is read; take it away"
            ));
        }
        let mut values = Vec::new();
        let first = header.count();
        for (index, line) in text.lines().enumerate().skip(first) {
            if line.trim().is_empty() {
                continue;
            }
            let value = value(line, colors, times_cosine)
                .map_err(|what| format!("line {}: {what}", index + 1))?;
            values.extend(value);
        }
        if values.is_empty() {
            return Err("it has no value above the horizon; get it again".to_owned());
        }
        let lines = text
            .lines()
            .skip(first)
            .filter(|line| !line.trim().is_empty())
            .count();
        if let Some(promised) = entry_of(text, VALUES)
            && promised != lines.to_string()
        {
            return Err(format!(
                "it has {lines} lines of values where its {VALUES} says {}: it was cut short or \
                 added to; get it again",
                escaped(promised)
            ));
        }
        let set = entry_of(text, SET).map(|set| {
            let each = set.split_whitespace();
            each.map(|word| number(SET, word)).collect()
        });
        Ok(Self {
            theta_i,
            phi_i,
            values,
            set: set.transpose()?,
        })
    }
}

/// A finite number.
fn number(what: &str, word: &str) -> Result<f64, String> {
    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| {
        format!(
            "{what} is `{}`, which is no finite number; get it again",
            escaped(word)
        )
    })
}

/// Angles and BRDF of a line; None where it is of light that goes through.
fn value(line: &str, colors: Colors, times_cosine: bool) -> Result<Option<Value>, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (theta, phi, xyz) = match (colors, &words[..]) {
        (Colors::Gray, [theta, phi, y]) => (theta, phi, [y; 3]),
        (Colors::Xyz, [theta, phi, x, y, z]) => (theta, phi, [x, y, z]),
        _ => {
            let expected = match colors {
                Colors::Gray => "theta, phi and 1 value",
                Colors::Xyz => "theta, phi and 3 values",
            };
            return Err(format!(
                "it has {} words where its header promises {expected}; get it again",
                words.len()
            ));
        }
    };
    let (theta, phi) = (number("theta", theta)?, number("phi", phi)?);
    let mut brdf = [0.0; 3];
    for (value, word) in brdf.iter_mut().zip(xyz) {
        *value = number("a value", word)?;
    }
    if !(0.0..90.0).contains(&theta) {
        return Ok(None);
    }
    if let Colors::Xyz = colors {
        brdf = times(&FROM_XYZ, brdf);
    }
    let cosine = if times_cosine {
        theta.to_radians().cos()
    } else {
        1.0
    };
    // Colors outside of the triangle of RGB have no place there.
    let brdf = brdf.map(|value| (value / cosine).clamp(0.0, f64::from(f32::MAX)) as f32);
    Ok(Some(([theta, phi], brdf)))
}
