//! One PAB-Opto file: a header, and values by outgoing direction. The files of a set are found by their names and headers.

use std::f64::consts::FRAC_PI_2;
use std::io;
use std::path::{Path, PathBuf};

use super::ANGLE_TOLERANCE;
use crate::SourceError;
use crate::color::{FROM_XYZ, product};
use crate::error::{Defect, ensure, entries, read_error};
use crate::files::directory_of;
use crate::untrusted::{self, escaped, is_text, is_valid_name};

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
    is_text(head, "#", &SIGNATURES)
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
    /// All theta_i of the set in degrees; empty if the header does not list them.
    pub(crate) set_theta_i: Vec<f64>,
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
        // CIE Y or XYZ.
        let value_count = match field("#colorimetry:") {
            Some(kind) if is(kind, "CIE-XYZ") => 3,
            Some(kind) if !is(kind, "CIE-Y") => {
                return Err(unsupported("colorimetry", kind, "CIE-XYZ and CIE-Y"));
            }
            _ => 1,
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
        check_direction(theta_i, phi_i).map_err(|defect| format!("#intheta: {defect}"))?;
        let mut values = Vec::new();
        let header = text.lines().take_while(|line| line.starts_with('#'));
        let lines = text.lines().enumerate().skip(header.count());
        for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            let value = parse_value(line, value_count, times_cosine)
                .map_err(|defect| format!("line {}: {defect}", index + 1))?;
            values.push(value);
        }
        let mut all = values.iter();
        let is_in_radians = all.all(|([theta, phi], _)| theta.max(0.25 * phi.abs()) <= FRAC_PI_2);
        ensure!(
            values.len() < 2 || !is_in_radians,
            "all its theta are at most pi/2 and its phi at most 2 pi, and they must be degrees"
        );
        ensure!(!values.is_empty(), "it has no lines of values");
        let stated = header_value(text, VALUE_COUNT);
        ensure!(
            stated.is_none_or(|stated| stated == values.len().to_string()),
            "it has {} lines of values, and its {VALUE_COUNT} is {}",
            values.len(),
            escaped(stated.unwrap_or_default())
        );
        let set_theta_i = header_value(text, SET_THETA_I).unwrap_or_default();
        let set_theta_i = set_theta_i.split_whitespace();
        let set_theta_i = set_theta_i.map(|word| number(SET_THETA_I, word));
        Ok(Self {
            theta_i,
            phi_i,
            values,
            set_theta_i: set_theta_i.collect::<Result<_, _>>()?,
        })
    }
}

/// Parses a finite number.
fn number(name: &str, word: &str) -> Result<f64, String> {
    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{name} is `{}`, and must be a finite number", escaped(word)))
}

/// Refuses angles in degrees out of range.
fn check_direction(theta: f64, phi: f64) -> Result<(), String> {
    ensure!(
        (0.0..=180.0).contains(&theta) && phi.abs() <= 360.0,
        "theta {theta} and phi {phi} must be 0 to 180 and -360 to 360 degrees"
    );
    Ok(())
}

/// Parses the angles and the BRDF of a line, one value or three.
fn parse_value(
    line: &str,
    value_count: usize,
    times_cosine: bool,
) -> Result<OutgoingValue, String> {
    let words = line.split_whitespace();
    let numbers = words.map(|word| number("a value", word));
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
    let brdf = match numbers[..] {
        [_, _, y] if value_count == 1 => [y; 3],
        [_, _, x, y, z] if value_count == 3 => product(&FROM_XYZ, [x, y, z]),
        _ => return Err(format!("it must have theta, phi and {value_count} values")),
    };
    let [theta, phi] = [numbers[0], numbers[1]];
    check_direction(theta, phi)?;
    let cosine = if times_cosine {
        theta.to_radians().cos()
    } else {
        1.0
    };
    // Colors outside the RGB gamut have negative components, which are set to 0.
    let brdf = brdf.map(|value| (value / cosine).clamp(0.0, f64::from(f32::MAX)) as f32);
    Ok(([theta, phi], brdf))
}

/// The number of bytes that are read from each file in the directory, to get its header.
const HEAD_BYTES: u64 = 1 << 14;

/// Returns the name of a file's sample, or else that of the file.
pub(super) fn sample_name_of(path: &Path) -> Result<String, SourceError> {
    match sample_name(&read_head(path).map_err(read_error(path))?) {
        None => Ok(path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()),
        Some(name) if is_valid_name(name) => Ok(name.to_owned()),
        Some(name) => Err(Defect::in_file(path)(format!(
            "its sample_name is {}, and must be a name without slashes",
            escaped(name)
        ))),
    }
}

/// Returns the files of the set of `path`, sorted. `path` is one of them.
pub(crate) fn files_of(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let names = set_names(path, &read_head(path).map_err(read_error(path))?);
    let mut files = Vec::new();
    for entry in entries(directory_of(path))? {
        let candidate = path.with_file_name(entry.file_name().unwrap_or_default());
        let is_in_set = candidate == path
            || candidate.is_file()
                && read_head(&candidate).is_ok_and(|head| {
                    let others = set_names(&candidate, &head);
                    let mut pairs = names.iter().zip(others);
                    has_signature(head.as_bytes())
                        && pairs.any(|(name, other)| name.is_some() && *name == other)
                });
        if is_in_set {
            files.push(candidate);
        }
    }
    files.sort();
    Ok(files)
}

/// Returns the names that a file shares with other files of its set: that of the sample, also without the incoming angles;
/// that of the file without them; and, if the sample has no name, that of the file without digits at the end.
fn set_names(path: &Path, head: &str) -> [Option<String>; 4] {
    let sample = sample_name(head);
    let angles = incoming_angles(head);
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    [
        sample.map(str::to_owned),
        sample.and_then(|name| without_angles(name, &angles)),
        without_angles(&file, &angles),
        sample.is_none().then(|| numbered.to_owned()),
    ]
}

/// Returns a name with `#` in place of each number that is one of `angles`; None without such a number.
fn without_angles(name: &str, angles: &[f64]) -> Option<String> {
    let is_in_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut result = String::new();
    let mut rest = name;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let length = rest[start..].find(|c| !is_in_number(c));
        let number = &rest[start..][..length.unwrap_or(rest.len() - start)];
        // The last period precedes an extension.
        let number = number.trim_end_matches('.');
        let is_angle = |value: f64| {
            let mut differences = angles.iter().map(|angle| (angle - value).abs());
            differences.any(|difference| difference < ANGLE_TOLERANCE)
        };
        result += &rest[..start];
        result += match number.parse().is_ok_and(is_angle) {
            true => "#",
            false => number,
        };
        rest = &rest[start + number.len()..];
    }
    result.contains('#').then_some(result + rest)
}

/// Reads the first bytes of a file, which may have any format and length.
fn read_head(path: &Path) -> io::Result<String> {
    let head = untrusted::read_head(path, HEAD_BYTES)?;
    Ok(String::from_utf8_lossy(&head).into_owned())
}
