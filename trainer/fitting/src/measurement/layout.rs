//! Layout of a table's text: the line of column names, the separator, the units and the decimal mark.

use std::borrow::Cow;

use clap::ValueEnum;

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
/// The other columns of numbers, and the columns of texts.
const OTHER_NUMBERS: [&str; 3] = [INDEX, "noise", "saturated"];
const TEXTS: [&str; 2] = ["quantity", "material"];

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

/// The line of column names, and the lines above it.
pub(super) struct Layout {
    /// The number of the line of names, from 1.
    pub(super) line: usize,
    /// The column names in lowercase, without units.
    pub(super) names: Vec<String>,
    pub(super) units: Vec<Unit>,
    pub(super) separator: char,
}

/// The unit of angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AngleUnit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

/// The stated unit of a column.
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
            names: Vec::new(),
            units: Vec::new(),
            separator: header.separator,
        };
        for cell in header.cells {
            let (name, unit) = name_and_unit(&cell);
            layout.units.extend(Unit::new(number, &name, unit));
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
        let headers = [SPACES, '\t', ';', ','].map(|separator| {
            let cells = split(line, separator);
            let is_known = |cell: &&String| is_known(&name_and_unit(cell).0);
            let known = cells.iter().filter(is_known).count();
            // A sentence may contain names.
            let is_sentence = separator == SPACES && known < cells.len();
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

/// Returns true if readers use a column of this name. Names of bands do not count, because rows have such numbers too.
pub(super) fn is_known(name: &str) -> bool {
    TEXTS.contains(&name) || is_number(name) && wavelength(name).is_none()
}

/// Returns true if a column of this name holds numbers.
pub(super) fn is_number(name: &str) -> bool {
    is_value(name) || ANGLES.contains(&name) || OTHER_NUMBERS.contains(&name)
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
    fn new(line: usize, column: &str, cell: &str) -> Option<Self> {
        let is_kept = |c: &char| !c.is_whitespace() && !"()[]".contains(*c);
        let text: String = cell.to_lowercase().chars().filter(is_kept).collect();
        let column = column.to_owned();
        (!text.is_empty()).then_some(Self { line, column, text })
    }
}

/// Returns true if the comma of a number may separate thousands: `1,234`.
pub(super) fn may_separate_thousands(number: &str) -> bool {
    let mut groups = number.trim_start_matches(['+', '-']).split(',');
    let first = groups.next().unwrap_or_default();
    let is_group = |group: &str| group.len() == 3 && group.bytes().all(|c| c.is_ascii_digit());
    (1..=3).contains(&first.len()) && !first.starts_with('0') && groups.all(is_group)
}
