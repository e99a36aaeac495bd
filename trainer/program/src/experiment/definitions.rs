//! The cases of all experiments.

use clap::ValueEnum;
use glimpse_core::model::ModelKind::{self, CookTorrance, Linear, Neural, Phong};
use glimpse_fitting::measurement::Instrument::{Gloss20, Gloss60, Gloss85, MultiAngle, Sce, Sci};
use glimpse_fitting::measurement::ReadingSet::{self, Of};
use glimpse_materials::MODELS;

use super::case::Approach::{Baseline, Ggx, Glimpse, Optimum, Paper, Random};
use super::case::Variation::{
    self, Chosen, Importance, None as Unchanged, PatternOf, Readings, Refined, Replaced, Seed,
    Twice, Within,
};
use super::case::{Approach, COMPARED, Case, SAMPLES, Subset};
use super::derived;
use super::run::Experiment;

/// The sets of readings of the experiment `any`.
const INSTRUMENTS: [&[ReadingSet]; 8] = [
    &[Of(MultiAngle)],
    &[Of(MultiAngle), Of(Gloss60)],
    &[Of(MultiAngle), Of(Gloss20), Of(Gloss60), Of(Gloss85)],
    &[Of(Sci), Of(Gloss60)],
    &[Of(Sci), Of(Sce), Of(Gloss20), Of(Gloss60), Of(Gloss85)],
    &ReadingSet::PAINT_LAB,
    &[ReadingSet::InPlane],
    &[ReadingSet::FiveLines],
];
/// Those whose arms are also displaced.
const DISPLACED: [&[ReadingSet]; 3] = [
    INSTRUMENTS[0],
    &[ReadingSet::InPlane],
    &[ReadingSet::FiveLines],
];

/// All experiments.
pub(super) static EXPERIMENTS: [Experiment; 18] = [
    Experiment::new("same-samples", |_| at_8(&COMPARED)),
    Experiment::new("losses", |_| {
        [
            at_8(&COMPARED),
            Case::all(&[Optimum], &MODELS, &[Unchanged], &[0]),
        ]
        .concat()
    })
    .deriving(derived::with_black),
    Experiment::new("same-quality", |samples| {
        let curves = [Random, Baseline, Glimpse];
        let curves = Case::all(&curves, &MODELS, &[Unchanged], samples);
        [at_8(&[Paper]), curves].concat()
    })
    .deriving(derived::same_quality),
    Experiment::new("curves", |samples| {
        let curves = Case::all(&COMPARED, &MODELS, &[Unchanged], samples);
        [curves, Case::all(&[Optimum], &MODELS, &[Unchanged], &[0])].concat()
    }),
    Experiment::new("per-material", |_| at_8(&COMPARED)).deriving(derived::by_material),
    Experiment::new("additional", |_| {
        let compared = [Baseline, Paper, Glimpse];
        let nielsen = Case::all(&compared, &[Linear], &[Unchanged], &[2]);
        [nielsen, at_8(&compared)].concat()
    }),
    Experiment::new("robustness", |_| {
        let runs = (0..5).flat_map(|run| [2, 4].map(|count| Replaced(count, run)));
        varied(&MODELS, [Unchanged].into_iter().chain(runs))
    }),
    Experiment::new("seeds", |_| {
        varied(&MODELS, [Unchanged].into_iter().chain((1..5).map(Seed)))
    }),
    Experiment::new("again", |_| {
        varied(&[Phong, CookTorrance, Neural], [Unchanged, Twice])
    }),
    Experiment::new("convergence", |_| {
        let first = [(Random, 512), (Baseline, 32), (Paper, 32)];
        let both = first
            .map(|(approach, n)| Case::all(&[approach], &[Neural], &[Unchanged, Refined], &[n]));
        both.concat()
    }),
    Experiment::new("importance", |samples| {
        let of = |approaches: &[Approach], variation| {
            Case::all(approaches, &[Neural], &[variation], samples)
        };
        [
            of(&[Baseline], Importance),
            of(&[Baseline, Paper], Unchanged),
        ]
        .concat()
    }),
    Experiment::new("subsets", |_| {
        varied(
            &[Neural],
            Subset::value_variants().iter().copied().map(PatternOf),
        )
    })
    .deriving(derived::by_subset),
    Experiment::new("bases", |_| {
        let of_components = |components| {
            let cases = Case::all(&COMPARED[..3], &[Linear], &[Unchanged], &[SAMPLES]);
            cases
                .into_iter()
                .map(move |case| Case { components, ..case })
        };
        [5, 240].into_iter().flat_map(of_components).collect()
    }),
    Experiment::new("frontier", |samples| {
        let budgets = [Unchanged, Within(5), Within(10), Within(20)];
        let chosen: Vec<Variation> = samples.iter().map(|n| Chosen(*n)).collect();
        [
            Case::all(&[Paper], &[Linear], &[Unchanged], samples),
            Case::all(&[Glimpse], &[Linear], &budgets, samples),
            Case::all(&[Glimpse], &[Linear], &chosen, &[0]),
        ]
        .concat()
    }),
    Experiment::new("any", |_| {
        let exact = INSTRUMENTS.iter().map(|sets| Readings(sets, 0));
        let displaced = DISPLACED.iter().map(|sets| Readings(sets, 1));
        let readings: Vec<Variation> = exact.chain(displaced).collect();
        [
            Case::all(&[Ggx], &[CookTorrance], &readings, &[0]),
            Case::all(&[Glimpse], &MODELS, &readings, &[0]),
        ]
        .concat()
    }),
    Experiment::new("patterns", |_| {
        [
            at_8(&[Paper, Glimpse]),
            vec![Case::new(Baseline, Linear, SAMPLES)],
        ]
        .concat()
    }),
    Experiment::new("teaser", |_| {
        Case::all(&COMPARED, &[Neural], &[Unchanged], &[64])
    }),
    Experiment::new("increasing", |samples| {
        Case::all(&[Paper, Glimpse], &MODELS, &[Unchanged], samples)
    }),
];

/// Returns some methods for each model at n = 8.
fn at_8(approaches: &[Approach]) -> Vec<Case> {
    Case::all(approaches, &MODELS, &[Unchanged], &[SAMPLES])
}

/// Returns variations of the paper's method for models at n = 8.
fn varied(models: &[ModelKind], variations: impl IntoIterator<Item = Variation>) -> Vec<Case> {
    let variations: Vec<Variation> = variations.into_iter().collect();
    Case::all(&[Paper], models, &variations, &[SAMPLES])
}
