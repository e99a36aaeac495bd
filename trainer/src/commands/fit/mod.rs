//! `trainer fit`

mod about;
mod folder;
mod options;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use about::About;
use anyhow::{Context, ensure};
use clap::{ArgGroup, Args};
use folder::Folder;
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::holds;
use glimpse_materials::{BasisFile, Fitted, FittedMaterial, Material};
use glimpse_trainer::conversion::loss_of;
use glimpse_trainer::measurement::{DeviceReport, Fit as Found, Meaning, Measured, fit};
use options::MeaningArgs;

use super::formats::{Files, FormatName, files_of};
use super::lock::Lock;
use super::output::{make_out, refuse_input, write_file_forced, write_files_forced};
use super::{print, read_recipe};

/// Fit readings from a lab by a recipe, as a device would, without one.
///
/// Each --measurements is a CSV file of one material whose first line names its columns, in any
/// order: where a reading was taken, theta_i, phi_i, theta_o, phi_o or theta_h, theta_d, phi_d in
/// degrees (as for `trainer query`), or index, the number of the recipe's sample, from 0; what
/// was read, r, g, b, or value of a sensor with one channel; and perhaps saturated, 0 or 1. Other
/// columns are passed over. Rows may come in any order; a sample may be missing (no row, or empty
/// cells) if the recipe was trained with --missing, and be read several times: then the mean
/// counts, and the spread is shown. A row belongs to the nearest of the recipe's samples, no more
/// than --tolerance away in any angle.
///
/// Readings that the others make improbable are named. A recipe that can do without leaves them
/// out of the fit, at most a quarter of them; with --keep-all it does not.
///
/// DIR gets material.json, which every command takes as a material; sphere.png; lobe.svg; and
/// readings.csv: each sample, what was read as a BRDF, what is fitted there, and how far it is from
/// what the others say of it (z, in standard deviations). It can be corrected and fitted again,
/// without options such as --quantity and --white. Of the model linear it gets the basis too,
/// so that the folder can be moved. --format adds what other programs read. Of several files each
/// gets a folder DIR/NAME. Results go to stdout.
///
/// Example: trainer inspect n16.recipe                   # where to read
///          trainer fit n16.recipe --measurements gold.csv --format rgl --out gold/
///          trainer fit n16.recipe --measurements lab/*.csv --quantity reflectance-factor --out fits/
///          trainer fit n16.recipe --measurements counts.csv --white white.csv --dark 96 --out felt/
///          trainer fit n16.recipe --values scan.json --out scanned/     # what a device has found
///          trainer render sphere fits/ --out fits.png
#[derive(Args)]
#[command(
    verbatim_doc_comment,
    group = ArgGroup::new("given").args(["measurements", "values"]).required(true)
)]
pub(crate) struct Fit {
    /// The recipe; of the model linear with its basis beside it
    recipe: PathBuf,
    /// Readings, CSV: a file for each material
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    measurements: Vec<PathBuf>,
    /// Instead: what a device has found, as `trainer virtual-scanner --out` writes it
    #[arg(long, value_name = "FILE.json")]
    values: Option<PathBuf>,
    /// Where to leave the results: made, but none above it
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Largest distance of a row from its sample, degrees above 0 to 180 [default: 0.5]
    #[arg(long, value_name = "DEGREES", conflicts_with = "values", value_parser = super::numbers::degrees)]
    tolerance: Option<f32>,
    #[command(flatten)]
    meaning: MeaningArgs,
    /// Other formats to write the material in, into DIR/formats
    #[arg(long, value_enum, value_delimiter = ',', value_name = "FORMAT,...")]
    format: Vec<FormatName>,
    /// Leave no reading out that looks wrong
    #[arg(long, conflicts_with = "values")]
    keep_all: bool,
    /// Replace the results of an earlier run in DIR
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// How far a row may be from its sample unless told, degrees: what arms of a lab are off by.
const TOLERANCE: f32 = 0.5;

/// The folder of other formats: a folder of materials is read without it.
const FORMATS: &str = "formats";

/// A fit, and where it goes.
struct Job<'a> {
    name: String,
    input: &'a Path,
    folder: PathBuf,
}

impl Fit {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let (file, basis) = read_recipe(&self.recipe)?;
        let recipe = file.recipe();
        let jobs = self.jobs()?;
        self.refuse_inputs(&jobs, basis.is_some())?;
        let pattern: Vec<_> = recipe.pattern().collect();
        let meaning = self.meaning.read(&pattern, self.tolerance())?;

        // All of it before anything is written.
        let mut folders = Vec::new();
        for job in &jobs {
            let (measured, found) = self.find(&recipe, job, &meaning)?;
            let fitted = Fitted::new(recipe.model(), found.values.clone(), basis.as_ref());
            let material = fitted.and_then(|fitted| FittedMaterial::new(job.name.clone(), fitted));
            let material = material.with_context(|| {
                format!(
                    "{}: {} values are not what the recipe's model has",
                    job.input.display(),
                    found.values.len()
                )
            })?;
            let about = About::new(
                self.label(),
                &recipe,
                job.input,
                &meaning,
                &measured,
                &found,
            )?;
            folders.push(Folder {
                material,
                pattern: &pattern,
                measured,
                found,
                about,
            });
        }

        let formats = jobs.iter().zip(&folders);
        let formats =
            formats.map(|(job, folder)| self.formats(&folder.material, &job.folder, seed));
        let formats: Vec<_> = formats.collect::<anyhow::Result<_>>()?;

        make_out(&self.out)?;
        let _lock = Lock::within(&self.out)?;
        let basis = self.copy_basis(&recipe, basis.is_some())?;
        for ((job, folder), formats) in jobs.iter().zip(&folders).zip(&formats) {
            make_out(&job.folder)?;
            let basis = basis.as_ref().map(|(name, checksum)| {
                let up = if job.folder == self.out { "" } else { "../" };
                BasisFile::new(format!("{up}{name}"), *checksum)
            });
            folder.write(&job.folder, basis.as_ref(), self.force)?;
            for files in formats {
                make_out(&job.folder.join(FORMATS))?;
                write_files_forced(files, self.force)?;
                if let Some((first, _)) = files.first() {
                    let loss = loss_of(&folder.material, first)?;
                    eprintln!("{}: loss {loss:.6} against the fit", first.display());
                }
            }
        }
        self.show(&jobs, &folders)
    }

    /// Reads and fits, or takes what a device has found.
    fn find(
        &self,
        recipe: &Recipe<'_>,
        job: &Job<'_>,
        meaning: &Meaning,
    ) -> anyhow::Result<(Measured, Found)> {
        if self.values.is_some() {
            let report = DeviceReport::read(job.input, recipe)?;
            return Ok(report.fit(job.input, recipe)?);
        }
        let pattern: Vec<_> = recipe.pattern().collect();
        let measured = Measured::read(job.input, &pattern, self.tolerance(), meaning)?;
        let found = fit(recipe, &measured, self.keep_all);
        let found = found.with_context(|| job.input.display().to_string())?;
        Ok((measured, found))
    }

    /// A material's files in the formats that are asked for, each once.
    fn formats(
        &self,
        material: &FittedMaterial,
        folder: &Path,
        seed: u64,
    ) -> anyhow::Result<Vec<Files>> {
        let folder = folder.join(FORMATS);
        let first =
            |(place, format): &(usize, &FormatName)| !self.format[..*place].contains(format);
        let once = self.format.iter().enumerate().filter(first);
        let each = once.map(|(_, format)| {
            let files = files_of(material, (*format).into(), material.name(), seed)?.into_iter();
            Ok(files
                .map(|(name, bytes)| (folder.join(name), bytes))
                .collect())
        });
        each.collect()
    }

    /// In radians.
    fn tolerance(&self) -> f64 {
        f64::from(self.tolerance.unwrap_or(TOLERANCE)).to_radians()
    }

    /// The recipe's name without the directories that lead to it.
    fn label(&self) -> String {
        let name = self.recipe.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Each input, its material's name and its folder.
    fn jobs(&self) -> anyhow::Result<Vec<Job<'_>>> {
        let inputs: Vec<&PathBuf> = self.measurements.iter().chain(&self.values).collect();
        let mut names = HashSet::new();
        let job = |input: &&'_ PathBuf| -> anyhow::Result<(String, PathBuf)> {
            let name = input.file_stem().unwrap_or_default();
            let name = name.to_string_lossy().into_owned();
            ensure!(
                names.insert(name.clone()),
                "two --measurements are named {name}, as their folders would be: rename one of them"
            );
            let folder = match inputs.len() {
                1 => self.out.clone(),
                _ => self.out.join(&name),
            };
            Ok((name, folder))
        };
        let named: Vec<(String, PathBuf)> = inputs.iter().map(job).collect::<Result<_, _>>()?;
        let jobs = inputs.into_iter().zip(named);
        Ok(jobs
            .map(|(input, (name, folder))| Job {
                name,
                input,
                folder,
            })
            .collect())
    }

    /// Refuses to write over what is read, or what an earlier run has left.
    fn refuse_inputs(&self, jobs: &[Job<'_>], has_basis: bool) -> anyhow::Result<()> {
        let mut inputs: Vec<&Path> = vec![&self.recipe];
        inputs.extend(jobs.iter().map(|job| job.input));
        inputs.extend(self.meaning.white());
        for job in jobs {
            let formats = job.folder.join(FORMATS);
            // What else it holds would be taken for this material's.
            ensure!(
                !formats.exists(),
                "{} is there already, with formats of an earlier run: remove it, or give another --out",
                formats.display()
            );
            for name in Folder::FILES {
                let path = job.folder.join(name);
                for input in &inputs {
                    refuse_input(&path, input)?;
                }
                ensure!(
                    self.force || !path.exists(),
                    "{} is there already, as of an earlier run: give --force to replace it, or \
                     another --out",
                    path.display()
                );
            }
        }
        if has_basis {
            for input in &inputs {
                refuse_input(&self.basis_copy(), input)?;
            }
        }
        Ok(())
    }

    fn basis_copy(&self) -> PathBuf {
        self.out.join(Basis::beside(Path::new(&self.label())))
    }

    /// Copies the whole basis into the folder, once for all fits: its name and its checksum.
    fn copy_basis(
        &self,
        recipe: &Recipe<'_>,
        has_basis: bool,
    ) -> anyhow::Result<Option<(String, u32)>> {
        let checksum = recipe.method().basis_checksum().filter(|_| has_basis);
        let Some(checksum) = checksum else {
            return Ok(None);
        };
        let (from, to) = (Basis::beside(&self.recipe), self.basis_copy());
        let bytes =
            std::fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
        // A recipe may lie in the folder itself.
        if !holds(&to, &bytes) {
            write_file_forced(&to, &bytes, self.force)?;
        }
        let name = to.file_name().unwrap_or_default();
        Ok(Some((name.to_string_lossy().into_owned(), checksum)))
    }

    fn show(&self, jobs: &[Job<'_>], folders: &[Folder<'_>]) -> anyhow::Result<()> {
        let all = jobs.iter().zip(folders);
        if self.json {
            let list: Vec<_> = all
                .map(|(job, folder)| folder.about.named(&job.name, &job.folder))
                .collect();
            return print(&(serde_json::to_string_pretty(&list)? + "\n"));
        }
        let text: Vec<String> = all
            .map(|(job, folder)| folder.about.to_text(&job.name, self.keep_all))
            .collect();
        print(&text.join("\n"))
    }
}
