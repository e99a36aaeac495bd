//! Small synthetic recipes, and recipes that the crate's own writer rejects.

use glimpse_core::model::{Model, ModelKind, Neural};
use glimpse_core::recipe::{Kind, Recipe, RecipeError, RecipeParts, VERSION};
use serde::{Serialize, Serializer};

/// Numbers in the packed form of a recipe.
pub(crate) fn packed(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Writes a recipe.
pub(crate) fn write(parts: &RecipeParts<'_>) -> Result<Vec<u8>, RecipeError> {
    let mut buffer = vec![0; 1 << 17];
    Recipe::write(parts, &mut buffer).map(<[u8]>::to_vec)
}

/// Reads a valid recipe. Its bytes are leaked, so that its lifetime is static.
pub(crate) fn parsed(bytes: Vec<u8>) -> Recipe<'static> {
    Recipe::parse(bytes.leak()).unwrap()
}

/// The error of reading bytes that are not a recipe.
pub(crate) fn parse_error(bytes: &[u8]) -> RecipeError {
    Recipe::parse(bytes).map(drop).unwrap_err()
}

/// The contents of a recipe that is fitted by descent.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DescentContents {
    pub(crate) model: ModelKind,
    /// Number of SGD steps.
    pub(crate) inner_steps: u16,
    /// Triples (theta_h, theta_d, phi_d) in radians.
    #[serde(skip)]
    pub(crate) pattern: Vec<f32>,
    /// Initial parameters.
    #[serde(serialize_with = "numbers")]
    pub(crate) initial: Vec<f32>,
    /// A step size for each parameter.
    #[serde(serialize_with = "numbers")]
    pub(crate) step_sizes: Vec<f32>,
    #[serde(skip)]
    pub(crate) expected_loss: f32,
}

/// Low-discrepancy numbers from -0.5 to 0.5, all different.
pub(crate) fn spread(index: usize) -> f32 {
    (index as f32 * 0.618_034).fract() - 0.5
}

/// A valid Neural recipe: eight samples, small weights, small steps.
pub(crate) fn neural() -> DescentContents {
    let place = |k: f32| [0.05 + 0.08 * k, 0.1 + 0.07 * k, 0.4 * k];
    DescentContents {
        model: ModelKind::Neural,
        inner_steps: 20,
        pattern: (0..8).flat_map(|k| place(k as f32)).collect(),
        initial: (0..Neural::PARAMETERS).map(|k| 0.4 * spread(k)).collect(),
        step_sizes: (0..Neural::PARAMETERS)
            .map(|k| 0.05 + 0.02 * spread(k))
            .collect(),
        expected_loss: 0.03,
    }
}

impl DescentContents {
    pub(crate) fn write(&self) -> Result<Vec<u8>, RecipeError> {
        let method = section(Kind::DESCENT, self);
        write_with(&self.pattern, method, self.expected_loss)
    }
}

fn write_with(
    pattern: &[f32],
    method: (Kind, Vec<u8>),
    expected_loss: f32,
) -> Result<Vec<u8>, RecipeError> {
    let pattern = section(Kind::PATTERN, &packed(pattern));
    let bytes = recipe_with(&[pattern, method, expectation(expected_loss)]);
    Recipe::parse(&bytes)?;
    Ok(bytes)
}

/// The contents of a recipe of the model Linear.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RidgeContents {
    /// Triples (theta_h, theta_d, phi_d) in radians.
    #[serde(skip)]
    pub(crate) pattern: Vec<f32>,
    /// The number of components, m.
    pub(crate) components: u16,
    /// n rows of m numbers.
    #[serde(serialize_with = "numbers")]
    pub(crate) basis: Vec<f32>,
    /// n numbers.
    #[serde(serialize_with = "numbers")]
    pub(crate) mean: Vec<f32>,
    /// n BRDFs, sr^-1.
    #[serde(serialize_with = "numbers")]
    pub(crate) median: Vec<f32>,
    /// n numbers.
    #[serde(serialize_with = "numbers")]
    pub(crate) weight: Vec<f32>,
    /// m numbers.
    #[serde(serialize_with = "numbers")]
    pub(crate) precision: Vec<f32>,
    /// The CRC-32 of the whole basis.
    pub(crate) basis_checksum: u32,
    #[serde(skip)]
    pub(crate) expected_loss: f32,
}

/// A valid Linear recipe: the same eight samples, five components.
pub(crate) fn linear() -> RidgeContents {
    let neural = neural();
    RidgeContents {
        pattern: neural.pattern,
        components: 5,
        basis: (1..=40).map(|k| 12.0 * spread(k)).collect(),
        mean: (0..8).map(|k| 0.1 * spread(k)).collect(),
        median: (0..8).map(|k| 0.1 * k as f32).collect(),
        weight: (0..8).map(|k| 0.9 - 0.1 * k as f32).collect(),
        precision: vec![40.0; 5],
        basis_checksum: 0xfeed_beef,
        expected_loss: neural.expected_loss,
    }
}

impl RidgeContents {
    pub(crate) fn write(&self) -> Result<Vec<u8>, RecipeError> {
        let method = section(Kind::RIDGE, self);
        write_with(&self.pattern, method, self.expected_loss)
    }
}

/// A section of a recipe, by another writer than the crate's.
pub(crate) fn section<T: Serialize>(kind: Kind, value: &T) -> (Kind, Vec<u8>) {
    (kind, postcard::to_extend(value, Vec::new()).unwrap())
}

/// The section of an expected loss.
pub(crate) fn expectation(loss: f32) -> (Kind, Vec<u8>) {
    section(Kind::EXPECTATION, &loss)
}

/// Writes numbers in their packed form.
pub(crate) fn numbers<S: Serializer>(numbers: &[f32], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(&packed(numbers))
}

/// A recipe of any version and body, with a valid header.
pub(crate) fn with_header(version: u16, body: &[u8]) -> Vec<u8> {
    let mut checked = version.to_le_bytes().to_vec();
    checked.extend((body.len() as u32).to_le_bytes());
    let header = [b"GLMP", &checked[..]].concat();
    checked.extend(body);
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&checked);
    [&header[..], &checksum.to_le_bytes(), body].concat()
}

pub(crate) type Sections = Vec<(Kind, Vec<u8>)>;

/// The sections of a valid recipe.
pub(crate) fn sections_of(bytes: &[u8]) -> Sections {
    let sections = Recipe::parse(bytes).unwrap().sections();
    sections
        .map(|(kind, bytes)| (kind, bytes.to_vec()))
        .collect()
}

/// The bytes of one section.
pub(crate) fn section_mut(sections: &mut Sections, kind: Kind) -> &mut Vec<u8> {
    let section = sections.iter_mut().find(|(other, _)| *other == kind);
    &mut section.unwrap().1
}

/// The body of a recipe with these sections.
pub(crate) fn body_of(sections: &[(Kind, Vec<u8>)]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, bytes) in sections {
        for mut number in [usize::from(kind.number()), bytes.len()] {
            while number >= 0x80 {
                body.push(number as u8 | 0x80);
                number >>= 7;
            }
            body.push(number as u8);
        }
        body.extend(bytes);
    }
    body
}

/// A recipe with these sections.
pub(crate) fn recipe_with(sections: &[(Kind, Vec<u8>)]) -> Vec<u8> {
    with_header(VERSION, &body_of(sections))
}
