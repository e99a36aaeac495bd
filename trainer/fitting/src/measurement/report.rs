//! The report on a fit, and the files of its folder.

use std::path::{Path, PathBuf};

use glimpse_core::scan::Residual;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::{BasisFile, FittedMaterial, Viewing};
use serde::Serialize;

use super::alternatives::Doubt;
use super::fit::MaterialFit;
use super::gaps::Gaps;
use super::instrument::Instrument;
use super::loss_scale::LossScale;
use super::noise::NoiseSummary;
use super::optics::{COLUMNS, Optics};
use super::outliers::{OutlierKind, OutlierSet};
use super::readings::ReadingStatus;
use super::spectrum::SpectrumReport;
use super::summary::TableSummary;
use crate::choice::Choice;
use crate::route::relative_arms;

/// The report on a fit. Field names are those of `material.json`, of the trainer's JSON, and in Python.
#[derive(Clone, Debug, Serialize)]
pub struct FitReport {
    /// The version of this program.
    pub trainer: &'static str,
    /// The recipe that fits the readings.
    pub recipe: RecipeSummary,
    /// The input.
    pub measured: InputSummary,
    /// Another way to read the file that explains it better; None if there is none.
    pub doubt: Option<Doubt>,
    /// The readings.
    pub readings: ReadingSummary,
    /// The noise of the readings; None with a recipe for its own directions, whose fit has the noise of its training.
    pub noise: Option<NoiseSummary>,
    /// The properties of the material about which the readings state nothing.
    pub gaps: Gaps,
    /// The residual at the used readings.
    pub residual: Residual,
    /// The expected loss; None if it is unknown.
    pub expected_loss: Option<LossPrediction>,
    /// Losses to compare it with.
    pub loss_scale: LossScale,
    /// The colors of bands; None without bands.
    pub spectrum: Option<SpectrumReport>,
}

/// The recipe of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct RecipeSummary {
    /// Its name.
    pub file: String,
    /// Its checksum, 8 hexadecimal digits.
    pub checksum: String,
    /// Its model.
    pub model: &'static str,
    /// The number of samples.
    pub samples: usize,
    /// True if it tolerates missing readings.
    pub takes_missing: bool,
    /// True if the readings are not at the given recipe's directions, and this one fits them.
    pub off_pattern: bool,
}

/// The input of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct InputSummary {
    /// The file's name, without directories.
    pub file: String,
    /// The quantity of its numbers, as a column `quantity` names it.
    pub quantity: String,
    /// The number of rows with a reading.
    pub rows: usize,
    /// The largest distance of a row from its sample, in degrees; None if rows have no directions of a pattern.
    pub furthest_degrees: Option<f64>,
    /// The conditions of readings in CIELAB; None if they are not.
    pub cielab: Option<Viewing>,
    /// The meaning that the table was given.
    #[serde(flatten)]
    pub table: TableSummary,
}

/// Counts and lists of samples, by the state of their readings.
#[derive(Clone, Debug, Serialize)]
pub struct ReadingSummary {
    /// The number of readings that the fit used.
    pub used: usize,
    /// The samples whose readings the fit did not use.
    pub unused: Vec<UnusedSample>,
    /// The samples with a saturated reading, used or not.
    pub saturated: Vec<usize>,
    /// The samples whose reading is 0 or below in all channels.
    pub no_light: Vec<usize>,
    /// The number of samples with several readings.
    pub repeated: usize,
    /// The largest coefficient of variation of repeated readings.
    pub largest_spread: Option<f32>,
    /// The sample with the largest coefficient of variation.
    pub most_spread: Option<usize>,
    /// Readings that are improbable given the other readings, used or not, set by set.
    pub outliers: Vec<OutlierSummary>,
}

/// A sample that a fit did not use.
#[derive(Clone, Debug, Serialize)]
pub struct UnusedSample {
    /// The index of the sample.
    pub sample: usize,
    /// The reason.
    pub status: ReadingStatus,
}

/// An outlier.
#[derive(Clone, Debug, Serialize)]
pub struct OutlierSummary {
    /// The index of the sample.
    pub sample: usize,
    /// Its instrument; None for a goniometer.
    pub instrument: Option<Instrument>,
    /// Its place, by the column of this name.
    pub place: Option<String>,
    /// The likely cause.
    pub kind: OutlierKind,
    /// The status of the reading.
    pub status: ReadingStatus,
    /// The mean of readings with the same cause minus their predictions, in standard deviations.
    pub z: f32,
    /// The magnitude of z above which readings are outliers.
    pub threshold: f32,
    /// The reading as a BRDF, sr^-1.
    pub reading: [f32; 3],
    /// The BRDF predicted from the other readings, sr^-1.
    pub expected: [f32; 3],
}

impl FitReport {
    /// Creates the report on a fit, with colors of bands by a viewing.
    #[must_use]
    pub fn new(fit: &MaterialFit, viewing: Viewing) -> Self {
        let readings = &fit.selection.readings;
        let recipe = readings.recipe.file.recipe();
        let file = readings.rows.path.file_name().unwrap_or_default();
        let mut report = Self {
            trainer: env!("CARGO_PKG_VERSION"),
            recipe: RecipeSummary {
                file: readings.recipe.name.clone(),
                checksum: format!("{:08x}", recipe.checksum()),
                model: recipe.model().name(),
                samples: recipe.samples(),
                takes_missing: recipe.tolerates_missing(),
                off_pattern: readings.off_pattern.is_some(),
            },
            measured: InputSummary {
                file: file.to_string_lossy().into_owned(),
                quantity: readings.quantity.name(),
                rows: readings.rows.readings.len(),
                furthest_degrees: readings.max_distance.map(|distance| distance.degrees),
                cielab: readings.rows.cielab,
                table: readings.rows.summary.clone(),
            },
            doubt: fit.doubt,
            readings: ReadingSummary::new(fit),
            noise: readings.noise,
            gaps: Gaps::new(fit),
            residual: fit.residual,
            expected_loss: None,
            loss_scale: LossScale::of(&fit.selection.posterior),
            spectrum: SpectrumReport::new(fit, viewing),
        };
        let is_enough = 2 * report.readings.used >= recipe.samples();
        // Expected losses hold for materials that reflect light, like all training materials.
        if !report.is_mostly_dark() && (is_enough || recipe.bounds_partial_loss()) {
            report.expected_loss = Some(fit.prediction);
        }
        report
    }

    /// Returns true if most readings have no light.
    #[must_use]
    pub fn is_mostly_dark(&self) -> bool {
        let read = self.recipe.samples - self.readings.missing().len();
        2 * self.readings.no_light.len() > read
    }
}

impl ReadingSummary {
    fn new(fit: &MaterialFit) -> Self {
        let readings = &fit.selection.readings;
        let samples = &readings.samples;
        let spreads = samples.iter().enumerate();
        let spreads =
            spreads.filter_map(|(index, sample)| Some((index, sample.coefficient_of_variation()?)));
        let most_spread = spreads.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let unused = readings.indices(|sample| sample.status != ReadingStatus::Used);
        let sets = fit.selection.outliers.sets.iter();
        let outliers = sets.flat_map(|set| set.samples.iter().map(move |sample| (set, *sample)));
        let outlier = |(set, sample): (&OutlierSet, usize)| {
            let reading = &samples[sample];
            Some(OutlierSummary {
                sample,
                instrument: reading.optics.instrument,
                place: reading.place.clone(),
                kind: set.kind,
                status: reading.status,
                z: set.z as f32,
                threshold: set.threshold as f32,
                reading: reading.brdf.mean()?,
                expected: reading.prediction?.expected,
            })
        };
        Self {
            used: samples.len() - unused.len(),
            unused: unused
                .into_iter()
                .map(|sample| UnusedSample {
                    sample,
                    status: samples[sample].status,
                })
                .collect(),
            saturated: readings.indices(|sample| sample.brdf.saturated),
            no_light: readings.indices(|sample| {
                let mean = sample.brdf.mean();
                mean.is_some_and(|mean| mean.into_iter().all(|value| value <= 0.0))
            }),
            repeated: readings.indices(|sample| sample.brdf.count > 1).len(),
            largest_spread: most_spread.map(|(_, spread)| spread),
            most_spread: most_spread.map(|(index, _)| index),
            outliers: outliers.filter_map(outlier).collect(),
        }
    }

    /// Returns the samples without a reading.
    #[must_use]
    pub fn missing(&self) -> Vec<usize> {
        let unused = self.unused.iter();
        let missing = unused.filter(|unused| unused.status == ReadingStatus::Missing);
        missing.map(|unused| unused.sample).collect()
    }
}

/// Files that belong together: their paths and contents.
pub type MaterialFiles = Vec<(PathBuf, Vec<u8>)>;

/// Returns the file of a fitted material, and for the model Linear that of its basis next to it, `NAME.basis`.
///
/// # Errors
/// If `metadata` is neither a map nor a struct.
pub fn material_files(
    material: &FittedMaterial,
    path: &Path,
    basis: Option<&BasisTable>,
    metadata: impl Serialize,
) -> serde_json::Result<MaterialFiles> {
    let basis_path = path.with_extension("basis");
    let name = basis_path.file_name().unwrap_or_default().to_string_lossy();
    let reference = basis.map(|basis| BasisFile::new(name.into_owned(), basis.checksum()));
    let json = material.to_json(reference.as_ref(), metadata)?;
    let basis = basis.map(|basis| (basis_path.clone(), basis.file().to_vec()));
    let files = basis
        .into_iter()
        .chain([(path.to_owned(), json.into_bytes())]);
    Ok(files.collect())
}

impl MaterialFit {
    /// Returns the file of the material with a report, and for the model Linear that of its basis next to it.
    ///
    /// # Errors
    /// Never in practice: the report is a struct.
    pub fn files(&self, path: &Path, report: &FitReport) -> serde_json::Result<MaterialFiles> {
        let basis = self.selection.readings.recipe.basis.as_deref();
        material_files(&self.material, path, basis, report)
    }

    /// Returns the files of a folder: material.json and its basis, readings.csv, and with bands bands.csv.
    ///
    /// # Errors
    /// As [`files`](Self::files).
    pub fn folder(&self, folder: &Path, report: &FitReport) -> serde_json::Result<MaterialFiles> {
        let mut files = self.files(&folder.join("material.json"), report)?;
        files.push((folder.join("readings.csv"), self.readings_csv().into()));
        if let Some(spectrum) = &report.spectrum {
            files.push((folder.join("bands.csv"), spectrum.to_csv().into()));
        }
        Ok(files)
    }

    /// Returns readings.csv, with a row for each sample. It can be corrected and fitted again.
    fn readings_csv(&self) -> String {
        let readings = &self.selection.readings;
        let samples = readings.samples.iter();
        let mut optics = samples.clone().map(|sample| sample.optics);
        let has_optics = optics.any(|optics| optics != Optics::default());
        let mut csv = ["", COLUMNS][usize::from(has_optics)].to_owned()
            + "index,theta_i,phi_i,theta_o,phi_o,r,g,b,quantity,saturated,times,spread,fitted_r,fitted_g,fitted_b,\
             deviation_r,deviation_g,deviation_b,expected_r,expected_g,expected_b,z,status\n";
        let posterior = &self.selection.posterior;
        let deviations = posterior.deviations(self.material.fitted(), readings.pattern());
        for (index, (sample, deviation)) in samples.zip(deviations).enumerate() {
            let spread = sample.coefficient_of_variation();
            let prediction = sample.prediction;
            let rgb = |rgb: Option<[f32; 3]>| match rgb {
                Some([r, g, b]) => format!("{r},{g},{b}"),
                None => ",,".to_owned(),
            };
            let [theta_i, _, theta_o, phi] = relative_arms(sample.angles).to_array();
            let (unit, fixed) = (sample.optics.gloss_unit(), sample.optics.fixed());
            if has_optics {
                csv += &sample.optics.to_csv(sample.brdf.mean());
            }
            let angles = format!("{theta_i:.5},0,{theta_o:.5},{phi:.5}");
            let angles = fixed.map_or(angles, |_| ",,,".to_owned());
            csv += &format!(
                "{index},{angles},{},{},{},{},{},{},{},{},{},{}\n",
                rgb(sample.brdf.mean().filter(|_| unit.is_none())),
                unit.map_or("brdf", |_| ""),
                u8::from(sample.brdf.saturated),
                sample.brdf.count,
                spread.map_or_else(String::new, |spread| format!("{spread:.4}")),
                rgb(Some(sample.of(&self.material))),
                rgb(Some(deviation).filter(|_| sample.aperture.is_none())),
                rgb(prediction.map(|prediction| prediction.expected)),
                prediction.map_or_else(String::new, |prediction| format!("{:.2}", prediction.z)),
                sample.status.name(),
            );
        }
        csv
    }
}
