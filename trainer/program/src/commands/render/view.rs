//! `trainer render view`

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::builder::ArgPredicate;
use clap::{ArgGroup, Args};
use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::Degradation;
use glimpse_fitting::measurement::{
    MaterialFit, Multiple, NamedRecipe, ReadingQuantity, ReadingRows, ReadingStatus, Readings,
    SampleReading, Selection, TableArgs,
};
use glimpse_fitting::route::MachineArgs;
use glimpse_kernels::scan::scan_with_missing;
use glimpse_materials::{Material, Source};
use glimpse_viewer::{RecipeScan, Reference, STYLE, View as Page};

use super::super::numbers::number;
use super::super::training_overlap::warn;
use super::super::{LINEAR_ANY, load_single};
use crate::output::{check_out, file_type, refuse_input, refuse_source, write_file};
use crate::report::{MAX_LOBES, document};

/// Write an interactive HTML page that fits scans in a browser.
///
/// The page shows a sphere for each recipe, and one for the reference. Dragging moves the light or
/// the camera. Below is a plot of the BRDF and the readings in the plane of incidence, and a slider for
/// each reading.
/// After each change the page repeats the fit, with the device's own code as WebAssembly, and
/// updates the loss and the predicted loss. The page is a single file of about 1 MB. It needs
/// neither network nor server, and works on a phone.
///
/// With --material, the readings are those of a virtual scan of the material, which is also the
/// reference. With --measurements, they are read from a file for each recipe, in the same order, such
/// as readings.csv of `trainer fit`; --reference is optional then. If a recipe tolerates missing
/// readings, each can be switched off. Readings at any directions are not fitted in the page: it shows
/// the fit of `trainer fit`, with one standard deviation in the plot, and marks the direction to read
/// next, as `trainer next` does. It names the recipe of that fit, which may be the bundled MODEL-any.
///
/// A recipe of the model linear, or for readings at any directions, needs its basis file next to it.
///
/// Example: trainer render view neural-n8.recipe linear-n8.recipe --material gold.binary
///          trainer render view neural-n16-masked.recipe --material procedural:1:77 --noise 0.02
///          trainer render view n16.recipe --measurements gold/readings.csv --out gold.html
///          trainer render view --measurements paint.csv --out paint.html
#[derive(Args)]
#[command(
    verbatim_doc_comment,
    group = ArgGroup::new("input").args(["material", "measurements"]).required(true)
)]
pub(crate) struct View {
    /// Recipe files, or names of bundled recipes [default: linear-any with --measurements]
    #[arg(
        value_name = "RECIPE",
        required_unless_present = "measurements",
        default_value_if("measurements", ArgPredicate::IsPresent, LINEAR_ANY)
    )]
    recipes: Vec<PathBuf>,
    /// Material to scan, and reference: a source with a single material
    #[arg(long, value_name = "SOURCE", conflicts_with = "reference")]
    material: Option<Source>,
    /// Readings from a lab, instead of a virtual scan: CSV with BRDFs, a file for each recipe
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    measurements: Vec<PathBuf>,
    /// With --measurements: reference material, a source with a single material [default: none]
    #[arg(long, value_name = "SOURCE")]
    reference: Option<Source>,
    /// With --material: standard deviation of the readings' Gaussian noise, relative to each value,
    /// 0 to 1 [default: 0]
    #[arg(long, value_name = "S", conflicts_with = "measurements", value_parser = number(0.0..=1.0_f32))]
    noise: Option<f32>,
    /// Page to write
    #[arg(long, short, value_name = "FILE.html", default_value = "view.html")]
    out: PathBuf,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
}

impl View {
    pub(super) fn run(&self, seed: u64) -> anyhow::Result<()> {
        file_type(&self.out, &["html"])?;
        self.check_arguments()?;
        self.refuse_inputs()?;
        let recipes = self.recipes.iter().map(|path| NamedRecipe::read(path));
        let recipes: Vec<NamedRecipe> = recipes.collect::<Result<_, _>>()?;
        check_out(&self.out)?;

        let source = self.material.as_ref().or(self.reference.as_ref());
        let materials: Vec<_> = source.map(load_single).transpose()?.into_iter().collect();
        let material = materials.first().map(|material| &**material);
        let mut scans = Vec::new();
        for (index, (path, given)) in self.recipes.iter().zip(&recipes).enumerate() {
            let mut scan = RecipeScan {
                name: name_of(path),
                recipe: given.file.clone(),
                basis: given.basis.as_ref().map(|basis| basis.file().to_vec()),
                samples: Vec::new(),
                fit: None,
                next: None,
            };
            if let Some(file) = self.measurements.get(index) {
                add_measured(&mut scan, given, file)?;
            } else if let Some(material) = material {
                warn(&given.file.metadata().materials, &materials);
                let samples = self.virtual_readings(&given.file.recipe(), material, seed);
                let context = || format!("virtual scan with {}", path.display());
                scan.samples = samples.with_context(context)?;
            }
            scans.push(scan);
        }
        let reference = material.map(Reference::new);
        if let Some(reference) = &reference {
            let loss = reference.table_loss;
            eprintln!(
                "the page draws the reference from a table of loss {loss:.5}; losses of fits do not depend on it"
            );
        }
        let first = self.measurements.first();
        let name = material.map(|material| material.name().to_owned());
        let page = Page {
            title: name.or(first.map(|path| name_of(path))).unwrap_or_default(),
            reference,
            scans,
        };
        let html = document(&page.title, STYLE, &page.body());
        write_file(&self.out, html.as_bytes(), self.force)
    }

    fn check_arguments(&self) -> anyhow::Result<()> {
        let (recipes, files) = (self.recipes.len(), self.measurements.len());
        ensure!(
            recipes < MAX_LOBES,
            "{recipes} recipes are too many for a page: give {} at most",
            MAX_LOBES - 1
        );
        ensure!(
            self.material.is_some() || files == recipes,
            "{files} --measurements for {recipes} recipes: give a file for each recipe, in their order"
        );
        let mut names = HashSet::new();
        for path in &self.recipes {
            ensure!(
                names.insert(name_of(path)),
                "two recipes have the name {}: rename one of them",
                name_of(path)
            );
        }
        Ok(())
    }

    fn refuse_inputs(&self) -> anyhow::Result<()> {
        for input in self.recipes.iter().chain(&self.measurements) {
            refuse_input(&self.out, input)?;
        }
        let mut sources = self.material.iter().chain(&self.reference);
        sources.try_for_each(|source| refuse_source(&self.out, source))
    }

    /// Returns the readings of a virtual scan.
    ///
    /// # Errors
    /// If the recipe cannot fit them.
    fn virtual_readings(
        &self,
        recipe: &Recipe<'_>,
        material: &dyn Material,
        seed: u64,
    ) -> anyhow::Result<Vec<SampleReading>> {
        let noise = Degradation {
            noise: self.noise.unwrap_or(0.0),
            ..Degradation::default()
        };
        ensure!(
            recipe.samples() > 0,
            "the recipe is for readings at any directions, so --material has no scan: give --measurements"
        );
        let mut reader = noise.reader(material, recipe.samples(), seed);
        let mut samples = Vec::new();
        scan_with_missing(recipe, &mut |index, angles| {
            let reading = reader.read(index.into(), angles);
            let mut sample = SampleReading::new(angles);
            if let Some(mean) = reading {
                (sample.brdf.count, sample.brdf.mean) = (1, mean);
                sample.status = ReadingStatus::Used;
            }
            samples.push(sample);
            reading
        })?;
        Ok(samples)
    }
}

/// Returns the name of a file without folders and extension.
fn name_of(path: &Path) -> String {
    let name = path.file_stem().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Adds readings from a lab to a scan. If they are not those of the recipe's pattern, the page displays the fit of
/// `trainer fit`, and there is a direction to read next.
fn add_measured(scan: &mut RecipeScan, given: &NamedRecipe, file: &Path) -> anyhow::Result<()> {
    let rows = ReadingRows::read(file, &TableArgs::default())?;
    let readings = Readings::new(given, rows, ReadingQuantity::of(Multiple::Brdf))?;
    let context = || file.display().to_string();
    if !given.is_any() && readings.off_pattern.is_none() {
        let selection = Selection::new(readings, false).with_context(context)?;
        scan.samples = selection.readings.samples;
        return Ok(());
    }
    let fit = MaterialFit::new(readings, scan.name.clone(), false).with_context(context)?;
    let readings = &fit.selection.readings;
    let so_far = (&fit.selection.posterior, &readings.pattern()[..]);
    let next = given.next(&MachineArgs::default(), so_far, 1)?;
    scan.next = next.first().map(|proposal| proposal.angles);
    if let Some(reason) = &readings.off_pattern {
        let name = &readings.recipe.name;
        eprintln!("note: {name} fits readings at any directions: {reason}");
        scan.name = format!("{name} instead of {}", scan.name);
    }
    (scan.recipe, scan.basis) = (given.continuing().file, None);
    scan.samples.clone_from(&readings.samples);
    scan.fit = Some(fit);
    Ok(())
}
