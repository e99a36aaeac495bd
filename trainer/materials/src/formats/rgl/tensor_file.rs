//! The container of RGL measurements: named arrays in one file.
//!
//! Numbers are little-endian. The file starts with `tensor_file` and a zero byte, version 1.0 in two bytes, and the
//! number of fields (u32). Each field follows: length of its name (u16), name, number of dimensions (u16), type (u8),
//! offset of its values in the file (u64), each dimension (u64). The values of all fields are last. Their last
//! dimension varies fastest.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::error::ensure;
use crate::lists::indices;
use crate::untrusted::escaped;

pub(super) const MAGIC: &[u8] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];
/// The width in bytes of a value of each type. Type n is at index n - 1.
const WIDTHS: [usize; 11] = [1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];
/// The types of the fields that are read and written: 8-bit unsigned integers and 32-bit floats.
pub(super) const UNSIGNED_8: u8 = 1;
const FLOAT_32: u8 = 10;

/// A file whose header was checked against its length.
pub(super) struct TensorFile<'a> {
    bytes: &'a [u8],
    fields: BTreeMap<&'a str, Field>,
}

/// An array of the file.
struct Field {
    type_code: u8,
    shape: Vec<usize>,
    range: Range<usize>,
}

impl<'a> TensorFile<'a> {
    /// Reads and checks the header: the values of all fields follow it without overlaps, and the file ends with the
    /// last field. No allocation depends on a size that only the header states.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let mut header = Header { rest: bytes };
        ensure!(
            header.take(MAGIC.len())? == MAGIC,
            "it is not a tensor file"
        );
        let [major, minor] = header.array()?;
        ensure!(
            [major, minor] == VERSION,
            "it has version {major}.{minor} of the tensor file format, and must have version 1.0"
        );
        let count = u32::from_le_bytes(header.array()?);
        let mut fields = BTreeMap::new();
        for _ in 0..count {
            let (name, field) = header.field(bytes.len())?;
            ensure!(
                fields.insert(name, field).is_none(),
                "it has two fields named {}",
                escaped(name)
            );
        }
        let (length, mut end) = (bytes.len(), bytes.len() - header.rest.len());
        let ranges = fields.values().map(|field: &Field| field.range.clone());
        let mut ranges: Vec<Range<usize>> = ranges.filter(|range| !range.is_empty()).collect();
        ranges.sort_by_key(|range| range.start);
        for range in ranges {
            ensure!(
                range.start >= end,
                "its field at byte {} overlaps the one before, which ends at byte {end}",
                range.start
            );
            end = range.end;
        }
        ensure!(
            length == end,
            "it has {length} bytes, and its last field ends at byte {end}"
        );
        Ok(Self { bytes, fields })
    }

    /// Returns true if there is a field of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.fields.contains_key(name)
    }

    /// Returns the shape and the values of a field with `N` dimensions of 32-bit floats, which satisfy a condition.
    pub(super) fn floats<const N: usize>(
        &self,
        name: &str,
        condition: Condition,
    ) -> Result<([usize; N], Vec<f32>), String> {
        let (shape, words) = self.float_words(name)?;
        let values: Vec<f32> = words.iter().copied().map(f32::from_le_bytes).collect();
        check_values(name, &shape, &values, condition)?;
        Ok((shape, values))
    }

    /// Returns the shape and the little-endian values of a field with `N` dimensions of 32-bit floats, for fields that are too
    /// large for a list.
    pub(super) fn float_words<const N: usize>(
        &self,
        name: &str,
    ) -> Result<([usize; N], &'a [[u8; 4]]), String> {
        let (shape, bytes) = self.values(name, FLOAT_32)?;
        Ok((shape, bytes.as_chunks().0))
    }

    /// Returns the shape and the bytes of a field with `N` dimensions of a type.
    pub(super) fn values<const N: usize>(
        &self,
        name: &str,
        type_code: u8,
    ) -> Result<([usize; N], &'a [u8]), String> {
        let Some(field) = self.fields.get(name) else {
            return Err(format!("it has no field {name}"));
        };
        let shape = <[usize; N]>::try_from(&field.shape[..]);
        match (shape, self.bytes.get(field.range.clone())) {
            (Ok(shape), Some(bytes)) if field.type_code == type_code => Ok((shape, bytes)),
            _ => Err(format!(
                "its field {name} must have type {type_code} and {N} dimensions, not type {} and shape {}",
                field.type_code,
                escaped(&format!("{:?}", field.shape))
            )),
        }
    }
}

/// A condition of finite values: its description after "must be", and a function that returns true for a valid value.
pub(super) type Condition = (&'static str, fn(f32) -> bool);
pub(super) const FINITE: Condition = ("finite", |_| true);
pub(super) const NOT_NEGATIVE: Condition = ("at least 0", |value| value >= 0.0);

/// Returns an error with the first value of a field that is not finite or does not satisfy a condition.
pub(super) fn check_values(
    field: &str,
    shape: &[usize],
    values: &[f32],
    (requirement, condition): Condition,
) -> Result<(), String> {
    let is_valid = |value: &f32| value.is_finite() && condition(*value);
    match values.iter().position(|value| !is_valid(value)) {
        Some(position) => Err(format!(
            "element {:?} of its field {field} is {}, and must be {requirement}",
            indices(position, shape.to_vec()),
            values[position]
        )),
        None => Ok(()),
    }
}

/// A field for writing.
pub(super) struct WrittenField<'a> {
    name: &'a str,
    type_code: u8,
    shape: Vec<usize>,
    values: Vec<u8>,
}

impl<'a> WrittenField<'a> {
    /// Makes a field of bytes.
    pub(super) fn bytes(name: &'a str, values: &[u8]) -> Self {
        Self {
            name,
            type_code: UNSIGNED_8,
            shape: vec![values.len()],
            values: values.to_vec(),
        }
    }

    /// Makes a field of 32-bit floats.
    pub(super) fn floats(name: &'a str, shape: &[usize], values: &[f32]) -> Self {
        Self {
            name,
            type_code: FLOAT_32,
            shape: shape.to_vec(),
            values: values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
        }
    }
}

/// Returns the bytes of a file with the given fields.
pub(super) fn write(fields: &[WrittenField<'_>]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION);
    bytes.extend((fields.len() as u32).to_le_bytes());
    // Length of the name, name, number of dimensions, type, offset, shape.
    let header_bytes = |field: &WrittenField<'_>| 13 + field.name.len() + 8 * field.shape.len();
    let mut offset = bytes.len() + fields.iter().map(header_bytes).sum::<usize>();
    for field in fields {
        bytes.extend((field.name.len() as u16).to_le_bytes());
        bytes.extend(field.name.as_bytes());
        bytes.extend((field.shape.len() as u16).to_le_bytes());
        bytes.push(field.type_code);
        bytes.extend((offset as u64).to_le_bytes());
        for length in &field.shape {
            bytes.extend((*length as u64).to_le_bytes());
        }
        offset += field.values.len();
    }
    for field in fields {
        bytes.extend_from_slice(&field.values);
    }
    bytes
}

/// The unread rest of the header.
struct Header<'a> {
    rest: &'a [u8],
}

impl<'a> Header<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let head = self.rest.split_off(..count);
        Ok(head.ok_or("it ends within its header")?)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// Reads the header of the next field, in a file of `file_bytes` bytes.
    fn field(&mut self, file_bytes: usize) -> Result<(&'a str, Field), String> {
        let length = u16::from_le_bytes(self.array()?);
        let name = str::from_utf8(self.take(length.into())?)
            .map_err(|_| "the name of a field is not UTF-8")?;
        let dimensions = u16::from_le_bytes(self.array()?);
        let [type_code] = self.array()?;
        let offset = u64::from_le_bytes(self.array()?);
        let (shape, _) = self
            .take(usize::from(dimensions) * size_of::<u64>())?
            .as_chunks();
        let shape: Vec<u64> = shape.iter().copied().map(u64::from_le_bytes).collect();

        let width = WIDTHS.get(usize::from(type_code).wrapping_sub(1));
        let Some(width) = width else {
            let name = escaped(name);
            return Err(format!("its field {name} has the unknown type {type_code}"));
        };
        let range = byte_range(offset, &shape, *width).filter(|range| range.end <= file_bytes);
        let range = range.ok_or_else(|| {
            format!(
                "its field {} of shape {} starts at byte {offset} and ends after the {file_bytes} bytes of the file",
                escaped(name),
                escaped(&format!("{shape:?}"))
            )
        })?;
        // The values fit into the file, so that only a field without values can have a dimension above `usize::MAX`.
        let shape = shape.into_iter().map(|length| length as usize).collect();
        let field = Field {
            type_code,
            shape,
            range,
        };
        Ok((name, field))
    }
}

/// Returns the byte range of values. Returns None on overflow.
fn byte_range(offset: u64, shape: &[u64], width: usize) -> Option<Range<usize>> {
    let values = shape.iter().try_fold(1_usize, |values, length| {
        values.checked_mul(usize::try_from(*length).ok()?)
    })?;
    let start = usize::try_from(offset).ok()?;
    let end = start.checked_add(values.checked_mul(width)?)?;
    Some(start..end)
}
