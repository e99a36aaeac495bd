//! `trainer fit`

pub(super) mod options;
mod pictures;
mod plane;
mod report;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_evaluation::conversion::{Encoded, OutputFormat, encode};
use glimpse_fitting::choice::Choice;
use glimpse_fitting::measurement::{FitReport, NamedRecipe, ReadingRows};
use glimpse_materials::{FittedMaterial, Material};
use options::{ReadingArgs, ViewingArgs};
use pictures::pictures;
use report::ReportEntry;

use super::expected_loss::caution;
use super::formats;
use super::lock::Lock;
use super::{LINEAR_ANY, emit};
use crate::output::{create_out_folder, refuse_input, write_files};

/// Fit a material to readings from a lab, as a device would.
///
/// INPUT. Each --measurements is a CSV file of one material. One line names the columns, in any
/// order:
///
/// - directions: theta_i, phi_i, theta_o, phi_o, or another set of angles (see `trainer query
///   --help`), or index, the number of the recipe's sample, from 0;
/// - reading: r, g, b; or L*, a*, b* (CIELAB); or value, of a sensor with one channel; or a
///   wavelength in nm (390, 390nm or w390) for each band;
/// - instrument: gloss-20, gloss-60, gloss-85, sci, sce, 45:0, 0:45 (which need no directions) or
///   multi-angle, as it shows its numbers: gloss units in value, and percent in the other columns; or
///   spread_i and spread_o, the full angles of the cones of light and sensor (degrees);
/// - optional: saturated (0 or 1); quantity (a value of --quantity, or counts); sample or material (see
///   --by); valid (0 or 1) or flag (ok or bad); scatter (BRDF or BTDF); exposure (ms or s) of counts;
///   place (such as a pixel), which reports name; and at any directions noise, the standard deviation
///   relative to the reading (see --noise).
///
/// A row may have the reading of one band, with the columns wavelength (or channel) and value. A
/// column of another name must be constant, or listed by --ignore. Rows come in any order. Repeated
/// readings of a direction are averaged, and their spread is printed. The noise of the mean of k
/// readings is divided by sqrt(k).
///
/// EVIDENCE. The numbers are compared with what they would be by another convention, unit or quantity.
/// If one of them explains the readings far better, the file is refused; if it may, the report asks.
///
/// RECIPES. Without RECIPE, or with one of `train --samples any`, readings may have any directions.
/// With a recipe of n samples, a row belongs to the nearest sample, at most 0.5 degrees away in every
/// angle; samples may be missing (no row, or empty cells) if the recipe was trained with --missing. If
/// a row is further away, all are fitted with the bundled recipe MODEL-any, and the report says so.
///
/// OUTLIERS. Each reading is predicted from the others, and so are neighbors together. Those far from
/// their prediction are reported as outliers. If the recipe tolerates missing readings, the fit
/// excludes the worst one, zeros and stray light where lamp and sensor are in each other's way, and
/// a few readings cut off at the largest number, unless --keep-all is given.
///
/// OUTPUT. The folder DIR gets
///
/// - material.json, the fit, which every command accepts as a material;
/// - sphere.png and lobe.svg, a rendered sphere and a plot of the plane of incidence with one standard
///   deviation on each side, and the readings there;
/// - readings.csv, with the reading of each sample as a BRDF, the fitted value and its standard
///   deviation, and z: the reading minus its prediction from the others, in standard deviations. You
///   can correct this file and fit it again, without --quantity and --white;
/// - with bands, bands.csv and bands.svg: readings and fit of each band, and their colors. Formats
///   and commands show RGB (CIE 1931, D65); rgl-spectral, openmaterial and ssdd have the bands;
/// - for the model linear material.basis, so that the folder can be moved;
/// - with --format, a folder DIR/formats with files for other programs.
///
/// With several --measurements, each gets a folder DIR/NAME, and with --by each material. A report is
/// printed on stdout. It names what the readings leave open (gloss, large angles, color), and the reading
/// that would help most.
///
/// Example: trainer fit --measurements multi-angle.csv --out paint/      # readings you already have
///          trainer plan --geometry paint-lab --blank paint.csv         # a sheet for displayed numbers
///          trainer inspect n16.recipe                                  # directions to measure
///          trainer fit n16.recipe --measurements gold.csv --format rgl --out gold/
///          trainer fit n16.recipe --measurements lab/*.csv --quantity reflectance-factor --out fits/
///          trainer fit --measurements 31-bands.csv --quantity reflectance-percent --out car/
///          trainer fit n16.recipe --measurements counts.csv --white white.csv --dark 96 --out felt/
///          trainer render sphere fits/ --out fits.png
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Fit {
    /// Recipe file, with its basis file NAME.basis next to it, if it has one, or the name of a bundled
    /// recipe
    #[arg(default_value = LINEAR_ANY)]
    recipe: PathBuf,
    /// Readings, a CSV file for each material
    #[arg(long, value_name = "FILE.csv", required = true, num_args = 1..)]
    measurements: Vec<PathBuf>,
    /// Column that names the material of a row: each gets a fit, in a folder of its name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
    /// Folder for the results; created, but its parent folder must exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    readings: ReadingArgs,
    #[command(flatten)]
    viewing: ViewingArgs,
    /// Formats of additional files of the material in DIR/formats; see `trainer convert`
    #[arg(long, value_enum, value_delimiter = ',', value_name = "FORMAT,...")]
    format: Vec<OutputFormat>,
    /// With a table in --format: write the BRDF as fitted, even if it is not reciprocal or its albedo is
    /// above 1
    #[arg(long)]
    as_fitted: bool,
    /// Keep all readings in the fit
    #[arg(long)]
    keep_all: bool,
    /// Replace the results of an earlier run in DIR
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The names of all files.
const FILES: [&str; 7] = [
    "material.json",
    "material.basis",
    "readings.csv",
    "bands.csv",
    "sphere.png",
    "lobe.svg",
    "bands.svg",
];
/// The folder of additional formats. It is separate, so that the fit's folder remains a source of one material.
const FORMATS: &str = "formats";

/// An input file with its material's name and output folder.
struct FitInput<'a> {
    name: String,
    path: &'a Path,
    folder: PathBuf,
}

impl Fit {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        ensure!(
            !self.as_fitted || self.format.iter().any(|format| format.is_table()),
            "--as-fitted has no effect without a table in --format, which all but nbrdf and shading models are: remove it"
        );
        let given = NamedRecipe::read(&self.recipe)?;
        let (inputs, rows): (Vec<_>, Vec<_>) = self.inputs()?.into_iter().unzip();
        self.refuse_overwrite(&inputs)?;

        // All fits are computed before any file is written, so that an error leaves no partial output.
        let mut fits = Vec::new();
        for mut rows in rows {
            let viewing = self.viewing.viewing(&mut rows)?;
            let fit = self.readings.fit(&given, rows, self.keep_all)?;
            let formats = self.formats(&fit.material, seed)?;
            fits.push((FitReport::new(&fit, viewing), fit, formats));
        }

        let _lock = Lock::of_folder(&self.out)?;
        let mut entries = Vec::new();
        for (input, (report, fit, formats)) in inputs.iter().zip(fits) {
            create_out_folder(&input.folder)?;
            let mut files = fit.folder(&input.folder, &report)?;
            files.extend(pictures(&fit, &report, &input.folder)?);
            write_files(&files, self.force)?;
            for path in FILES.map(|name| input.folder.join(name)) {
                // A file of an earlier run.
                if path.exists() && files.iter().all(|(written, _)| *written != path) {
                    fs::remove_file(&path)
                        .with_context(|| format!("cannot remove {}", path.display()))?;
                }
            }
            let formats = formats.iter().map(|(format, encoded)| {
                let folder = input.folder.join(FORMATS);
                create_out_folder(&folder)?;
                let paths = encoded.files.iter().map(|(name, _)| folder.join(name));
                formats::write(*format, encoded, &fit.material, paths.collect(), self.force)
            });
            let readings = fit.selection.readings;
            entries.push(ReportEntry {
                name: &input.name,
                folder: input.folder.display().to_string(),
                formats: formats.collect::<anyhow::Result<_>>()?,
                report,
                caution: caution(&readings.recipe.file.recipe())?,
                off_pattern: readings.off_pattern,
            });
        }
        let texts = entries.iter().map(ReportEntry::to_text);
        let texts = texts.collect::<anyhow::Result<Vec<_>>>()?;
        emit(self.json, &entries, || texts.join("\n"))
    }

    /// Returns a material in the formats of --format, each once.
    fn formats(
        &self,
        material: &FittedMaterial,
        seed: u64,
    ) -> anyhow::Result<Vec<(OutputFormat, Encoded)>> {
        let mut formats: Vec<(OutputFormat, Encoded)> = Vec::new();
        for &format in &self.format {
            if formats.iter().all(|(other, _)| *other != format) {
                eprintln!("converting {} to {}", material.name(), format.name());
                let as_fitted = self.as_fitted && format.is_table();
                let encoded = encode(material, format, material.name(), seed, as_fitted)?;
                formats.push((format, encoded));
            }
        }
        Ok(formats)
    }

    /// Returns the materials of all files, with their output folders and readings.
    fn inputs(&self) -> anyhow::Result<Vec<(FitInput<'_>, ReadingRows)>> {
        let mut inputs: Vec<(FitInput<'_>, ReadingRows)> = Vec::new();
        let has_one_file = self.measurements.len() == 1;
        for path in &self.measurements {
            let materials = match &self.by {
                Some(by) => self.readings.rows_by(path, by)?,
                None => vec![self.readings.rows(path)?],
            };
            for mut rows in materials {
                if self.by.is_some() && !has_one_file {
                    let file = path.file_stem().unwrap_or_default().to_string_lossy();
                    rows.name = format!("{file}-{}", rows.name);
                }
                let name = rows.name.clone();
                ensure!(
                    inputs.iter().all(|(input, _)| input.name != name),
                    "--measurements: two files or samples have the name {name}, and would get the same folder: rename one of \
                     them"
                );
                let folder = if has_one_file && self.by.is_none() {
                    self.out.clone()
                } else {
                    self.out.join(&name)
                };
                inputs.push((FitInput { name, path, folder }, rows));
            }
        }
        Ok(inputs)
    }

    /// Refuses to overwrite an input, or without --force the results of an earlier run.
    fn refuse_overwrite(&self, inputs: &[FitInput<'_>]) -> anyhow::Result<()> {
        let mut input_files = vec![&*self.recipe];
        input_files.extend(inputs.iter().map(|input| input.path));
        input_files.extend(self.readings.white.as_deref());
        for input in inputs {
            let formats = input.folder.join(FORMATS);
            // Other files in it would be mistaken for files of this material.
            ensure!(
                !formats.exists(),
                "{} exists already, with files of an earlier run: remove it, or give another --out",
                formats.display()
            );
            for path in FILES.map(|name| input.folder.join(name)) {
                for file in &input_files {
                    refuse_input(&path, file)?;
                }
                ensure!(
                    self.force || !path.exists(),
                    "{} exists already: give --force to replace it, or another --out",
                    path.display()
                );
            }
        }
        Ok(())
    }
}
