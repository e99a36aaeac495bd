//! Layout of a table's text: the line of column names, the separator, the units and the decimal mark.

use std::borrow::Cow;

use glimpse_materials::untrusted::escaped_start;

use super::names::KnownName;

/// All columns of angles.
pub(super) const ANGLES: [&str; 8] = [
    "theta_h", "theta_d", "phi_d", "theta_i", "phi_i", "theta_o", "phi_o", "phi",
];
/// The column of sample indices in a measurement plan of `trainer plan`.
pub(super) const INDEX: &str = "index";
/// The columns of readings by a sensor with three channels.
pub(super) const CHANNELS: [&str; 3] = ["r", "g", "b"];
/// The column of readings by a sensor with one channel.
pub(super) const MONOCHROME: &str = "value";
/// Units of angles, in lowercase.
pub(super) const DEGREES: [&str; 5] = ["deg", "degree", "degrees", "°", "º"];
pub(super) const RADIANS: [&str; 3] = ["rad", "radian", "radians"];
/// Units of BRDFs, in lowercase and without white space.
pub(super) const PER_STERADIAN: [&str; 5] = ["1/sr", "sr^-1", "sr-1", "sr⁻¹", "/sr"];

/// Characters at the start of a comment line. `numpy.savetxt` writes column names as a comment.
const COMMENT: [char; 3] = ['#', '%', '/'];

/// The number of lines, without empty ones, that are searched for column names.
const MAX_LINES: usize = 100;

/// The separator of columns in a text whose columns are aligned by spaces.
const SPACES: char = ' ';

/// All separators of columns.
const SEPARATORS: [char; 4] = [SPACES, '\t', ';', ','];

/// The line of column names, and the lines above it.
#[derive(Clone)]
pub(super) struct Layout {
    /// The number of the line of names, from 1.
    pub(super) line: usize,
    /// The names of the file in lowercase, without units.
    pub(super) labels: Vec<String>,
    /// The names by which readers know the columns, or else the labels.
    pub(super) names: Vec<String>,
    pub(super) units: Vec<Unit>,
    pub(super) separator: char,
}

/// The stated unit of a column.
#[derive(Clone)]
pub(super) struct Unit {
    pub(super) line: usize,
    pub(super) column: String,
    /// In lowercase, without white space and brackets.
    pub(super) text: String,
}

impl Layout {
    /// Finds the line of column names. Lines above it, such as comments and `sep=;`, hold no readings, but may state units.
    /// The error is a message.
    pub(super) fn find(text: &str) -> Result<Self, String> {
        // A tab may separate an empty first cell.
        let lines = (1..).zip(text.split('\n').map(|line| line.trim_matches(' ')));
        let lines = lines.filter(|(_, line)| !line.trim().is_empty());
        let lines: Vec<(usize, &str)> = lines.take(MAX_LINES).collect();
        let is_comment = |(_, line): &&(usize, &str)| line.starts_with(COMMENT);
        let first_row = lines.iter().position(|line| !is_comment(&line));
        let comments = &lines[..first_row.unwrap_or(lines.len())];
        // Two known names identify the line. With fewer, the first line is named in an error.
        let find = |min_known: usize| {
            let has_names = |(_, line): &&(usize, &str)| Header::parse(line).known >= min_known;
            let mut uncommented = lines.iter().filter(|line| !is_comment(line));
            let line = uncommented.find(has_names);
            line.or_else(|| comments.iter().rfind(has_names))
        };
        let line = [2, 1, 0].into_iter().find_map(find);
        let &(number, line) =
            line.ok_or("it is empty; name the columns, separated by commas, in line 1")?;
        let header = Header::parse(line);
        let mut layout = Self {
            line: number,
            labels: Vec::new(),
            names: Vec::new(),
            units: Vec::new(),
            separator: header.separator,
        };
        check_names(number, line, &header, comments)?;
        for cell in header.cells {
            let (label, unit) = name_and_unit(&cell);
            let known = KnownName::find(&label);
            let unique = known.filter(KnownName::is_unique);
            let name = unique.map_or(label.clone(), |known| known.name.to_owned());
            let unit = known.map_or(
                unit,
                |known| if unit.is_empty() { known.unit } else { unit },
            );
            layout.units.extend(Unit::new(number, &name, unit));
            layout.labels.push(label);
            layout.names.push(name);
        }
        for (above, text) in lines.iter().take_while(|(above, _)| *above < number) {
            let cells = split(text.trim_start_matches(COMMENT), header.separator);
            if cells.len() > 1 && cells.iter().all(|cell| cell.parse::<f64>().is_ok()) {
                return Err(format!(
                    "line {above} has numbers, but line {number} names the columns; move the names to line 1"
                ));
            }
            layout.add_units(*above, &cells);
        }
        Ok(layout)
    }

    /// Adds the units in the cells of a line. Returns false if no cell is a known unit.
    pub(super) fn add_units<S: AsRef<str>>(&mut self, line: usize, cells: &[S]) -> bool {
        let known = [&DEGREES[..], &RADIANS, &PER_STERADIAN].concat();
        let units = self.names.iter().zip(cells);
        let units = units.filter_map(|(name, cell)| Unit::new(line, name, cell.as_ref()));
        let units: Vec<Unit> = units.collect();
        let is_row = units.iter().any(|unit| known.contains(&&unit.text[..]));
        if is_row {
            self.units.extend(units);
        }
        is_row
    }
}

/// A line that may name the columns.
#[derive(Default)]
struct Header {
    cells: Vec<String>,
    separator: char,
    /// The number of cells with known names.
    known: usize,
}

impl Header {
    /// Splits a line by the separator with the most known names.
    fn parse(line: &str) -> Self {
        let line = line.trim_start_matches(COMMENT);
        let headers = SEPARATORS.map(|separator| {
            let cells = split(line, separator);
            let is_known = |cell: &&String| {
                KnownName::find(&name_and_unit(cell).0)
                    .is_some_and(|known| known.is_characteristic())
            };
            let known = cells.iter().filter(is_known).count();
            // A sentence may contain names.
            let is_sentence = separator == SPACES
                && (2 * known <= cells.len() || known < 3 && known < cells.len());
            Self {
                cells,
                separator,
                known: if is_sentence { 0 } else { known },
            }
        });
        // The last one of those with the largest count.
        let headers = headers.into_iter();
        headers
            .max_by_key(|header| header.known)
            .unwrap_or_default()
    }
}

/// Returns the name of a column in lowercase, and the unit after it, in brackets.
fn name_and_unit(cell: &str) -> (String, &str) {
    let unit = cell.find(['(', '[']).filter(|_| cell.ends_with([')', ']']));
    let (name, unit) = cell.split_at(unit.unwrap_or(cell.len()));
    (name.trim().to_lowercase(), unit)
}

/// Splits a line into cells, without empty cells at its end.
fn split(line: &str, separator: char) -> Vec<String> {
    let line = tabulated(line, separator);
    let record = reader(&line, separator).records().next();
    let record = record.and_then(Result::ok).unwrap_or_default();
    let mut cells: Vec<String> = record.iter().map(str::to_owned).collect();
    while cells.last().is_some_and(String::is_empty) {
        cells.pop();
    }
    cells
}

/// Returns lines with a single tab instead of white space, if `separator` is [`SPACES`].
pub(super) fn tabulated(text: &str, separator: char) -> Cow<'_, str> {
    if separator != SPACES {
        return text.into();
    }
    let lines = text
        .split('\n')
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join("\t"));
    lines.collect::<Vec<_>>().join("\n").into()
}

/// Reads cells from [`tabulated`] text.
pub(super) fn reader(text: &str, separator: char) -> csv::Reader<&[u8]> {
    let mut reader = csv::ReaderBuilder::new();
    reader
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All);
    let separator = if separator == SPACES {
        b'\t'
    } else {
        separator as u8
    };
    reader.delimiter(separator).from_reader(text.as_bytes())
}

/// Returns true if a column of this name holds readings.
pub(super) fn is_value(name: &str) -> bool {
    name == MONOCHROME || CHANNELS.contains(&name) || wavelength(name).is_some()
}

/// Returns the wavelength in nm of a column of readings in a band: `390`, `390nm` or `w390`.
pub(super) fn wavelength(name: &str) -> Option<f32> {
    let number = name.strip_prefix('w').unwrap_or(name);
    let number = number.strip_suffix("nm").unwrap_or(number);
    let is_number = number.starts_with(|first: char| first.is_ascii_digit());
    let wavelength = number.trim_end().parse().ok().filter(|_| is_number);
    wavelength.filter(|wavelength| (200.0..=2600.0).contains(wavelength))
}

impl Unit {
    /// Returns the unit in a cell; None if the cell is empty.
    pub(super) fn new(line: usize, column: &str, cell: &str) -> Option<Self> {
        let is_kept = |c: &char| !c.is_whitespace() && !"()[]".contains(*c);
        let text: String = cell.to_lowercase().chars().filter(is_kept).collect();
        let column = column.to_owned();
        (!text.is_empty()).then_some(Self { line, column, text })
    }
}

/// Checks that a line has names, rather than numbers.
fn check_names(
    number: usize,
    line: &str,
    header: &Header,
    comments: &[(usize, &str)],
) -> Result<(), String> {
    let count = |cells: &[String]| {
        cells
            .iter()
            .filter(|cell| cell.parse::<f64>().is_ok())
            .count()
    };
    let cells = SEPARATORS
        .map(|separator| split(line, separator))
        .into_iter();
    let cells = cells
        .max_by_key(|cells| count(cells))
        .filter(|_| header.known == 0);
    let cells = cells.as_ref().unwrap_or(&header.cells);
    let numbers = count(cells);
    let bands = cells
        .iter()
        .filter(|cell| wavelength(&cell.to_lowercase()).is_some());
    if numbers < 2 || bands.count() == numbers {
        return Ok(());
    }
    let remedy = "name the columns above the rows, such as theta_i,theta_o,r,g,b";
    if numbers < cells.len() {
        return Err(format!(
            "line {number} names columns by angles, `{}`; give one row for each reading, with columns such as \
             theta_i,theta_o,value",
            escaped_start(line.as_bytes())
        ));
    }
    let alta = comments
        .iter()
        .find(|(_, comment)| comment.starts_with("#PARAM_IN"));
    if let Some((at, comment)) = alta {
        return Err(format!(
            "line {at}, `{}`, is of an ALTA file, which is not read; {remedy} (with angles in degrees, or --unit radians)",
            escaped_start(comment.as_bytes())
        ));
    }
    let comment = comments.last().map_or(String::new(), |(at, comment)| {
        format!(
            ", and the comment in line {at}, `{}`, has none that are known",
            escaped_start(comment.as_bytes())
        )
    });
    Err(format!(
        "no line names the columns: line {number} has numbers{comment}; {remedy}"
    ))
}
