//! One PAB-Opto file: a header, and values by outgoing direction.

use crate::color::{FROM_XYZ, product};
use crate::error::{Defect, ensure};
use crate::untrusted::escaped;

/// The starts of header lines that identify the format.
const SIGNATURES: [&str; 4] = [
    "#format: theta phi",
    "#intheta",
    "#incident_angle",
    "#colorimetry:",
];

/// The header key of the number of value lines. Only this program writes it.
pub(super) const VALUE_COUNT: &str = "#values";
/// The header key of all theta_i of the set, in degrees. Only this program writes it.
pub(super) const SET_THETA_I: &str = "#set_intheta";

/// Returns true if the first bytes of a file contain one of [`SIGNATURES`].
pub(crate) fn has_signature(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    text.starts_with('#') && SIGNATURES.iter().any(|signature| text.contains(signature))
}

/// Returns the name of the sample in a file's header; None if it is empty.
pub(super) fn sample_name(text: &str) -> Option<&str> {
    let name = header_value(text, "#sample_name")?.trim_matches('"');
    (!name.is_empty()).then_some(name)
}

/// Returns the numbers of theta_i and phi_i in a file's header, in degrees.
pub(super) fn incoming_angles(text: &str) -> Vec<f64> {
    let lines = ["#intheta", "#inphi", "#incident_angle"].map(|key| header_value(text, key));
    let words = lines.into_iter().flatten().flat_map(str::split_whitespace);
    words.filter_map(|word| word.parse().ok()).collect()
}

/// Returns the text after a key in a file's header.
fn header_value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let lines = text.lines().take_while(|line| line.starts_with('#'));
    lines
        .filter_map(|line| line.strip_prefix(key))
        .map(str::trim)
        .next()
}

/// theta_o and phi_o in degrees, and the BRDF there in linear RGB, sr^-1 (not times the cosine).
pub(crate) type OutgoingValue = ([f64; 2], [f32; 3]);

/// The measurement at one incoming direction.
pub(crate) struct Incidence {
    /// Polar angle of the incoming direction, in degrees.
    pub(crate) theta_i: f64,
    /// Azimuth of the incoming direction, in degrees.
    pub(crate) phi_i: f64,
    pub(crate) values: Vec<OutgoingValue>,
    /// All theta_i of the set in degrees, if the header lists them.
    pub(crate) set_theta_i: Option<Vec<f64>>,
}

/// The color space of a line's values.
#[derive(Clone, Copy)]
enum Colorimetry {
    /// CIE Y: one value.
    Y,
    /// CIE XYZ: three values.
    Xyz,
}

impl Incidence {
    /// Parses a file's text.
    pub(super) fn parse(text: &str) -> Result<Self, Defect> {
        // A number without its last digits is still a valid number. A line break shows that it is complete.
        ensure!(
            text.ends_with('\n'),
            "its last line, `{}`, has no line break and may be incomplete",
            escaped(text.lines().last().unwrap_or_default())
        );
        let unsupported = |field: &str, value: &str, supported: &str| {
            let value = escaped(value);
            Defect::unsupported(format!(
                "its {field} is {value}, and only {supported} are supported"
            ))
        };
        let field = |key: &str| header_value(text, key);
        let required =
            |key: &str| field(key).ok_or_else(|| format!("its header has no line {key}"));
        let is = |value: &str, name: &str| value.eq_ignore_ascii_case(name);
        let colorimetry = match field("#colorimetry:") {
            Some(kind) if is(kind, "CIE-XYZ") => Colorimetry::Xyz,
            Some(kind) if !is(kind, "CIE-Y") => {
                return Err(unsupported("colorimetry", kind, "CIE-XYZ and CIE-Y"));
            }
            _ => Colorimetry::Y,
        };
        let format: Vec<&str> = required("#format:")?.split_whitespace().collect();
        let times_cosine = match format[..] {
            ["theta", "phi", kind] if is(kind, "BRDF") || is(kind, "BSDF") => false,
            ["theta", "phi", kind] if is(kind, "DSF") => true,
            _ => {
                let supported = "`theta phi` with BRDF, BSDF or DSF";
                return Err(unsupported("format", &format.join(" "), supported));
            }
        };
        let pair = field("#incident_angle").and_then(|pair| pair.split_once(char::is_whitespace));
        let (theta_i, phi_i) = match pair {
            Some(pair) => pair,
            None => (required("#intheta")?, required("#inphi")?),
        };
        let [theta_i, phi_i] = [number("intheta", theta_i)?, number("inphi", phi_i.trim())?];
        ensure!(
            (0.0..90.0).contains(&theta_i),
            "its intheta is {theta_i}, and must be at least 0 and below 90 degrees"
        );
        let mut values = Vec::new();
        let mut value_lines = 0;
        let header = text.lines().take_while(|line| line.starts_with('#'));
        let lines = text.lines().enumerate().skip(header.count());
        for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            let value = parse_value(line, colorimetry, times_cosine)
                .map_err(|defect| format!("line {}: {defect}", index + 1))?;
            values.extend(value);
            value_lines += 1;
        }
        ensure!(!values.is_empty(), "it has no value above the horizon");
        let stated = header_value(text, VALUE_COUNT);
        ensure!(
            stated.is_none_or(|stated| stated == value_lines.to_string()),
            "it has {value_lines} lines of values, and its {VALUE_COUNT} is {}",
            escaped(stated.unwrap_or_default())
        );
        let set_theta_i = header_value(text, SET_THETA_I).map(|list| {
            let words = list.split_whitespace();
            words
                .map(|word| number(SET_THETA_I, word))
                .collect::<Result<_, _>>()
        });
        Ok(Self {
            theta_i,
            phi_i,
            values,
            set_theta_i: set_theta_i.transpose()?,
        })
    }
}

/// Parses a finite number.
fn number(name: &str, word: &str) -> Result<f64, String> {
    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{name} is `{}`, and must be a finite number", escaped(word)))
}

/// Parses the angles and the BRDF of a line. Returns None for transmitted light.
fn parse_value(
    line: &str,
    colorimetry: Colorimetry,
    times_cosine: bool,
) -> Result<Option<OutgoingValue>, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (theta, phi, xyz) = match (colorimetry, &words[..]) {
        (Colorimetry::Y, [theta, phi, y]) => (theta, phi, [y; 3]),
        (Colorimetry::Xyz, [theta, phi, x, y, z]) => (theta, phi, [x, y, z]),
        (Colorimetry::Y, _) => return Err("it must have theta, phi and 1 value".to_owned()),
        (Colorimetry::Xyz, _) => return Err("it must have theta, phi and 3 values".to_owned()),
    };
    let (theta, phi) = (number("theta", theta)?, number("phi", phi)?);
    let mut brdf = [0.0; 3];
    for (value, word) in brdf.iter_mut().zip(xyz) {
        *value = number("a value", word)?;
    }
    if !(0.0..90.0).contains(&theta) {
        return Ok(None);
    }
    if let Colorimetry::Xyz = colorimetry {
        brdf = product(&FROM_XYZ, brdf);
    }
    let cosine = if times_cosine {
        theta.to_radians().cos()
    } else {
        1.0
    };
    // Colors outside the RGB gamut have negative components, which are set to 0.
    let brdf = brdf.map(|value| (value / cosine).clamp(0.0, f64::from(f32::MAX)) as f32);
    Ok(Some(([theta, phi], brdf)))
}
