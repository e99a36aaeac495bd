//! The experiments as data: the cases of each, and the views that show them.

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
use super::record::Key::{
    self, BoundHolds, Components, Coverage, Increase, Material, Mean, Method, Metric, Model,
    Position, Samples, Seconds, Spread, StandardError, Times, TruthOverPredicted,
};
use super::record::{DELTA_E, DSSIM, LOSS, Record};
use super::run::{Experiment, NEW, Sets};
use super::view::Columns::{By, Named};
use super::view::Form::{Patterns, Plots, Spheres, Table};
use super::view::{Columns, View};
use crate::report::Compare::{WithinColumn, WithinRow};

/// All metrics, and the standard error of the loss.
const METRICS: &[Columns] = &[By(
    &[],
    &[LOSS, DSSIM, Metric(2), Metric(3), DELTA_E, StandardError],
)];
/// The loss of each variation.
const LOSS_BY_VARIATION: Columns = By(&[Key::Variation], &[LOSS]);
/// The loss of each variation, and its increase.
const VARIATIONS: &[Columns] = &[By(&[Key::Variation], &[LOSS, Increase])];
/// The labels of a method and its variation.
const VARIED_METHOD: &[Key] = &[Method, Key::Variation];

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
    Experiment {
        name: "same-samples",
        title: "The main table: all methods for all models at n = 8, with all metrics",
        cases: |_| at_8(&COMPARED),
        views: &[
            View::new(
                "metrics",
                "means over the test materials and, for Random and Meta, over several seeds",
                Table(&[Method], METRICS, Some(WithinColumn)),
            )
            .by_model(),
            View::new(
                "spheres",
                "The most diffuse and the glossiest material; click to enlarge",
                Spheres(2, &[Model], Method),
            )
            .of(measured),
        ],
        ..NEW
    },
    Experiment {
        name: "losses",
        title: "The loss at n = 8 for all models and methods, and the loss of black (f = 0)",
        cases: |_| {
            [
                at_8(&COMPARED),
                Case::all(&[Optimum], &MODELS, &[Unchanged], &[0]),
            ]
            .concat()
        },
        derive: derived::with_black,
        views: &[
            View::new(
                "losses",
                "Mean loss over the test set at n = 8. Paper: its values, on 20 other materials. All other columns: our \
                 values on the test set named here. Meta and the paper's have schedule paper, Glimpse has schedule prior. \
                 Linear has 5 components and eta = 40, also for Optimum; for Glimpse, a learned map replaces them",
                Table(&[Model], &[By(&[Key::Approach], &[LOSS])], None),
            ),
            View::new(
                "summary",
                "Mean losses, and mean color error of spheres, at n = 8",
                Table(
                    &[Model],
                    &[
                        By(&[Method], &[LOSS]),
                        Named("color error of Glimpse", |r| is(r, Glimpse), DELTA_E, 1),
                    ],
                    None,
                ),
            )
            .of(|r| measured(r) && (is(r, Random) || is(r, Paper) || is(r, Glimpse))),
        ],
        ..NEW
    },
    Experiment {
        name: "same-quality",
        title: "The number of samples that other methods need to match the quality of the paper's at n = 8",
        cases: |samples| {
            let curves = [Random, Baseline, Glimpse];
            let curves = Case::all(&curves, &MODELS, &[Unchanged], samples);
            [at_8(&[Paper]), curves].concat()
        },
        derive: derived::same_quality,
        views: &[View::new(
            "times",
            "Samples needed to match the quality of the paper's at n = 8, divided by 8, interpolated linearly over ln n; \
             empty if the largest n is not enough",
            Table(
                &[Model, Method],
                &[By(&[], &[Times(0), Times(1), Times(2), Times(3), Times(4)])],
                None,
            ),
        )],
        ..NEW
    },
    Experiment {
        name: "curves",
        title: "Loss and DSSIM over n, with the optimum as a dot",
        cases: |samples| {
            let curves = Case::all(&COMPARED, &MODELS, &[Unchanged], samples);
            [curves, Case::all(&[Optimum], &MODELS, &[Unchanged], &[0])].concat()
        },
        views: &[
            View::new(
                "curves",
                "each point of Meta, the paper's and Glimpse is a separate training",
                Table(&[Method, Samples], METRICS, Some(WithinColumn)),
            )
            .by_model(),
            View::new(
                "",
                "errors over the number of samples; Optimum is drawn at the right end",
                Plots(Samples, &[LOSS, DSSIM], &[Method]),
            )
            .by_model(),
        ],
        ..NEW
    },
    Experiment {
        name: "per-material",
        title: "The loss of each material, sorted",
        cases: |_| at_8(&COMPARED),
        derive: derived::by_material,
        views: &[
            View::new(
                "losses",
                "loss of each material at n = 8",
                Table(&[Material], &[By(&[Method], &[LOSS])], Some(WithinRow)),
            )
            .by_model(),
            View::new(
                "",
                "loss of each material at n = 8",
                Plots(Position, &[LOSS], &[Method]),
            )
            .by_model(),
        ],
        ..NEW
    },
    Experiment {
        name: "additional",
        title: "Materials of --additional: Linear at n = 2, and Meta or NJR15, the paper's and Glimpse at n = 8",
        cases: |_| {
            let compared = [Baseline, Paper, Glimpse];
            let nielsen = Case::all(&compared, &[Linear], &[Unchanged], &[2]);
            [nielsen, at_8(&compared)].concat()
        },
        sets: Sets::Additional,
        views: &[
            View::new(
                "linear-n2",
                "Linear, n = 2. Paper: its values, on the eight materials of Nielsen et al",
                Table(&[Method], METRICS, Some(WithinColumn)),
            )
            .of(|r| r.case.samples == 2),
            View::new(
                "metrics",
                "n = 8. Paper: its values, on other materials of the RGL database",
                Table(&[Method], METRICS, Some(WithinColumn)),
            )
            .of(|r| r.case.samples == SAMPLES)
            .by_model(),
            View::new(
                "losses",
                "Loss at n = 8. Paper: its values, on other materials of the RGL database",
                Table(&[Model], &[By(&[Key::Approach], &[LOSS])], None),
            )
            .of(|r| r.case.samples == SAMPLES),
        ],
        ..NEW
    },
    Experiment {
        name: "robustness",
        title: "The loss with two or four of eight learned samples replaced by random ones",
        cases: |_| {
            let runs = (0..5).flat_map(|run| [2, 4].map(|count| Replaced(count, run)));
            varied(&MODELS, [Unchanged].into_iter().chain(runs))
        },
        views: &[View::new(
            "robustness",
            "Loss of the paper's method with some of 8 learned samples replaced by random ones, mean of 5 runs",
            Table(&[Model], VARIATIONS, None),
        )],
        ..NEW
    },
    Experiment {
        name: "seeds",
        title: "The spread of the loss over five trainings with different seeds",
        cases: |_| varied(&MODELS, [Unchanged].into_iter().chain((1..5).map(Seed))),
        views: &[View::new(
            "seeds",
            "Loss of the paper's method at n = 8 in five trainings with different seeds; in the paper, the standard \
             deviation is less than 5 % of the loss",
            Table(
                &[Model],
                &[LOSS_BY_VARIATION, By(&[], &[Mean, Spread])],
                None,
            ),
        )],
        ..NEW
    },
    Experiment {
        name: "again",
        title: "The loss after both training stages are repeated",
        cases: |_| varied(&[Phong, CookTorrance, Neural], [Unchanged, Twice]),
        views: &[View::new(
            "again",
            "Loss of the paper's method at n = 8, and after both training stages are repeated: initial parameters and step \
             sizes on the learned pattern, then the pattern again. Linear has no learned initial parameters",
            Table(&[Model], VARIATIONS, Some(WithinRow)),
        )],
        ..NEW
    },
    Experiment {
        name: "convergence",
        title: "The loss after 20 steps of each method, and after 10,000 more on random samples",
        cases: |_| {
            let first = [(Random, 512), (Baseline, 32), (Paper, 32)];
            let both = first.map(|(approach, n)| {
                Case::all(&[approach], &[Neural], &[Unchanged, Refined], &[n])
            });
            both.concat()
        },
        views: &[View::new(
            "convergence",
            "Neural: loss after 20 steps on 512 (Random) or 32 samples, and after 10,000 more on 512 fresh random samples \
             each",
            Table(&[Method], &[LOSS_BY_VARIATION], Some(WithinColumn)),
        )],
        ..NEW
    },
    Experiment {
        name: "importance",
        title: "The loss with samples drawn by importance of the mean BRDF",
        cases: |samples| {
            let of = |approaches: &[Approach], variation| {
                Case::all(approaches, &[Neural], &[variation], samples)
            };
            [
                of(&[Baseline], Importance),
                of(&[Baseline, Paper], Unchanged),
            ]
            .concat()
        },
        views: &[
            View::new(
                "importance",
                "Neural, loss. Importance: initial parameters and step sizes of Meta, and a Sobol sequence mapped through \
                 the inverse cumulative distribution of the logarithmic mean of the training materials. In the paper, its \
                 loss is more than four times that of the paper's own method",
                Table(&[Samples], &[By(VARIED_METHOD, &[LOSS])], Some(WithinRow)),
            ),
            View::new(
                "",
                "Neural: importance sampling of the mean BRDF",
                Plots(Samples, &[LOSS], VARIED_METHOD),
            ),
        ],
        ..NEW
    },
    Experiment {
        name: "subsets",
        title: "The loss of patterns trained and evaluated on diffuse and on glossy materials",
        cases: |_| {
            varied(
                &[Neural],
                Subset::value_variants().iter().copied().map(PatternOf),
            )
        },
        derive: derived::by_subset,
        views: &[View::new(
            "subsets",
            "Neural, n = 8: loss of the paper's method by the training set of its pattern (row) and by test materials. \
             Initial parameters and step sizes are trained on all materials. The glossy half of the materials has the \
             higher ratios of maximum to median (of BRDF times cosine)",
            Table(
                &[Key::Variation],
                &[By(&[Material], &[LOSS])],
                Some(WithinColumn),
            ),
        )],
        ..NEW
    },
    Experiment {
        name: "bases",
        title: "The metrics of Linear with 5 and with 240 components",
        cases: |_| {
            let of_components = |components| {
                let cases = Case::all(&COMPARED[..3], &[Linear], &[Unchanged], &[SAMPLES]);
                cases
                    .into_iter()
                    .map(move |case| Case { components, ..case })
            };
            [5, 240].into_iter().flat_map(of_components).collect()
        },
        views: &[View::new(
            "bases",
            "Linear, n = 8, with 5 and 240 components; fewer if there are too few training columns, three for each \
                 material",
            Table(&[Components, Method], METRICS, Some(WithinColumn)),
        )],
        ..NEW
    },
    Experiment {
        name: "frontier",
        title: "Quality over the seconds of a scan, for patterns trained with and without a budget for motion",
        cases: |samples| {
            let budgets = [Unchanged, Within(5), Within(10), Within(20)];
            let chosen: Vec<Variation> = samples.iter().map(|n| Chosen(*n)).collect();
            [
                Case::all(&[Paper], &[Linear], &[Unchanged], samples),
                Case::all(&[Glimpse], &[Linear], &budgets, samples),
                Case::all(&[Glimpse], &[Linear], &chosen, &[0]),
            ]
            .concat()
        },
        sets: Sets::All,
        timed: true,
        views: &[
            View::new(
                "seconds",
                "Linear, n = 8 and more",
                Table(
                    &[Method, Key::Variation, Samples],
                    &[By(&[], &[Seconds, LOSS, DELTA_E])],
                    None,
                ),
            )
            .of(|r| r.samples().is_some_and(|n| n >= SAMPLES)),
            View::new(
                "",
                "Errors over the seconds of a scan (Linear, all axes turn at 10 degrees per second, each reading takes 0.5 s)",
                Plots(Seconds, &[LOSS, DELTA_E], VARIED_METHOD),
            ),
        ],
        ..NEW
    },
    Experiment {
        name: "any",
        title: "Losses of readings at the directions of common instruments, without a learned pattern",
        cases: |_| {
            let exact = INSTRUMENTS.iter().map(|sets| Readings(sets, 0));
            let displaced = DISPLACED.iter().map(|sets| Readings(sets, 1));
            let readings: Vec<Variation> = exact.chain(displaced).collect();
            [
                Case::all(&[Ggx], &[CookTorrance], &readings, &[0]),
                Case::all(&[Glimpse], &MODELS, &readings, &[0]),
            ]
            .concat()
        },
        sets: Sets::All,
        views: &[View::new(
            "any",
            "Mean loss by instrument",
            Table(
                &[Key::Variation, Samples],
                &[
                    By(&[Model], &[LOSS]),
                    Named("color error: GGX", |r| is(r, Ggx), DELTA_E, 1),
                    Named("color error: Linear", is_linear, DELTA_E, 1),
                    Named("truth / predicted", is_linear, TruthOverPredicted, 2),
                    Named("bound holds", is_linear, BoundHolds, 2),
                    Named("within one deviation", is_linear, Coverage, 2),
                ],
                Some(WithinRow),
            ),
        )],
        ..NEW
    },
    Experiment {
        name: "patterns",
        title: "Drawings of the learned patterns",
        cases: |_| {
            [
                at_8(&[Paper, Glimpse]),
                vec![Case::new(Baseline, Linear, SAMPLES)],
            ]
            .concat()
        },
        views: &[View::new("pattern", "Learned sample patterns", Patterns)],
        ..NEW
    },
    Experiment {
        name: "teaser",
        title: "Spheres of some materials with each method, for Neural at n = 64",
        cases: |_| Case::all(&COMPARED, &[Neural], &[Unchanged], &[64]),
        views: &[View::new(
            "teaser",
            "Neural, n = 64; test materials from diffuse to glossy",
            Spheres(6, &[], Method),
        )],
        ..NEW
    },
    Experiment {
        name: "increasing",
        title: "Spheres of a glossy material with each model, for increasing n",
        cases: |samples| Case::all(&[Paper, Glimpse], &MODELS, &[Unchanged], samples),
        views: &[
            View::new(
                "spheres",
                "The glossiest test material; each picture uses a different recipe",
                Spheres(1, &[Model, Method], Samples),
            ),
            View::new(
                "losses",
                "Loss over the number of samples",
                Table(
                    &[Model, Method],
                    &[By(&[Samples], &[LOSS])],
                    Some(WithinColumn),
                ),
            ),
        ],
        ..NEW
    },
];

fn measured(record: &Record) -> bool {
    !record.published
}

fn is(record: &Record, approach: Approach) -> bool {
    record.case.approach == approach
}

fn is_linear(record: &Record) -> bool {
    record.case.model == Linear
}

/// Returns some methods for each model at n = 8.
fn at_8(approaches: &[Approach]) -> Vec<Case> {
    Case::all(approaches, &MODELS, &[Unchanged], &[SAMPLES])
}

/// Returns variations of the paper's method for models at n = 8.
fn varied(models: &[ModelKind], variations: impl IntoIterator<Item = Variation>) -> Vec<Case> {
    let variations: Vec<Variation> = variations.into_iter().collect();
    Case::all(&[Paper], models, &variations, &[SAMPLES])
}
