//! The container of RGL's measurements: named arrays in one file.
//!
//! All little-endian: `tensor_file` and a zero byte, version 1.0 in two bytes, the number of
//! fields (u32). Then for each field: length of its name (u16), name, number of dimensions (u16),
//! type (u8), where its values begin in the file (u64), each dimension (u64). Then the values,
//! last dimension fastest.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::untrusted::escaped;

pub(super) const MAGIC: &[u8] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];
/// Bytes of a value, and what it is, by type less 1.
const TYPES: [(usize, &str); 11] = [
    (1, "8-bit unsigned integers"),
    (1, "8-bit signed integers"),
    (2, "16-bit unsigned integers"),
    (2, "16-bit signed integers"),
    (4, "32-bit unsigned integers"),
    (4, "32-bit signed integers"),
    (8, "64-bit unsigned integers"),
    (8, "64-bit signed integers"),
    (2, "16-bit floats"),
    (4, "32-bit floats"),
    (8, "64-bit floats"),
];
const UNSIGNED_8: u8 = 1;
const FLOAT_32: u8 = 10;

/// Why a file cannot be used: what is wrong with it, and the remedy.
pub(super) type Complaint = String;

/// A file whose header has been checked against its length.
pub(super) struct TensorFile<'a> {
    bytes: &'a [u8],
    fields: BTreeMap<&'a str, Field>,
}

/// One array.
struct Field {
    kind: u8,
    shape: Vec<usize>,
    place: Range<usize>,
}

impl<'a> TensorFile<'a> {
    /// Reads the header. Every field's values are in the file after it, and no two fields share
    /// any, and the file ends with the last of them; nothing is allocated on the header's word.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, Complaint> {
        let mut header = Header { rest: bytes };
        if header.take(MAGIC.len())? != MAGIC {
            return Err("it is no tensor file; get it again".to_owned());
        }
        let version: [u8; 2] = header.array()?;
        if version != VERSION {
            let [major, minor] = version;
            return Err(format!(
                "it has version {major}.{minor} of the tensor file format, and 1.0 is what is \
                 read; get it again"
            ));
        }
        let count = u32::from_le_bytes(header.array()?);
        // Of a field of no length the header takes 13 bytes.
        let possible = |count: u32| count as usize <= header.rest.len() / 13;
        if !possible(count) && possible(count.swap_bytes()) {
            return Err(format!(
                "it counts {count} fields, or {} if its numbers are big-endian, and a tensor \
                 file's are little-endian; get it again, or swap the bytes of all of them",
                count.swap_bytes()
            ));
        }
        let mut fields = BTreeMap::new();
        for _ in 0..count {
            let (name, field) = header.field(bytes.len())?;
            if fields.insert(name, field).is_some() {
                return Err(format!("it has two fields {}; get it again", escaped(name)));
            }
        }
        let file = Self { bytes, fields };
        file.check_places(bytes.len() - header.rest.len())?;
        Ok(file)
    }

    /// Makes sure that no field begins before the header's end or another one's, and that nothing
    /// follows the last one.
    fn check_places(&self, header_end: usize) -> Result<(), Complaint> {
        let mut places: Vec<_> = self.fields.iter().collect();
        places.sort_by_key(|(_, field)| (field.place.start, field.place.end));
        let (mut end, mut before) = (header_end, "the header");
        for (name, field) in places {
            if field.place.is_empty() {
                continue;
            }
            if field.place.start < end {
                return Err(format!(
                    "its field {} overlaps {}; get it again",
                    escaped(name),
                    escaped(before)
                ));
            }
            (end, before) = (field.place.end, *name);
        }
        match self.bytes.len() - end {
            0 => Ok(()),
            more => Err(format!(
                "something was appended: {more} bytes follow {}, which ends at byte {end}; get it \
                 again",
                escaped(before)
            )),
        }
    }

    /// True if there is a field of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.fields.contains_key(name)
    }

    /// Shape and values of a field of `N` dimensions of finite 32-bit floats.
    pub(super) fn floats<const N: usize>(
        &self,
        name: &str,
    ) -> Result<([usize; N], Vec<f32>), Complaint> {
        let (shape, bytes) = self.values(name, FLOAT_32)?;
        let (values, _) = bytes.as_chunks();
        let values: Vec<f32> = values.iter().copied().map(f32::from_le_bytes).collect();
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(format!(
                "number {index} of its field {name} is {}, and should be finite; get it again",
                values[index]
            )),
            None => Ok((shape, values)),
        }
    }

    /// The only value of a field of one byte.
    pub(super) fn byte(&self, name: &str) -> Result<u8, Complaint> {
        match self.values::<1>(name, UNSIGNED_8)? {
            (_, [byte]) => Ok(*byte),
            ([length], _) => Err(format!(
                "its field {name} has {length} values where there should be 1; get it again"
            )),
        }
    }

    fn values<const N: usize>(
        &self,
        name: &str,
        kind: u8,
    ) -> Result<([usize; N], &'a [u8]), Complaint> {
        let field = self
            .fields
            .get(name)
            .ok_or_else(|| format!("it has no field {name}; get it again"))?;
        let shape = <[usize; N]>::try_from(&field.shape[..]);
        match (shape, self.bytes.get(field.place.clone())) {
            (Ok(shape), Some(bytes)) if field.kind == kind => Ok((shape, bytes)),
            _ => Err(format!(
                "its field {name} should be {} in {N} dimensions, not {} of shape {}; get it again",
                of_type(kind).map_or("", |(_, named)| named),
                of_type(field.kind).map_or("", |(_, named)| named),
                escaped(&format!("{:?}", field.shape))
            )),
        }
    }
}

/// Values of a field that is written.
pub(super) enum Values<'a> {
    Bytes(&'a [u8]),
    Floats(&'a [f32]),
}

impl Values<'_> {
    fn kind(&self) -> u8 {
        match self {
            Self::Bytes(_) => UNSIGNED_8,
            Self::Floats(_) => FLOAT_32,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Bytes(bytes) => bytes.len(),
            Self::Floats(floats) => size_of_val(*floats),
        }
    }
}

/// A file of fields: name, shape and values of each.
pub(super) fn write(fields: &[(&str, &[usize], Values<'_>)]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION);
    bytes.extend((fields.len() as u32).to_le_bytes());
    // Of each field: lengths of name and shape, its type, where it begins.
    let header = |name: &str, shape: &[usize]| 2 + name.len() + 2 + 1 + 8 + 8 * shape.len();
    let headers = fields.iter().map(|(name, shape, _)| header(name, shape));
    let mut begin = bytes.len() + headers.sum::<usize>();
    for (name, shape, values) in fields {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(values.kind());
        bytes.extend((begin as u64).to_le_bytes());
        for length in *shape {
            bytes.extend((*length as u64).to_le_bytes());
        }
        begin += values.bytes();
    }
    for (_, _, values) in fields {
        match values {
            Values::Bytes(own) => bytes.extend_from_slice(own),
            Values::Floats(floats) => bytes.extend(floats.iter().flat_map(|f| f.to_le_bytes())),
        }
    }
    bytes
}

/// What is left of the header.
struct Header<'a> {
    rest: &'a [u8],
}

impl<'a> Header<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Complaint> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(|| {
            "its header says more than there is: it was cut short or is no tensor file; get it \
             again"
                .to_owned()
        })?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Complaint> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// The next field, in a file of so many bytes.
    fn field(&mut self, file_bytes: usize) -> Result<(&'a str, Field), Complaint> {
        let length = u16::from_le_bytes(self.array()?);
        let name = str::from_utf8(self.take(length.into())?)
            .map_err(|_| "a field's name is no text; get it again".to_owned())?;
        let dimensions = u16::from_le_bytes(self.array()?);
        let [kind] = self.array()?;
        let begin = u64::from_le_bytes(self.array()?);
        let (shape, _) = self
            .take(usize::from(dimensions) * size_of::<u64>())?
            .as_chunks();
        let shape: Vec<u64> = shape.iter().copied().map(u64::from_le_bytes).collect();

        let Some((width, _)) = of_type(kind) else {
            return Err(format!(
                "its field {} has the unknown type {kind}; get it again",
                escaped(name)
            ));
        };
        let place = place(begin, &shape, width).filter(|place| place.end <= file_bytes);
        let place = place.ok_or_else(|| {
            format!(
                "its field {} of shape {}, from byte {begin} on, ends past the file's \
                 {file_bytes} bytes: it was cut short or is damaged; get it again",
                escaped(name),
                escaped(&format!("{shape:?}"))
            )
        })?;
        // None of the dimensions is longer than the file, or there are no values at all.
        let shape = shape.into_iter().map(|length| length as usize).collect();
        Ok((name, Field { kind, shape, place }))
    }
}

/// Width and name of a type; None of an unknown one.
fn of_type(kind: u8) -> Option<(usize, &'static str)> {
    TYPES.get(usize::from(kind).checked_sub(1)?).copied()
}

/// Where values of this shape are; None past the end of any file.
fn place(begin: u64, shape: &[u64], width: usize) -> Option<Range<usize>> {
    let values = shape.iter().try_fold(1_usize, |values, length| {
        values.checked_mul(usize::try_from(*length).ok()?)
    })?;
    let begin = usize::try_from(begin).ok()?;
    let end = begin.checked_add(values.checked_mul(width)?)?;
    Some(begin..end)
}
