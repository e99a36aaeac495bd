//! `trainer quickstart`

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use clap::Args;
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_kernels::lanes::InstructionSet;
use glimpse_trainer::evaluation::{Judge, Method};
use glimpse_trainer::export::{RecipeFile, recipe_of};
use glimpse_trainer::files::try_write;
use glimpse_trainer::material::{Material, Portion, Procedural, Source};
use glimpse_trainer::meta::options::{Completing, Options, Parts};
use glimpse_trainer::meta::plan::{Effort, Schedule};
use glimpse_trainer::meta::run::INNER_STEPS;
use glimpse_trainer::metrics::Scores;
use glimpse_trainer::render::Picture;
use glimpse_trainer::report::{
    Best, Cell, Column, Compare, Gallery, GalleryRow, Page, Table, Tile, pattern_svg,
};
use glimpse_trainer::shipped;
use rayon::prelude::*;

use super::lock::Lock;
use super::output::{make_out, write_file_forced};
use super::progress::train_with_progress;
use super::train::{Found, found_at};
use super::{load, print};

/// Materials to train on.
const TRAINING: usize = 100;
/// Materials that are scanned: of another seed than those of training.
const UNSEEN: usize = 8;
/// n.
const SAMPLES: usize = 8;
/// What scans before anything is trained.
const SHIPPED: &str = "neural-n8";

/// Scan unseen materials with a recipe that comes along, then train one, and leave pictures: start here.
///
/// Within seconds eight procedural materials are measured at 8 directions and fitted by the recipe `neural-n8` of
/// `trainer recipes list`; DIR/index.html shows them. It is written anew once training is done.
///
/// A network is meta-trained on 100 procedural materials; eight others, which training never saw,
/// are then measured at 8 directions and fitted by four methods: Random (classic learning), Meta
/// (learned start and step sizes, random samples), Ours (learned samples too: the paper's), each in 20
/// steps, and Completed (a learned map completes the readings, and a single step follows).
/// Takes a minute on two cores; leaves DIR/index.html and DIR/neural-n8.recipe, which is the last
/// one's, for a machine whose arms get to 80 degrees and no nearer to each other than 10.
#[derive(Args)]
pub(crate) struct Quickstart {
    /// Where to leave the recipe, the pictures and index.html
    #[arg(long, default_value = "quickstart")]
    out: PathBuf,
    /// Replace a recipe DIR/neural-n8.recipe that is not of this seed's quickstart
    #[arg(long)]
    force: bool,
}

impl Quickstart {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let begin = Instant::now();
        // Better now than after a minute.
        make_out(&self.out)?;
        let recipe = self.out.join("neural-n8.recipe");
        for path in [&recipe, &self.out.join("index.html")] {
            try_write(path, 1 << 16)
                .map_err(|error| anyhow::anyhow!("cannot write {}: {error}", path.display()))?;
        }
        let _lock = Lock::within(&self.out)?;
        let source = Source(format!("procedural:{TRAINING}:{seed}"));
        let completed = Options {
            portions: vec![Portion::whole(&source, TRAINING)],
            ..completing(seed)
        };
        let found = found_at(&recipe, &completed, source.label());
        if let (Found::Other(what), false) = (found, self.force) {
            bail!("{what}: give --force to replace it, or another --out");
        }
        let unseen: Vec<Box<dyn Material>> = Procedural::set(UNSEEN, seed.wrapping_add(1))
            .into_iter()
            .map(|material| Box::new(material) as Box<dyn Material>)
            .collect();
        let judge = Judge::new(&unseen);
        let shipped = shipped::find(SHIPPED).with_context(|| format!("no recipe {SHIPPED}"))?;
        let shipped = shipped.recipe()?;
        first_scans(&judge, &Method::ours(&shipped, None)?, seed, &self.out)?;
        eprintln!(
            "look at {} ({:.0} s); training goes on, and will write it anew",
            self.out.join("index.html").display(),
            begin.elapsed().as_secs_f64()
        );
        eprintln!(
            "computing with {}",
            InstructionSet::of_this_machine().name()
        );
        eprintln!("training Meta");
        let meta = learn(&source, &options(seed, Parts::WithoutPattern))?;
        eprintln!("training Ours");
        let ours = learn(&source, &options(seed, Parts::All))?;
        eprintln!("training Completed");
        let completed = learn(&source, &completing(seed))?;
        write_file_forced(&recipe, completed.bytes(), true)?;

        eprintln!("scanning {UNSEEN} materials that training never saw");
        let (meta, ours, completed) = (meta.recipe()?, ours.recipe()?, completed.recipe()?);
        let methods = [
            Method::random(ModelKind::Neural, SAMPLES, INNER_STEPS),
            Method::meta(&meta, None)?,
            Method::ours(&ours, None)?,
            Method::ours(&completed, None)?,
        ];
        let scans = scan_all(&judge, &methods, seed)?;
        let means = means(&methods, &scans);
        Page::new("Glimpse: materials from eight measurements")
            .paragraph(
                "A network of 675 weights learned, on 100 procedural materials, where to measure \
                 a material and how to fit it. Here it meets eight materials that it never saw: \
                 each is measured at 8 pairs of directions and fitted as a scanner's \
                 microcontroller would do it. Random is classic learning, Meta has learned its \
                 start and its step sizes, Ours has learned where to measure too: all of them \
                 take 20 steps. For Completed a small map makes of the readings what a whole \
                 material is likely to be, and one step follows.",
            )
            .table(&means)
            .heading("Spheres")
            .gallery(&gallery(&judge, &methods, &scans))
            .heading("Loss of each material")
            .table(&losses(&methods, &scans))
            .heading("Where Completed measures")
            .drawing(
                &pattern_svg(&completed.pattern().collect::<Vec<_>>()),
                "The eight directions of the recipe.",
            )
            .write(&self.out)?;
        print(&means.to_text())?;
        eprintln!(
            "look at {} ({:.0} s in all)",
            self.out.join("index.html").display(),
            begin.elapsed().as_secs_f64()
        );
        Ok(())
    }
}

/// What the recipe that comes along makes of the materials: a page, and its table.
fn first_scans(
    judge: &Judge<'_>,
    shipped: &Method<'_>,
    seed: u64,
    out: &Path,
) -> anyhow::Result<()> {
    eprintln!("scanning {UNSEEN} materials with the recipe {SHIPPED}, which comes along");
    let methods = std::slice::from_ref(shipped);
    let scans = scan_all(judge, methods, seed)?;
    let means = means(methods, &scans);
    Page::new("Glimpse: materials from eight measurements")
        .paragraph(
            "Eight materials, each measured at 8 pairs of directions and fitted as a scanner's microcontroller \
             would do it, by a recipe that comes with the trainer. Others are being trained; once they are, this \
             page is written anew.",
        )
        .table(&means)
        .heading("Spheres")
        .gallery(&gallery(judge, methods, &scans))
        .write(out)?;
    print(&means.to_text())
}

fn options(seed: u64, parts: Parts) -> Options {
    Options {
        parts,
        ..Options::new(
            ModelKind::Neural,
            SAMPLES,
            Schedule::Joint,
            Effort::Brief,
            seed,
        )
    }
}

/// What becomes of the recipe that is left: readings completed, for a machine as many are.
fn completing(seed: u64) -> Options {
    let limits = Limits {
        max_theta_i: 80.0_f32.to_radians(),
        max_theta_o: 80.0_f32.to_radians(),
        min_separation: 10.0_f32.to_radians(),
        in_plane: false,
    };
    Options {
        schedule: Schedule::Prior,
        completing: Completing {
            limits,
            ..Completing::default()
        },
        ..options(seed, Parts::All)
    }
}

fn learn(source: &Source, options: &Options) -> anyhow::Result<RecipeFile> {
    let materials = load(source)?;
    let options = Options {
        portions: vec![Portion::whole(source, materials.len())],
        ..options.clone()
    };
    let learned = train_with_progress(&options, materials)?;
    Ok(recipe_of(&learned, &options, source.label())?)
}

/// The method's name as the paper writes it.
fn title(method: &str) -> String {
    let mut letters = method.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

/// One material by each method: what it scores, and how it looks.
struct Scans {
    material: String,
    each: Vec<(Scores, Picture)>,
}

impl Scans {
    fn losses(&self) -> impl Iterator<Item = f64> {
        self.each.iter().map(|(scores, _)| scores.loss)
    }
}

fn scan_all(judge: &Judge<'_>, methods: &[Method<'_>], seed: u64) -> anyhow::Result<Vec<Scans>> {
    (0..UNSEEN)
        .into_par_iter()
        .map(|material| scan(judge, methods, material, seed))
        .collect()
}

fn scan(
    judge: &Judge<'_>,
    methods: &[Method<'_>],
    index: usize,
    seed: u64,
) -> anyhow::Result<Scans> {
    let material = &*judge.materials()[index];
    let each = methods.iter().map(|method| {
        let fitted = method.fit(material, seed.wrapping_add(index as u64))?;
        Ok(judge.score(index, &fitted)?)
    });
    Ok(Scans {
        material: material.name().to_owned(),
        each: each.collect::<anyhow::Result<_>>()?,
    })
}

fn means(methods: &[Method<'_>], scans: &[Scans]) -> Table {
    let rows = methods.iter().enumerate().map(|(index, method)| {
        let scores = scans.iter().map(|scans| scans.each[index].0);
        let mean = Scores::mean(scores).unwrap_or_default();
        vec![
            Cell::Text(title(method.name())),
            Cell::Number(mean.loss),
            Cell::Number(mean.dssim),
            Cell::Number(mean.l2),
            Cell::Number(mean.psnr),
        ]
    });
    Table {
        caption: format!("Neural, n = {SAMPLES}: means over {UNSEEN} unseen materials"),
        columns: vec![
            Column::text("Method"),
            Column::number("Loss", 4, Best::Least),
            Column::number("DSSIM", 4, Best::Least),
            Column::number("L2", 5, Best::Least),
            Column::number("PSNR (dB)", 2, Best::Greatest),
        ],
        rows: rows.collect(),
        compare: Compare::Down,
    }
}

fn losses(methods: &[Method<'_>], scans: &[Scans]) -> Table {
    let losses = methods
        .iter()
        .map(|method| Column::number(title(method.name()), 4, Best::Least));
    let rows = scans.iter().map(|scans| {
        let losses = scans.losses().map(Cell::Number);
        [Cell::Text(scans.material.clone())]
            .into_iter()
            .chain(losses)
            .collect()
    });
    Table {
        caption: "Cosine-weighted logarithmic error".into(),
        columns: [Column::text("Material")]
            .into_iter()
            .chain(losses)
            .collect(),
        rows: rows.collect(),
        compare: Compare::Across,
    }
}

/// Each material as it is and by each method, with its errors.
fn gallery(judge: &Judge<'_>, methods: &[Method<'_>], scans: &[Scans]) -> Gallery {
    let rows = scans.iter().enumerate().map(|(index, scans)| {
        let least = scans.losses().fold(f64::INFINITY, f64::min);
        let reference = Tile {
            label: "Reference".into(),
            details: Vec::new(),
            best: false,
            picture: judge.reference(index).clone(),
        };
        let fits = methods.iter().zip(&scans.each);
        let fits = fits.map(|(method, (scores, picture))| Tile {
            label: title(method.name()),
            details: vec![
                format!("loss {:.4}", scores.loss),
                format!("{:.1} dB", scores.psnr),
            ],
            best: scores.loss == least,
            picture: picture.clone(),
        });
        GalleryRow {
            title: scans.material.clone(),
            tiles: [reference].into_iter().chain(fits).collect(),
        }
    });
    Gallery {
        caption: "Reference, and fits of eight measurements; click to enlarge".into(),
        rows: rows.collect(),
    }
}
