//! An independent writer of format 4, and small pseudo-random recipes of every legal combination of stages.

use glimpse_core::error::Error;
use glimpse_core::model::ModelKind::{self, CookTorrance, Neural, Phong};
use glimpse_core::recipe::Recipe;
use serde::{Serialize, Serializer};

use crate::random::Random;

pub(crate) const VERSION: u16 = 4;
/// Numbers in the packed form of a recipe.
pub(crate) fn packed(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn list<S: Serializer>(numbers: &[f32], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(&packed(numbers))
}

/// Components at directions: signed bytes with a scale for each component, or f32 without scales.
impl Rows {
    pub(crate) fn floats(entries: &[f32]) -> Self {
        let (entries, scales) = (packed(entries), Vec::new());
        Self { entries, scales }
    }

    fn random(random: &mut Random, [count, components]: [usize; 2], size: f32) -> Self {
        let bytes = weights(random, count * components);
        Self {
            entries: bytes.into_iter().map(i8::cast_unsigned).collect(),
            scales: scales(random, components, size),
        }
    }

    /// A row of K numbers.
    pub(crate) fn row(&self, index: usize, components: usize) -> Vec<f64> {
        let columns = 0..components;
        columns
            .map(|column| {
                let at = index * components + column;
                match self.scales.get(column) {
                    Some(scale) => f64::from(self.entries[at].cast_signed()) * f64::from(*scale),
                    None => {
                        let word = self.entries[4 * at..][..4].try_into().unwrap();
                        f64::from(f32::from_le_bytes(word))
                    }
                }
            })
            .collect()
    }
}

/// Defines sections. Some fields name a function that serializes them.
macro_rules! sections {
    ($($name:ident { $($field:ident: $type:ty $(= $with:literal)?),+ })+) => {$(
        #[derive(Clone, Debug, Default, Serialize)]
        pub(crate) struct $name {$(
            $(#[serde(serialize_with = $with)])?
            pub(crate) $field: $type,
        )+}
    )+};
}

sections! {
    Rows { entries: Vec<u8>, scales: Vec<f32> = "list" }
    Pattern { directions: Vec<f32> = "list", is_path: bool, expected_loss: Option<f32> }
    Sgd { model: u32, steps: u16, initial: Vec<f32> = "list", step_sizes: Vec<f32> = "list" }
    Ridge {
        precision: Vec<f32> = "list", difference_precision: Vec<f32> = "list",
        center: Vec<f32> = "list", rows: Rows, basis_checksum: u32
    }
    Net {
        bias: Vec<f32> = "list", components: u16, missing: u8, scale: f32,
        readings: Vec<i8>, reading_scales: Vec<f32> = "list",
        output: Vec<i8>, output_scales: Vec<f32> = "list"
    }
    Start {
        bias: Vec<f32> = "list", hidden: Vec<i8>, hidden_scales: Vec<f32> = "list",
        output: Vec<i8>, output_scales: Vec<f32> = "list"
    }
    GaussNewton {
        model: u32, steps: u16, initial: Vec<f32> = "list", precision: Vec<f32> = "list",
        reading_weight: f32, error_scale: f32,
        directions: Vec<f32> = "list", center: Vec<f32> = "list", rows: Rows
    }
    Noise { variance: f32, scales: Vec<f32> = "list" }
    Prediction {
        weights: Vec<f32> = "list", innovation: f32, residual: f32, bound: f32,
        max_innovation: f32, partial_loss: Vec<f32> = "list", partial_bound: Vec<f32> = "list"
    }
}

/// The models, in the order of their numbers in a recipe.
pub(crate) const MODELS: [ModelKind; 4] = [Phong, Neural, CookTorrance, ModelKind::Linear];

pub(crate) fn number_of(model: ModelKind) -> u32 {
    MODELS.iter().position(|other| *other == model).unwrap() as u32
}

/// The contents of a recipe.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contents {
    pub(crate) pattern: Pattern,
    pub(crate) sgd: Option<Sgd>,
    pub(crate) ridge: Option<Ridge>,
    pub(crate) net: Option<Net>,
    pub(crate) start: Option<Start>,
    pub(crate) gauss_newton: Option<GaussNewton>,
    pub(crate) noise: Option<Noise>,
    pub(crate) prediction: Option<Prediction>,
    pub(crate) metadata: Option<Vec<u8>>,
}

/// Kinds of sections, and their bytes.
pub(crate) type Sections = Vec<(u16, Vec<u8>)>;

impl Contents {
    /// n.
    pub(crate) fn samples(&self) -> usize {
        self.pattern.directions.len() / 3
    }

    pub(crate) fn model(&self) -> ModelKind {
        match (&self.sgd, &self.gauss_newton) {
            (Some(Sgd { model, .. }), _) | (_, Some(GaussNewton { model, .. })) => {
                MODELS[*model as usize]
            }
            _ => ModelKind::Linear,
        }
    }

    pub(crate) fn ridge(&mut self) -> &mut Ridge {
        self.ridge.as_mut().unwrap()
    }

    /// The memory of a scan in words, by the document.
    pub(crate) fn words(&self) -> usize {
        let n = self.samples();
        let triangle = |order: usize| order * (order + 1) / 2;
        let sgd = self.sgd.as_ref().map_or(0, |sgd| 2 * sgd.initial.len());
        let ridge = self.ridge.as_ref().map_or(0, |ridge| {
            let k = ridge.precision.len();
            let lists = if ridge.difference_precision.is_empty() {
                3
            } else {
                4
            };
            let r = n.min(k);
            4 * k + 1 + (lists + 1) * n + triangle(r) + 2 * r
        });
        let net = self.net.as_ref().map_or(0, |net| 4 * net.bias.len());
        let start = self.start.as_ref().map_or(0, |start| start.bias.len());
        let steps = self.gauss_newton.as_ref().map_or(0, |steps| {
            let (systems, active) = match self.model() {
                Neural => (3, 22),
                _ => (1, steps.initial.len()),
            };
            steps.initial.len() + systems * (2 * active + triangle(active))
        });
        10 * n + sgd + ridge + net + start + steps
    }

    pub(crate) fn sections(&self) -> Sections {
        fn part<T: Serialize>(kind: u16, part: &Option<T>) -> Option<(u16, Vec<u8>)> {
            let part = part.as_ref()?;
            Some((kind, postcard::to_extend(part, Vec::new()).unwrap()))
        }
        let sections = [
            part(0, &Some(&self.pattern)),
            part(1, &self.sgd),
            part(2, &self.ridge),
            part(3, &self.net),
            part(4, &self.start),
            part(5, &self.gauss_newton),
            part(6, &self.noise),
            part(128, &self.prediction),
            self.metadata.clone().map(|bytes| (129, bytes)),
        ];
        sections.into_iter().flatten().collect()
    }

    /// The recipe with other sections.
    pub(crate) fn write_with(&self, sections: &[(u16, Vec<u8>)]) -> Vec<u8> {
        let mut body = (self.samples() as u16).to_le_bytes().to_vec();
        body.extend((self.words() as u32).to_le_bytes());
        for section in sections {
            body = postcard::to_extend(section, body).unwrap();
        }
        with_header(VERSION, &body)
    }

    pub(crate) fn write(&self) -> Vec<u8> {
        self.write_with(&self.sections())
    }

    pub(crate) fn recipe(&self) -> Recipe<'static> {
        parsed(self.write())
    }

    /// Adds a prediction, with all of its lists.
    pub(crate) fn predicted(mut self) -> Self {
        const LOSS: [f32; 8] = [1.5, 0.75, 0.5, -0.25, 0.125, -0.5, -0.625, -0.75];
        const BOUND: [f32; 8] = [9.0, 7.0, 0.5, 4.0, 3.0, 1.25, 1.125, 1.0];
        let mut random = Random(5);
        let weights = self.net.as_ref().map_or(0, |net| net.components);
        let samples = self.samples();
        self.prediction = Some(Prediction {
            weights: random.numbers(1 + usize::from(weights), 0.1),
            innovation: 0.7,
            residual: 0.4,
            bound: 2.5,
            max_innovation: 1.0,
            partial_loss: LOSS[..samples].to_vec(),
            partial_bound: BOUND[..samples].to_vec(),
        });
        self
    }
}

/// Reads a valid recipe. Its bytes are leaked, so that its lifetime is static.
pub(crate) fn parsed(bytes: Vec<u8>) -> Recipe<'static> {
    Recipe::parse(bytes.leak()).unwrap()
}

/// The error of reading bytes that are not a recipe.
#[track_caller]
pub(crate) fn parse_error(bytes: &[u8]) -> Error {
    Recipe::parse(bytes).map(drop).unwrap_err()
}

/// A recipe of any version and body, with a valid header.
pub(crate) fn with_header(version: u16, body: &[u8]) -> Vec<u8> {
    file(b"GLMP", version, body)
}

/// A file with its header, whose checksum another implementation computes.
pub(crate) fn file(magic: &[u8; 4], version: u16, body: &[u8]) -> Vec<u8> {
    let mut checked = version.to_le_bytes().to_vec();
    checked.extend((body.len() as u32).to_le_bytes());
    let header = [magic, &checked[..]].concat();
    checked.extend(body);
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&checked);
    [&header[..], &checksum.to_le_bytes(), body].concat()
}

/// Low-discrepancy numbers from -0.5 to 0.5, all different.
pub(crate) fn spread(index: usize) -> f32 {
    (index as f32 * 0.618_034).fract() - 0.5
}

fn eight_samples() -> Pattern {
    let place = |k: f32| [0.05 + 0.08 * k, 0.1 + 0.07 * k, 0.4 * k];
    Pattern {
        directions: (0..8).flat_map(|k| place(k as f32)).collect(),
        is_path: false,
        expected_loss: Some(0.03),
    }
}

/// A recipe with 20 steps of SGD on eight samples: small weights, small steps.
pub(crate) fn sgd(model: ModelKind) -> Contents {
    let parameters = 0..model.parameters().unwrap();
    Contents {
        pattern: eight_samples(),
        sgd: Some(Sgd {
            model: number_of(model),
            steps: 20,
            initial: parameters.clone().map(|k| 0.4 * spread(k)).collect(),
            step_sizes: parameters.map(|k| 0.05 + 0.02 * spread(k)).collect(),
        }),
        ..Contents::default()
    }
}

/// A recipe of Linear: the same eight samples, five components.
pub(crate) fn linear() -> Contents {
    Contents {
        pattern: eight_samples(),
        ridge: Some(Ridge {
            precision: vec![40.0; 5],
            difference_precision: Vec::new(),
            center: (0..8)
                .map(|k| 4.5 + 0.3 * k as f32 + 0.1 * spread(k))
                .collect(),
            rows: Rows::floats(&(1..=40).map(|k| 12.0 * spread(k)).collect::<Vec<_>>()),
            basis_checksum: 0xfeed_beef,
        }),
        ..Contents::default()
    }
}

fn weights(random: &mut Random, count: usize) -> Vec<i8> {
    (0..count).map(|_| random.bits() as i8).collect()
}

/// Scales of either sign, none near 0.
fn scales(random: &mut Random, count: usize, size: f32) -> Vec<f32> {
    let mut scale = || size / 127.0 * (0.7 + 0.3 * random.number()) * random.number().signum();
    (0..count).map(|_| scale()).collect()
}

/// Numbers from half of `size` to `size`.
fn positive(random: &mut Random, count: usize, size: f32) -> Vec<f32> {
    let numbers = random.numbers(count, 0.25 * size).into_iter();
    numbers.map(|number| 0.75 * size + number).collect()
}

/// The triples (theta_h, theta_d, phi_d) of `count` directions above the horizon.
fn directions(count: usize, [by_theta_h, by_theta_d]: [f32; 2]) -> Vec<f32> {
    let angles = (0..count).flat_map(|k| {
        let k = k as f32;
        let (theta_h, theta_d) = ((by_theta_h * k).fract(), (by_theta_d * k).fract());
        [0.05 + 0.5 * theta_h, 0.1 + 0.7 * theta_d, (0.4 * k) % 6.0]
    });
    angles.collect()
}

/// n of the recipes in [`combinations`].
pub(crate) const SAMPLES: usize = 6;

/// The sizes of a pseudo-random recipe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) samples: usize,
    /// K.
    pub(crate) components: usize,
    /// m, 0 for no net.
    pub(crate) coefficients: usize,
    /// h.
    pub(crate) hidden: usize,
    /// g.
    pub(crate) units: usize,
    /// V.
    pub(crate) virtual_readings: usize,
}

pub(crate) const SMALL: Shape = Shape {
    samples: SAMPLES,
    components: 6,
    coefficients: 4,
    hidden: 5,
    units: 3,
    virtual_readings: 7,
};

/// A recipe with a ridge stage, a net if m is not 0, and a start and steps if a model is given.
pub(crate) fn random_recipe(shape: Shape, model: Option<ModelKind>) -> Contents {
    let (samples, components, units) = (shape.samples, shape.components, shape.units);
    let (coefficients, hidden) = (shape.coefficients, shape.hidden);
    let virtual_readings = shape.virtual_readings;
    let random = &mut Random(7 + components as u64);
    let rows = coefficients + hidden;
    let parameters = model.and_then(ModelKind::parameters).unwrap_or(0);
    let mapped = |numbers: Vec<f32>| numbers.into_iter().map(|x| x + 4.0).collect();
    Contents {
        pattern: Pattern {
            directions: directions(samples, [0.618, 0.311]),
            is_path: true,
            expected_loss: Some(0.03),
        },
        ridge: Some(Ridge {
            precision: positive(random, components, 1.0),
            difference_precision: Vec::new(),
            center: mapped(random.numbers(samples, 2.0)),
            rows: Rows::random(random, [samples, components], 0.5),
            basis_checksum: if parameters > 0 { 0 } else { 0xfeed_beef },
        }),
        net: (coefficients > 0).then(|| Net {
            bias: random.numbers(rows, 0.4),
            components: coefficients as u16,
            missing: 2,
            scale: 0.6,
            readings: weights(random, samples * 3 * rows),
            reading_scales: scales(random, rows, 0.5 / samples as f32),
            output: weights(random, coefficients * hidden),
            output_scales: scales(random, coefficients, 0.5),
        }),
        start: model.map(|_| Start {
            bias: random.numbers(units, 0.4),
            hidden: weights(random, units * 3 * components),
            hidden_scales: scales(random, units, 0.3),
            output: weights(random, parameters * units),
            output_scales: scales(random, parameters, 0.2),
        }),
        gauss_newton: model.map(|model| GaussNewton {
            model: number_of(model),
            steps: 3,
            initial: random.numbers(parameters, 0.4),
            precision: positive(random, if model == Neural { 22 } else { parameters }, 0.02),
            reading_weight: 0.8,
            error_scale: 0.2,
            directions: directions(virtual_readings, [0.445, 0.273]),
            center: mapped(random.numbers(virtual_readings, 2.0)),
            rows: Rows::random(random, [virtual_readings, components], 0.8),
        }),
        ..Contents::default()
    }
}

/// Adds precisions of the differences between channels.
pub(crate) fn with_differences(mut contents: Contents) -> Contents {
    let ridge = contents.ridge();
    let precision = ridge.precision.iter().rev();
    ridge.difference_precision = precision.map(|p| 3.0 * p).collect();
    contents
}

/// The recipe with noise, and with a scale for each reading.
pub(crate) fn with_noise(mut contents: Contents) -> Contents {
    let scales = (0..contents.samples()).map(|sample| 1.0 - 0.125 * (sample % 5) as f32);
    contents.noise = Some(Noise {
        variance: 0.02,
        scales: scales.collect(),
    });
    contents
}

/// Small recipes of each legal combination of stages, without a prediction: their names and contents.
pub(crate) fn combinations() -> Vec<(String, Contents)> {
    let mut all = Vec::new();
    for model in [Phong, CookTorrance, Neural] {
        let mut contents = sgd(model);
        contents.sgd.as_mut().unwrap().steps = 3;
        all.push((format!("{model}: sgd"), contents));
    }
    // K below, equal to, and above n.
    for components in [4, SAMPLES, 10] {
        for coefficients in [0, 4] {
            let shape = Shape {
                components,
                coefficients,
                ..SMALL
            };
            for model in [None, Some(Phong), Some(CookTorrance), Some(Neural)] {
                let contents = random_recipe(shape, model);
                let name = format!("{model:?}: m = {coefficients}, K = {components}");
                all.push((
                    format!("{name}, differences, noise"),
                    with_noise(with_differences(contents.clone())),
                ));
                all.push((name, contents));
            }
        }
    }
    for contents in [linear(), with_differences(linear())] {
        all.push(("linear: f32 rows".into(), contents));
    }
    all
}

/// The combinations whose fit tolerates missing readings, with predictions.
pub(crate) fn tolerant() -> Vec<Contents> {
    let all = combinations().into_iter().map(|(_, contents)| contents);
    all.filter(|contents| contents.net.is_some())
        .map(Contents::predicted)
        .collect()
}
