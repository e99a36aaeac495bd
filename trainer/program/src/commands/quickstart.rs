//! `trainer quickstart`

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use glimpse_evaluation::evaluation::{Evaluator, Method, SPHERE_SIZE, names};
use glimpse_fitting::bundled::{self, BundledRecipe};
use glimpse_materials::Source;
use glimpse_training::run::INNER_STEPS;

use super::fits::{NamedMethod, add_fits};
use super::lock::Lock;
use super::{load, print};
use crate::output::{check_out, write_file};
use crate::report::{Page, pattern_svg};

/// Number of procedural test materials, and the largest number of materials of --data.
const MATERIAL_COUNT: usize = 8;
/// Bundled recipes in the order of n.
const RECIPES_BY_SAMPLES: [&str; 6] = [
    "neural-n1",
    "neural-n2",
    "neural-n4",
    "neural-n8",
    "neural-n16",
    "neural-n16-16s",
];
/// The bundled recipe that is compared with the paper's methods, and written to the output folder.
const MAIN_RECIPE: &str = "neural-n8";

/// Scan unseen materials with bundled recipes, and write a page of results: start here.
///
/// The command measures eight materials, and fits them as a scanner's microcontroller does. They come
/// from the generator of procedural materials that also trained the bundled recipes, with another seed;
/// --data takes your own materials, whose losses are larger. The page DIR/index.html shows
///
/// - recipes of the model neural for n = 1, 2, 4, 8 and 16 measurements, and for 16 in 16 seconds:
///   errors, duration of the scan in seconds (as in `trainer plan`) and cycles of the fit on a
///   Cortex-M4F;
/// - the paper's methods at n = 8, trained with the paper's schedule, and the recipe for n = 8.
///
/// The command trains nothing and takes 10 to 30 seconds. `trainer evaluate --out` writes such a page of
/// other recipes. DIR/neural-n8.recipe is the bundled recipe for n = 8, for use in other commands such as
/// `trainer plan` and `trainer inspect`.
///
/// Example: trainer quickstart
///          trainer quickstart --seed 7 --out other/
///          trainer quickstart --data MERL/ --out merl/
///          trainer plan quickstart/neural-n8.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Quickstart {
    /// Materials to scan, the first eight of the source [default: procedural:8, with a seed after --seed]
    #[arg(long, value_name = "SOURCE")]
    data: Option<Source>,
    /// Output folder for index.html, its pictures and the recipe
    #[arg(long, short, value_name = "DIR", default_value = "quickstart")]
    out: PathBuf,
    /// Replace another recipe of the same name in DIR
    #[arg(long)]
    force: bool,
}

impl Quickstart {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let begin = Instant::now();
        let _lock = Lock::of_folder(&self.out)?;
        check_out(&self.out.join("index.html"))?;
        let main_recipe = find_bundled(MAIN_RECIPE)?;
        let path = self.out.join(format!("{MAIN_RECIPE}.recipe"));
        write_file(&path, main_recipe.bytes, self.force)?;

        // The bundled recipes were trained on the materials of seed 0.
        let unseen = seed.wrapping_add(1).max(1);
        let unseen = || Source(format!("procedural:{MATERIAL_COUNT}:{unseen}"));
        let source = self.data.clone().unwrap_or_else(unseen);
        let mut materials = load(&source)?;
        if materials.len() > MATERIAL_COUNT {
            eprintln!("the page shows the first {MATERIAL_COUNT} of them");
            materials.truncate(MATERIAL_COUNT);
        }
        let origin = match self.data {
            Some(_) => "",
            None => ", made by the generator whose materials trained the bundled recipes",
        };
        let test = format!("Test set: {source} ({} materials){origin}", materials.len());
        let evaluator = Evaluator::new(&materials);

        let by_samples = RECIPES_BY_SAMPLES.map(|name| method(find_bundled(name)?, name));
        let by_samples = by_samples.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
        let paper = bundled::PAPER.recipe();
        let compared = [
            NamedMethod::of_recipe(names::META, &paper, Method::meta(&paper, None)?)?,
            method(&bundled::PAPER, names::PAPER)?,
            method(main_recipe, names::GLIMPSE)?,
        ];
        let mut page = Page::new("Glimpse: materials from few measurements");
        write_file(&self.out.join("measured.png"), MEASURED, true)?;
        page.drawing("<img src=measured.png alt=''>", MEASURED_CAPTION);
        page.paragraph(INTRODUCTION).paragraph(&explanation());
        for (title, methods) in [
            ("Recipes by number of measurements", &by_samples[..]),
            ("The paper's methods and Glimpse", &compared),
        ] {
            page.heading(title);
            let caption = format!("{title}. {test}");
            let table = add_fits(&mut page, &caption, &evaluator, methods, seed)?;
            print(&format!("{caption}\n\n{}\n", table.to_markdown()))?;
        }
        let pattern: Vec<_> = main_recipe.recipe().pattern().collect();
        page.heading("Directions of a recipe")
            .drawing(
                &pattern_svg(&pattern),
                &format!("The directions of {MAIN_RECIPE}"),
            )
            .heading("Next: your own materials")
            .paragraph(NEXT_STEP)
            .code(TRAIN_COMMAND)
            .write(&self.out)?;
        print(&format!("{NEXT_STEP}\n  {TRAIN_COMMAND}\n"))?;
        eprintln!("done in {:.0} s", begin.elapsed().as_secs_f64());
        Ok(())
    }
}

/// The picture that `tests/figures` makes.
const MEASURED: &[u8] = include_bytes!("measured.png");
const MEASURED_CAPTION: &str = "Two of RGL's measured materials (CC0), rendered from the measurement, and from fits of Neural \
    to 8 of its values. The paper's recipe was trained on synthetic materials, Glimpse's also on 9 others of RGL's. Delta E is \
    the color error: 1 is just visible, the middle felt has 3.8. All materials below are synthetic, unless given by --data.";
const INTRODUCTION: &str = "A recipe holds learned directions of measurement, and learned initial \
    parameters of a small network that is fitted to the readings. This page shows scans of unseen \
    materials with bundled recipes for 1, 2, 4, 8 and 16 pairs of directions, and for 16 pairs in 16 seconds. Each material is measured \
    without noise and fitted as on a scanner's microcontroller.";
const NEXT_STEP: &str =
    "Train a recipe for your own materials at standard effort, in 1 to 5 minutes on two cores:";
const TRAIN_COMMAND: &str =
    "trainer train --model neural --samples 16 --scan-seconds 16 --data YOUR/ --out mine.recipe";

/// Describes the columns and the methods.
fn explanation() -> String {
    format!(
        "The loss is the paper's mean cosine-weighted logarithmic error. The other errors compare pictures of {SPHERE_SIZE} x \
         {SPHERE_SIZE} pixels. The duration of a scan covers motion and settling in the fastest order (trainer plan). The cycles \
         are those of one fit on a Cortex-M4F. Measured materials have larger losses, which `trainer recipes list` prints. Meta \
         has learned initial parameters and step sizes, and random directions; the paper's has learned directions too. Both take \
         {INNER_STEPS} steps. Glimpse obtains its initial parameters from the readings by learned maps, and takes two \
         Gauss-Newton steps."
    )
}

fn find_bundled(name: &str) -> anyhow::Result<&'static BundledRecipe> {
    bundled::find(name).with_context(|| format!("the program lacks the bundled recipe {name}"))
}

/// Creates the method of a bundled recipe without a basis.
fn method(bundled: &'static BundledRecipe, name: &str) -> anyhow::Result<NamedMethod<'static>> {
    let recipe = bundled.recipe();
    NamedMethod::of_recipe(name, &recipe, Method::with_recipe(&recipe, None)?)
}
