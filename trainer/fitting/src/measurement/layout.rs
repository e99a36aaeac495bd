//! Layout of a table's text: the line of column names, the columns and their separator.

use std::borrow::Cow;

use glimpse_materials::untrusted::escaped_start;

use super::columns::{CIELAB, Column, Role, wavelength};

/// Characters at the start of a comment line. `numpy.savetxt` writes column names as a comment.
const COMMENT: [char; 3] = ['#', '%', '/'];

/// The number of lines, without empty ones, that are searched for column names.
const MAX_LINES: usize = 100;

/// The separator of columns in a text whose columns are aligned by spaces.
const SPACES: char = ' ';

/// All separators of columns.
const SEPARATORS: [char; 4] = [SPACES, '\t', ';', ','];

/// The columns, and the line that names them.
#[derive(Clone, Default)]
pub(crate) struct Layout {
    /// The number of the line of names, from 1.
    pub(super) line: usize,
    pub(crate) columns: Vec<Column>,
    pub(super) separator: char,
    /// The number of known names.
    known: usize,
    /// The number of names that are numbers.
    numbers: usize,
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
            let has_names = |line: &&(usize, &str)| Self::parse(**line).known >= min_known;
            let mut uncommented = lines.iter().filter(|line| !is_comment(line));
            let line = uncommented.find(has_names);
            line.or_else(|| comments.iter().rfind(has_names))
        };
        let line = [2, 1, 0].into_iter().find_map(find);
        let &(number, line) =
            line.ok_or("it is empty; name the columns, separated by commas, in line 1")?;
        let mut layout = Self::parse((number, line));
        layout.check_names(line, comments)?;
        for (above, text) in lines.iter().take_while(|(above, _)| *above < number) {
            let cells = split(text.trim_start_matches(COMMENT), layout.separator);
            if cells.len() > 1 && cells.iter().all(|cell| cell.parse::<f64>().is_ok()) {
                return Err(format!(
                    "line {above} has numbers, but line {number} names the columns; move the names to line 1"
                ));
            }
            layout.add_units(*above, &cells);
        }
        Ok(layout)
    }

    /// Splits a line by the separator with the most known names, or else numbers.
    fn parse((number, line): (usize, &str)) -> Self {
        let line = line.trim_start_matches(COMMENT);
        let layouts = SEPARATORS.map(|separator| {
            let cells = split(line, separator);
            let mut columns: Vec<Column> =
                cells.iter().map(|cell| Column::new(number, cell)).collect();
            // With L, b is not blue.
            if columns.iter().any(|column| column.name == CIELAB[0]) {
                let others = columns.iter_mut();
                for column in others.filter(|other| ["a", "b"].contains(&&other.label[..])) {
                    column.name = format!("{}*", column.label);
                    column.role = Some(Role::Reading);
                }
            }
            let is_known =
                |column: &&Column| column.is_unique() && wavelength(&column.label).is_none();
            let known = columns.iter().filter(is_known).count();
            // A sentence may contain names.
            let is_sentence = separator == SPACES
                && (2 * known <= columns.len() || known < 3 && known < columns.len());
            let is_number = |column: &&Column| column.label.parse::<f64>().is_ok();
            Self {
                line: number,
                known: if is_sentence { 0 } else { known },
                numbers: columns.iter().filter(is_number).count(),
                columns,
                separator,
            }
        });
        // The last one of those with the largest count.
        let layouts = layouts.into_iter();
        let best = layouts.max_by_key(|layout| (layout.known, layout.numbers));
        best.unwrap_or_default()
    }

    /// Returns the index of a column; None if it does not exist.
    pub(super) fn index(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// Adds the units in the cells of a line. Returns false if the meaning of none is known.
    pub(super) fn add_units<S: AsRef<str>>(&mut self, line: usize, cells: &[S]) -> bool {
        let mut columns = self.columns.clone();
        let mut is_known = false;
        for (column, cell) in columns.iter_mut().zip(cells) {
            // A number or a dash is rather a reading.
            let cell = cell.as_ref();
            is_known |= column.add_unit(line, cell) && !["1", "-"].contains(&cell);
        }
        if is_known {
            self.columns = columns;
        }
        is_known
    }

    /// Checks that a line has names, rather than numbers.
    fn check_names(&self, line: &str, comments: &[(usize, &str)]) -> Result<(), String> {
        let labels = self.columns.iter().map(|column| &column.label);
        let bands = labels.filter(|label| wavelength(label).is_some()).count();
        let (number, numbers) = (self.line, self.numbers);
        if numbers < 2 || bands == numbers {
            return Ok(());
        }
        if numbers < self.columns.len() {
            return Err(format!(
                "line {number} names columns by angles, `{}`; give one row for each reading, with columns such as \
                 theta_i,theta_o,value",
                escaped_start(line.as_bytes())
            ));
        }
        let mut parameters = comments.iter();
        let alta = parameters.find(|(_, comment)| comment.starts_with("#PARAM_IN"));
        let comment = alta.or(comments.last());
        let comment = comment.map_or(String::new(), |(at, comment)| {
            let comment = escaped_start(comment.as_bytes());
            format!(", and the comment in line {at}, `{comment}`, has no known names (those of ALTA files are not)")
        });
        Err(format!(
            "no line names the columns: line {number} has numbers{comment}; name the columns above the rows, such as \
             theta_i,theta_o,r,g,b"
        ))
    }
}

/// Splits a line into cells, without empty cells at its end.
fn split(line: &str, separator: char) -> Vec<String> {
    let line = single_spaced(line, separator);
    let record = reader(&line, separator).records().next();
    let record = record.and_then(Result::ok).unwrap_or_default();
    let mut cells: Vec<String> = record.iter().map(str::to_owned).collect();
    while cells.last().is_some_and(String::is_empty) {
        cells.pop();
    }
    cells
}

/// Returns lines with single spaces as white space, if `separator` is [`SPACES`].
pub(super) fn single_spaced(text: &str, separator: char) -> Cow<'_, str> {
    if separator != SPACES {
        return text.into();
    }
    let lines = text
        .split('\n')
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    lines.collect::<Vec<_>>().join("\n").into()
}

/// Reads cells from [`single_spaced`] text.
pub(super) fn reader(text: &str, separator: char) -> csv::Reader<&[u8]> {
    let mut reader = csv::ReaderBuilder::new();
    reader
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All);
    reader
        .delimiter(separator as u8)
        .from_reader(text.as_bytes())
}
