//! `trainer fit`

mod folder;
mod options;
mod report;

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use folder::{FILES, contents};
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::has_content;
use glimpse_materials::{BasisFile, FittedMaterial, Material};
use glimpse_trainer::conversion::{OutputFormat, encode, loss_of_file};
use glimpse_trainer::measurement::{DEFAULT_TOLERANCE, Measurements, Selection, fit};
use glimpse_trainer::metrics::Metrics;
use options::QuantityArgs;
use report::{FitReport, FormatSummary, ReportEntry, file_name};

use super::formats::{self, Files};
use super::lock::Lock;
use super::output::{create_out_folder, refuse_input, write_file, write_files};
use super::{emit, read_recipe};

/// Fit a material to readings from a lab, as a device would.
///
/// INPUT. Each --measurements is a CSV file of one material. Its first line names the columns, in
/// any order:
///
/// - directions: theta_i, phi_i, theta_o, phi_o, or theta_h, theta_d, phi_d, in degrees (as for
///   `trainer query`), or index, the number of the recipe's sample, from 0;
/// - reading: r, g, b, or value for a sensor with one channel;
/// - optional: saturated (0 or 1), quantity (a value of --quantity, or counts), and material, which
///   must be the same in all rows.
///
/// Other columns are ignored. Rows come in any order. Samples may be missing (no row, or empty
/// cells) if the recipe was trained with --missing. Repeated readings of a sample are averaged, and
/// their spread is printed. A row belongs to the nearest sample, at most --tolerance away in every
/// angle.
///
/// OUTLIERS. Each reading is predicted from the others. Readings far from their prediction are
/// reported as outliers. If the recipe tolerates missing readings, the fit excludes the worst one,
/// unless it helps to predict the others or --keep-all is given.
///
/// OUTPUT. The folder DIR gets
///
/// - material.json, the fit, which every command accepts as a material;
/// - sphere.png and lobe.svg, a rendered sphere and a plot of the plane of incidence;
/// - readings.csv, with the reading of each sample as a BRDF, the fitted value, and z: the reading
///   minus its prediction from the others, in standard deviations. You can correct this file and fit
///   it again, without --quantity and --white;
/// - for the model linear the basis, so that the folder can be moved;
/// - with --format, a folder DIR/formats with files for other programs.
///
/// With several --measurements, each gets a folder DIR/NAME. A report is printed on stdout.
///
/// Example: trainer inspect n16.recipe                                  # directions to measure
///          trainer fit n16.recipe --measurements gold.csv --format rgl --out gold/
///          trainer fit n16.recipe --measurements lab/*.csv --quantity reflectance-factor --out fits/
///          trainer fit n16.recipe --measurements counts.csv --white white.csv --dark 96 --out felt/
///          trainer render sphere fits/ --out fits.png
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Fit {
    /// Recipe file; for the model linear its basis file must be next to it
    recipe: PathBuf,
    /// Readings, a CSV file for each material
    #[arg(long, value_name = "FILE.csv", required = true, num_args = 1..)]
    measurements: Vec<PathBuf>,
    /// Folder for the results; created, but its parent folder must exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Largest distance of a row from its sample in degrees, above 0 to 180
    #[arg(long, value_name = "DEGREES", default_value_t = DEFAULT_TOLERANCE, value_parser = super::numbers::degrees)]
    tolerance: f32,
    #[command(flatten)]
    quantity: QuantityArgs,
    /// Formats of additional files of the material in DIR/formats; see `trainer convert`
    #[arg(long, value_parser = formats::parser(), value_delimiter = ',', value_name = "FORMAT,...")]
    format: Vec<OutputFormat>,
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
        let (file, basis) = read_recipe(&self.recipe)?;
        let recipe = file.recipe();
        let inputs = self.inputs()?;
        self.refuse_overwrite(&inputs, basis.is_some())?;
        let pattern: Vec<_> = recipe.pattern().collect();
        let tolerance = f64::from(self.tolerance).to_radians();
        let quantity = self.quantity.read(&pattern, tolerance)?;

        // All fits are computed before any file is written, so that an error leaves no partial output.
        let mut fits = Vec::new();
        for input in &inputs {
            let measured = Measurements::read(input.path, &pattern, tolerance, &quantity)?;
            let fit = Selection::new(&recipe, measured, self.keep_all)
                .and_then(|selection| fit(&recipe, basis.as_ref(), input.name.clone(), selection))
                .with_context(|| input.path.display().to_string())?;
            let report = FitReport::new(&self.recipe, &recipe, input.path, &quantity, &fit)?;
            let formats = self.formats(&fit.material, &input.folder, seed)?;
            fits.push((fit, report, formats));
        }

        create_out_folder(&self.out)?;
        let _lock = Lock::of_folder(&self.out)?;
        let basis = self.copy_basis(&recipe, basis.is_some())?;
        let mut entries = Vec::new();
        for (input, (fit, report, formats)) in inputs.iter().zip(fits) {
            create_out_folder(&input.folder)?;
            let basis = basis.as_ref().map(|(name, checksum)| {
                let up = if input.folder == self.out { "" } else { "../" };
                BasisFile::new(format!("{up}{name}"), *checksum)
            });
            let contents = contents(&fit, &pattern, basis.as_ref(), &report)?;
            for (name, bytes) in FILES.iter().zip(contents) {
                write_file(&input.folder.join(name), &bytes, self.force)?;
            }
            let formats = formats.iter().map(|(files, metrics)| {
                self.write_format(&input.folder, &fit.material, files, *metrics)
            });
            entries.push(ReportEntry {
                name: &input.name,
                folder: input.folder.display().to_string(),
                formats: formats.collect::<anyhow::Result<_>>()?,
                report,
            });
        }
        emit(self.json, &entries, || {
            let texts = entries.iter().map(|entry| entry.to_text(self.keep_all));
            texts.collect::<Vec<_>>().join("\n")
        })
    }

    /// Writes the files of a format. Prints and returns its errors against the fit.
    fn write_format(
        &self,
        folder: &Path,
        material: &FittedMaterial,
        files: &Files,
        metrics: Option<Metrics>,
    ) -> anyhow::Result<FormatSummary> {
        create_out_folder(&folder.join(FORMATS))?;
        write_files(files, self.force)?;
        let (first, _) = files.first().context("a format has no files")?;
        let delta_e = metrics.map(|metrics| metrics.delta_e);
        let loss = match metrics {
            Some(metrics) => metrics.loss,
            None => loss_of_file(material, first)?,
        };
        let color = delta_e.map_or(String::new(), |error| {
            format!(" and color error {error:.2}")
        });
        let file = first.display().to_string();
        eprintln!("{file}: loss {loss:.6}{color} against the fit");
        Ok(FormatSummary {
            file,
            loss,
            delta_e,
        })
    }

    /// Returns a material's files in the formats of --format, each once, and the errors of shading models.
    fn formats(
        &self,
        material: &FittedMaterial,
        folder: &Path,
        seed: u64,
    ) -> anyhow::Result<Vec<(Files, Option<Metrics>)>> {
        let folder = folder.join(FORMATS);
        let is_first =
            |(index, format): &(usize, &OutputFormat)| !self.format[..*index].contains(format);
        let distinct = self.format.iter().enumerate().filter(is_first);
        let files = distinct.map(|(_, format)| {
            eprintln!("converting {} to {}", material.name(), format.name());
            let encoded = encode(material, *format, material.name(), seed)?;
            let files = encoded.files.into_iter();
            let files = files.map(|(name, bytes)| (folder.join(name), bytes));
            Ok((files.collect(), encoded.metrics))
        });
        files.collect()
    }

    /// Returns the input files with their materials' names and output folders.
    fn inputs(&self) -> anyhow::Result<Vec<FitInput<'_>>> {
        let mut inputs: Vec<FitInput<'_>> = Vec::new();
        for path in &self.measurements {
            let name = path.file_stem().unwrap_or_default();
            let name = name.to_string_lossy().into_owned();
            ensure!(
                inputs.iter().all(|input| input.name != name),
                "--measurements: two files have the name {name}, and would get the same folder: rename one of them"
            );
            let folder = match self.measurements.len() {
                1 => self.out.clone(),
                _ => self.out.join(&name),
            };
            inputs.push(FitInput { name, path, folder });
        }
        Ok(inputs)
    }

    /// Refuses to overwrite an input, or without --force the results of an earlier run.
    fn refuse_overwrite(&self, inputs: &[FitInput<'_>], has_basis: bool) -> anyhow::Result<()> {
        let mut input_files: Vec<&Path> = vec![&self.recipe];
        input_files.extend(inputs.iter().map(|input| input.path));
        input_files.extend(self.quantity.white());
        for input in inputs {
            let formats = input.folder.join(FORMATS);
            // Other files in it would be mistaken for files of this material.
            ensure!(
                !formats.exists(),
                "{} exists already, with files of an earlier run: remove it, or give another --out",
                formats.display()
            );
            for name in FILES {
                let path = input.folder.join(name);
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
        if has_basis {
            for file in &input_files {
                refuse_input(&self.basis_copy(), file)?;
            }
        }
        Ok(())
    }

    fn basis_copy(&self) -> PathBuf {
        self.out
            .join(Basis::path_for(Path::new(&file_name(&self.recipe))))
    }

    /// Copies the whole basis into the output folder, once for all fits. Returns its name and checksum.
    fn copy_basis(
        &self,
        recipe: &Recipe<'_>,
        has_basis: bool,
    ) -> anyhow::Result<Option<(String, u32)>> {
        let checksum = recipe.basis_checksum().filter(|_| has_basis);
        let Some(checksum) = checksum else {
            return Ok(None);
        };
        let (from, to) = (Basis::path_for(&self.recipe), self.basis_copy());
        let bytes =
            std::fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
        // The recipe may be in the output folder, with its basis.
        if !has_content(&to, &bytes) {
            write_file(&to, &bytes, self.force)?;
        }
        Ok(Some((file_name(&to), checksum)))
    }
}
