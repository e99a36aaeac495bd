//! Small synthetic recipes, and recipes that the crate's own writer rejects.

use glimpse_core::model::{Model, ModelKind, Neural};
use glimpse_core::recipe::{
    ExpectedLoss, Kind, PackedDescent, PackedMethod, PackedRidge, Provenance, Recipe, RecipeError,
    RecipeParts, VERSION,
};

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

/// The field or the error that a change causes, and the change to a recipe's contents.
pub(crate) type Change<E, T> = (E, fn(&mut T));

/// The contents of a recipe that is fitted by descent.
#[derive(Clone, Debug)]
pub(crate) struct DescentContents {
    pub(crate) model: ModelKind,
    /// Number of SGD steps.
    pub(crate) inner_steps: u16,
    /// Triples (theta_h, theta_d, phi_d) in radians.
    pub(crate) pattern: Vec<f32>,
    /// Initial parameters.
    pub(crate) initial: Vec<f32>,
    /// A step size for each parameter.
    pub(crate) step_sizes: Vec<f32>,
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
        let method = PackedMethod::Descent(PackedDescent {
            model: self.model,
            inner_steps: self.inner_steps,
            initial: &packed(&self.initial),
            step_sizes: &packed(&self.step_sizes),
        });
        write_with(&self.pattern, method, self.expected_loss)
    }
}

fn write_with(
    pattern: &[f32],
    method: PackedMethod<'_>,
    expected_loss: f32,
) -> Result<Vec<u8>, RecipeError> {
    write(&RecipeParts {
        expectation: Some(ExpectedLoss {
            loss: expected_loss,
            standard_error: Some(0.001),
            materials: 10,
            on: "nothing",
        }),
        provenance: Some(Provenance {
            trainer: "test",
            data: "none",
            materials: 0,
            schedule: "none",
            seed: 0,
            options: "none",
        }),
        ..RecipeParts::new(&packed(pattern), method)
    })
}

/// The contents of a recipe of the model Linear.
#[derive(Clone, Debug)]
pub(crate) struct RidgeContents {
    /// Triples (theta_h, theta_d, phi_d) in radians.
    pub(crate) pattern: Vec<f32>,
    /// The number of components, m.
    pub(crate) components: u16,
    /// n rows of m numbers.
    pub(crate) basis: Vec<f32>,
    /// n numbers.
    pub(crate) mean: Vec<f32>,
    /// n BRDFs, sr^-1.
    pub(crate) median: Vec<f32>,
    /// n numbers.
    pub(crate) weight: Vec<f32>,
    /// m numbers.
    pub(crate) precision: Vec<f32>,
    /// The CRC-32 of the whole basis.
    pub(crate) basis_checksum: u32,
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
        let method = PackedMethod::Ridge(PackedRidge {
            components: self.components,
            basis: &packed(&self.basis),
            mean: &packed(&self.mean),
            median: &packed(&self.median),
            weight: &packed(&self.weight),
            precision: &packed(&self.precision),
            basis_checksum: self.basis_checksum,
        });
        write_with(&self.pattern, method, self.expected_loss)
    }
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
