//! `trainer render view`

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{ArgGroup, Args};
use glimpse_core::gonio::Quantity;
use glimpse_core::model::linear;
use glimpse_core::recipe::Recipe;
use glimpse_kernels::scan::scan_some;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Material, Source};
use glimpse_trainer::evaluation::Readings;
use glimpse_trainer::measurement::{Meaning, Measured, ReadingStatus, fit};
use glimpse_trainer::report::{MOST_LOBES, document};
use glimpse_training::recipe::RecipeFile;
use glimpse_viewer::{Reference, STYLE, Shown, View as Page};
use serde_json::json;

use super::super::export_basis::{compacted, read_compact};
use super::super::known::tell;
use super::super::numbers::share;
use super::super::output::{file_as_json, refuse_input, refuse_source};
use super::super::{load, print_json, read_recipe, write_file};
use super::shared::{check_out, file_type};

/// How far a row may be from its sample, radians: half a degree, as for `trainer fit`.
const TOLERANCE: f64 = 0.5 / 180.0 * std::f64::consts::PI;

/// Write a page in which scans can be turned, lit and changed, in a browser.
///
/// Each recipe becomes a sphere, beside the reference: drag to move the light, or the camera. Below is
/// the BRDF in the plane of incidence, and a slider for each reading: whatever is changed is fitted
/// anew at once, by the very code of the device, which the page brings along. Loss and predicted loss
/// follow. The page is one file of a megabyte or so that needs neither network nor server, and works
/// on a phone.
///
/// Readings are those that a virtual scanner takes of --material, which is the reference then, or
/// --measurements: a file for each recipe, in their order, as readings.csv that `trainer fit` leaves
/// (which can do without --reference). Of a recipe that can do without, readings can be switched off.
///
/// A recipe of the model linear needs its basis beside it, or a compact one as --basis.
///
/// Example: trainer render view neural-n8.recipe linear-n8.recipe --material gold.binary
///          trainer render view neural-n16-masked.recipe --material procedural:1:77 --noise 0.02
///          trainer render view n16.recipe --measurements gold/readings.csv --out gold.html
#[derive(Args)]
#[command(
    verbatim_doc_comment,
    group = ArgGroup::new("given").args(["material", "measurements"]).required(true)
)]
pub(super) struct View {
    /// The recipes
    #[arg(required = true, value_name = "RECIPE")]
    recipes: Vec<PathBuf>,
    /// What is scanned, and compared with: a source that holds one material
    #[arg(long, value_name = "SOURCE", conflicts_with = "reference")]
    material: Option<Source>,
    /// Instead: readings from a lab, CSV with BRDFs, a file for each recipe
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    measurements: Vec<PathBuf>,
    /// With --measurements: what they are compared with, a source that holds one material
    #[arg(long, value_name = "SOURCE")]
    reference: Option<Source>,
    /// Standard deviation of Gaussian noise on each reading of --material, relative to its value, 0 to 1
    /// [default: 0]
    #[arg(long, value_name = "S", conflicts_with = "measurements", value_parser = share)]
    noise: Option<f32>,
    /// Recipes of the model linear: their compact basis (trainer export --format basis) [default: made
    /// of the basis beside each recipe]
    #[arg(long, value_name = "FILE")]
    basis: Option<PathBuf>,
    /// The page to write
    #[arg(long, short, value_name = "FILE.html", default_value = "view.html")]
    out: PathBuf,
    /// Print JSON: file, title, loss of the reference's table, and model and readings of each recipe
    #[arg(long)]
    json: bool,
}

impl View {
    pub(super) fn run(&self, seed: u64) -> anyhow::Result<()> {
        file_type(&self.out, &["html"])?;
        self.refuse_what_cannot_be_shown()?;
        self.refuse_inputs()?;
        let files = self.recipes.iter().map(|path| RecipeFile::read(path));
        let files: Vec<RecipeFile> = files.collect::<Result<_, _>>()?;
        let compact = self.basis.as_deref().map(read_compact).transpose()?;
        check_out(&self.out)?;

        let source = self.material.as_ref().or(self.reference.as_ref());
        let materials = source.map(load).transpose()?.unwrap_or_default();
        ensure!(
            materials.len() <= 1,
            "a page shows one material, and {} are given: name a single one",
            materials.len()
        );
        let material = materials.first().map(|material| &**material);
        let mut shown = Vec::new();
        let mut recipes = Vec::new();
        let mut is_used = false;
        for (index, (path, file)) in self.recipes.iter().zip(&files).enumerate() {
            let recipe = file.recipe();
            tell_of(&recipe, &materials)?;
            let basis = match recipe.method().basis_checksum() {
                Some(of) => Some(basis(path, of, compact.as_deref(), &mut is_used)?),
                None => None,
            };
            let readings = match self.measurements.get(index) {
                Some(file) => measured(&recipe, file)?,
                None => self
                    .scanned(&recipe, material, seed)
                    .with_context(|| format!("a scan by {}", path.display()))?,
            };
            recipes.push(json!({
                "name": name_of(path),
                "model": recipe.model().name(),
                "samples": recipe.samples(),
                "readings": readings.iter().flatten().count(),
            }));
            shown.push(Shown {
                name: name_of(path),
                recipe: file.bytes().to_vec(),
                basis,
                readings,
            });
        }
        ensure!(
            self.basis.is_none() || is_used,
            "--basis has no effect: none of the recipes is of the model linear"
        );
        let reference = material.map(Reference::new);
        if let Some(reference) = &reference {
            let loss = reference.table_loss();
            eprintln!(
                "the reference is shown by a table, whose loss is {loss:.5}; fits are judged without"
            );
        }
        let title = match (material, self.measurements.first()) {
            (Some(material), _) => material.name().to_owned(),
            (None, Some(path)) => name_of(path),
            (None, None) => String::new(),
        };
        let page = Page {
            title,
            reference,
            shown,
        };
        let html = document(&page.title, STYLE, &page.body());
        write_file(&self.out, html.as_bytes())?;
        if !self.json {
            return Ok(());
        }
        print_json(&json!({
            "file": file_as_json(&self.out),
            "title": page.title,
            "reference_table_loss": page.reference.as_ref().map(Reference::table_loss),
            "recipes": recipes,
        }))
    }

    fn refuse_what_cannot_be_shown(&self) -> anyhow::Result<()> {
        let (recipes, files) = (self.recipes.len(), self.measurements.len());
        ensure!(
            recipes < MOST_LOBES,
            "{recipes} recipes and a reference cannot be told apart: give {} at most",
            MOST_LOBES - 1
        );
        ensure!(
            self.material.is_some() || files == recipes,
            "{files} --measurements for {recipes} recipes: give a file for each recipe, in their order"
        );
        let mut names = HashSet::new();
        for path in &self.recipes {
            ensure!(
                names.insert(name_of(path)),
                "two recipes are named {}, and could not be told apart: rename one of them",
                name_of(path)
            );
        }
        Ok(())
    }

    fn refuse_inputs(&self) -> anyhow::Result<()> {
        let inputs = self
            .recipes
            .iter()
            .chain(&self.measurements)
            .chain(&self.basis);
        for input in inputs {
            refuse_input(&self.out, input)?;
        }
        let mut sources = self.material.iter().chain(&self.reference);
        sources.try_for_each(|source| refuse_source(&self.out, source))
    }

    /// What a virtual scanner reads, if it can be fitted.
    fn scanned(
        &self,
        recipe: &Recipe<'_>,
        material: Option<&dyn Material>,
        seed: u64,
    ) -> anyhow::Result<Vec<Option<[f32; 3]>>> {
        let noise = Readings {
            noise: self.noise.unwrap_or(0.0),
            ..Readings::default()
        };
        let Some(material) = material else {
            return Ok(Vec::new());
        };
        let mut read = noise.of(material, recipe.samples(), seed);
        let mut readings = Vec::new();
        scan_some(recipe, &mut |index, angles| {
            let reading = read(index, angles);
            readings.push(reading);
            reading
        })?;
        Ok(readings)
    }
}

/// The name of a file without folders and ending.
fn name_of(path: &Path) -> String {
    let name = path.file_stem().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn tell_of(recipe: &Recipe<'_>, materials: &[Box<dyn Material>]) -> anyhow::Result<()> {
    if !materials.is_empty() {
        tell(recipe, materials)?;
    }
    Ok(())
}

/// The compact basis of a recipe of the model linear: the one that is given, or the one beside the recipe, or
/// made of the whole one there.
fn basis(
    path: &Path,
    of: u32,
    compact: Option<&[u8]>,
    is_used: &mut bool,
) -> anyhow::Result<Vec<u8>> {
    if let Some(bytes) = compact {
        *is_used = true;
        let found = linear::Basis::parse(bytes)?.of();
        ensure!(
            found == of,
            "--basis was made of the whole basis {found:08x}, and {} needs {of:08x}: export it from \
             this recipe",
            path.display()
        );
        return Ok(bytes.to_vec());
    }
    let whole = Basis::beside(path);
    ensure!(
        whole.exists(),
        "{} is of the model linear, and its basis {} is not there, which makes a BRDF of coefficients: \
         put it beside the recipe, or give --basis with what `trainer export --format basis` made of it",
        path.display(),
        whole.display()
    );
    let (_, basis) = read_recipe(path)?;
    let basis = basis.context("a recipe that names a basis is read with it")?;
    match basis.is_compact() {
        true => Ok(basis.to_bytes()),
        false => compacted(&basis, None),
    }
}

/// Readings from a lab; those that `trainer fit` would leave out are left out here.
fn measured(recipe: &Recipe<'_>, file: &Path) -> anyhow::Result<Vec<Option<[f32; 3]>>> {
    let pattern: Vec<_> = recipe.pattern().collect();
    let measured = Measured::read(file, &pattern, TOLERANCE, &Meaning::Values(Quantity::Brdf))?;
    let found = fit(recipe, &measured, false).with_context(|| file.display().to_string())?;
    let samples = measured.samples.iter().zip(&found.fates);
    Ok(samples
        .map(|(sample, fate)| sample.mean().filter(|_| *fate == ReadingStatus::Used))
        .collect())
}
