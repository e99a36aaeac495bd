//! The paper's tables of methods at one number of samples, and the loss of each material.

use crate::report::{Axis, Cell, Column, Compare, Scale};
use anyhow::bail;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::names;
use glimpse_materials::loss::loss_between;

use super::case::{Approach, Case};
use super::engine::{Evaluated, Grid, Line, Part, Plan, PlotOfColumns, Row};
use super::paper::{self, PaperMetrics};
use super::pictures::spheres_by_model;
use super::shared::{MODELS, SAMPLES, title};
use super::store::Store;

/// The number of samples of the paper's comparison with Nielsen et al.
const NIELSEN_SAMPLES: usize = 2;
/// The numbers of components of Linear in the paper.
const COMPONENTS: [usize; 2] = [5, 240];

/// All methods for all models at n = 8, and spheres of two materials.
pub(super) fn same_samples(store: &Store<'_>) -> Plan {
    let mut parts = vec![
        Part::Text(
            "All values are means over the test materials. For Random and Meta, they are also means \
             over several seeds, and the PSNR of a material is that of its mean L2. The standard error \
             is over the materials. The published values are for the paper's 20 test materials of MERL."
                .into(),
        ),
        Part::Text(
            "For Phong and Cook-Torrance, Random starts at standard normal parameters. 20 steps of Adam \
             at a rate of 0.001 change no parameter by more than 0.02, so the loss is that of the initial \
             parameters. The paper does not state its initial parameters. Cook-Torrance logits of about 0 \
             reflect half of each color diffusely and half specularly, far brighter than most materials. \
             On 16 networks of MERL materials, the loss is 0.274 before the first step and 0.271 after 20 \
             steps. From logits of -2, the loss would be 0.100; in the paper it is 0.098. Methods with \
             learned initial parameters are not affected."
                .into(),
        ),
    ];
    for model in MODELS {
        let rows = Approach::compared(model).map(|approach| {
            let case = Case::new(approach, model, SAMPLES);
            let published = paper::same_samples(model, approach);
            (vec![approach.name().into()], case, published)
        });
        let caption = format!("{}, n = {SAMPLES}", title(model));
        parts.push(Part::Grid(Grid::of_metrics(
            model.name(),
            caption,
            &["Method"],
            rows,
        )));
    }
    parts.extend(spheres_by_model(store).map(Part::Spheres));
    Plan {
        title: "Same number of samples: n = 8",
        parts,
    }
}

/// The two methods of a column: the one for Phong, Cook-Torrance and Neural, then the one for Linear.
type ColumnMethods = [Approach; 2];

const RANDOM: ColumnMethods = [Approach::Random; 2];
const BASELINE: ColumnMethods = [Approach::Meta, Approach::Njr15];
const PAPER: ColumnMethods = [Approach::Paper; 2];
const GLIMPSE: ColumnMethods = [Approach::Glimpse; 2];
const OPTIMUM: ColumnMethods = [Approach::Optimum; 2];

fn names_of([others, linear]: ColumnMethods) -> String {
    match others == linear {
        true => others.name().into(),
        false => format!("{}, {}", others.name(), linear.name()),
    }
}

/// Creates a table of losses with a row for each model: the published ones, then the measured ones.
fn loss_by_model(
    name: impl Into<String>,
    caption: impl Into<String>,
    published: &[ColumnMethods],
    values: fn(ModelKind, Approach) -> Option<PaperMetrics>,
    measured: &[ColumnMethods],
) -> Grid {
    let mut columns = vec![Column::text(format!("n = {SAMPLES}"))];
    let published_titles = published.iter().map(|methods| names_of(*methods));
    columns.extend(published_titles.map(|names| Column::plain(format!("published: {names}"), 3)));
    columns.extend(
        measured
            .iter()
            .map(|methods| Column::plain(names_of(*methods), 4)),
    );
    let rows = MODELS.map(|model| {
        let method_of = |[others, linear]: &ColumnMethods| match model {
            ModelKind::Linear => *linear,
            _ => *others,
        };
        let published = published
            .iter()
            .map(|methods| Cell::from(values(model, method_of(methods)).map(|[loss, ..]| loss)));
        let cases = measured
            .iter()
            .map(|methods| Case::new(method_of(methods), model, SAMPLES));
        Row {
            labels: [title(model).into()].into_iter().chain(published).collect(),
            cases: cases.collect(),
            published: Vec::new(),
        }
    });
    Grid::new(name, caption, columns, rows.into())
}

/// The loss of all methods at n = 8, and the loss without any measurement.
pub(super) fn losses() -> Plan {
    let published = [RANDOM, BASELINE, PAPER];
    let measured = [RANDOM, BASELINE, PAPER, GLIMPSE, OPTIMUM];
    let caption = format!(
        "Mean loss over the test set at n = {SAMPLES}. Published: the paper's values, on {} other \
         materials. All other columns: our values on the test set named here. Meta and the paper's have \
         schedule paper, Glimpse has schedule prior. Linear has 5 components and eta = 40, also for Optimum; \
         for Glimpse, a learned map replaces them",
        paper::MATERIALS
    );
    let mut grid = loss_by_model(
        "losses",
        caption,
        &published,
        paper::same_samples,
        &measured,
    );
    let unmeasured = ["black: f = 0".into()].into_iter();
    grid.rows.push(Row {
        labels: unmeasured.chain(published.map(|_| Cell::Missing)).collect(),
        ..Row::default()
    });
    grid.values = |evaluated| {
        if !evaluated.row.cases.is_empty() {
            return Ok(evaluated.row_of(evaluated.losses()));
        }
        let materials = evaluated.set.materials;
        let black = |_: &HalfDifference<f32>| [0.0; 3];
        let losses = materials.iter().map(|each| loss_between(&black, &**each));
        Ok(evaluated.row_of([losses.sum::<f64>() / materials.len() as f64]))
    };
    let mut columns = vec![Column::text("Model")];
    let shown = [Approach::Random, Approach::Paper, Approach::Glimpse];
    columns.extend(shown.map(|approach| Column::plain(approach.name(), 4)));
    columns.push(Column::plain(
        format!("color error of {}", names::GLIMPSE),
        1,
    ));
    let rows = MODELS.map(|model| Row {
        labels: vec![title(model).into()],
        cases: shown
            .map(|approach| Case::new(approach, model, SAMPLES))
            .into(),
        ..Row::default()
    });
    let summary = Grid {
        values: |evaluated| {
            let color_error = evaluated
                .reports
                .last()
                .map(|glimpse| glimpse.metrics.delta_e);
            Ok(evaluated.row_of(evaluated.losses().into_iter().chain(color_error)))
        },
        ..Grid::new(
            "summary",
            format!("Mean losses, and mean color error of spheres, at n = {SAMPLES}"),
            columns,
            rows.into(),
        )
    };
    Plan {
        title: "Losses of all methods at n = 8",
        parts: vec![Part::Grid(grid), Part::Grid(summary)],
    }
}

/// Evaluations on materials of other sources (paper, tables "Nielsen" and "RGLeval").
pub(super) fn additional(store: &Store<'_>) -> anyhow::Result<Plan> {
    if store.sets.len() < 2 {
        bail!(
            "the experiment additional needs materials of other sources: give --additional with, for \
             example, the eight materials of Nielsen et al. or the RGL database"
        );
    }
    let mut parts = vec![Part::Text(
        "The recipes are trained on --data and evaluated on materials of other sources. The published \
         values are for the eight materials of Nielsen et al. at n = 2, and for the isotropic part of the \
         RGL database at n = 8."
            .into(),
    )];
    for (set, test_set) in store.sets.iter().enumerate().skip(1) {
        let mut add =
            |model: ModelKind, samples, label: &str, published: &dyn Fn(Approach) -> _| {
                let methods = [
                    Approach::baseline(model),
                    Approach::Paper,
                    Approach::Glimpse,
                ];
                let rows = methods.map(|approach| {
                    let labels = vec![title(model).into(), approach.name().into()];
                    (
                        labels,
                        Case::new(approach, model, samples),
                        published(approach),
                    )
                });
                parts.push(Part::Grid(Grid {
                    set,
                    ..Grid::of_metrics(
                        format!("{}-{label}-n{samples}", test_set.label),
                        format!("n = {samples}"),
                        &["Model", "Method"],
                        rows,
                    )
                }));
            };
        add(
            ModelKind::Linear,
            NIELSEN_SAMPLES,
            "linear",
            &paper::nielsen,
        );
        for model in MODELS {
            add(model, SAMPLES, model.name(), &|approach| {
                paper::rgl(model, approach)
            });
        }
        let caption = format!(
            "Loss at n = {SAMPLES}. Published: the paper's values, on other materials of the RGL database"
        );
        parts.push(Part::Grid(Grid {
            set,
            ..loss_by_model(
                format!("losses-{set}"),
                caption,
                &[BASELINE, PAPER],
                paper::rgl,
                &[BASELINE, PAPER, GLIMPSE],
            )
        }));
    }
    Ok(Plan {
        title: "Materials of other sources",
        parts,
    })
}

/// Linear with 5 and with 240 components (paper, "Same-quality").
pub(super) fn bases(store: &Store<'_>) -> Plan {
    let intro = "The paper found similar results with both numbers of components. Here the number is \
                 smaller if there are too few training columns, three for each material.";
    // Subtracting the mean leaves one component fewer than columns.
    let max_components = (3 * store.training_count).saturating_sub(1).max(1);
    let rows = COMPONENTS.into_iter().flat_map(|components| {
        let components = components.min(max_components);
        [Approach::Random, Approach::Njr15, Approach::Paper].map(|approach| {
            let case = Case {
                components,
                ..Case::new(approach, ModelKind::Linear, SAMPLES)
            };
            let labels = vec![components.into(), approach.name().into()];
            let published = match components == COMPONENTS[0] {
                true => paper::same_samples(ModelKind::Linear, approach),
                false => None,
            };
            (labels, case, published)
        })
    });
    let caption = format!("Linear, n = {SAMPLES}");
    let grid = Grid::of_metrics("bases", caption, &["components", "Method"], rows);
    Plan {
        title: "Linear with 5 and with 240 components",
        parts: vec![Part::Text(intro.into()), Part::Grid(grid)],
    }
}

/// The loss of each material, sorted by the loss of the paper's method (paper, figure "Zipfplots").
pub(super) fn per_material() -> Plan {
    let mut parts = Vec::new();
    for model in MODELS {
        let approaches = Approach::compared(model);
        let methods = approaches.map(|approach| Column::loss(approach.name()));
        let lines = approaches.into_iter().zip(1..);
        let plot = PlotOfColumns {
            name: model.name().into(),
            title: format!("{}: loss of each material", title(model)),
            x: Axis {
                title: "material, sorted by the loss of the paper's method".into(),
                scale: Scale::Linear,
            },
            x_column: 0,
            metric: "Loss",
            lines: lines
                .map(|(approach, column)| Line::new(approach, None, column))
                .collect(),
        };
        parts.push(Part::Grid(Grid {
            compare: Compare::WithinRow,
            values: rows_of_materials,
            plots: vec![plot],
            ..Grid::new(
                model.name(),
                format!("{}, loss at n = {SAMPLES}", title(model)),
                [Column::text("Material")]
                    .into_iter()
                    .chain(methods)
                    .collect(),
                vec![Row {
                    cases: approaches
                        .map(|approach| Case::new(approach, model, SAMPLES))
                        .into(),
                    ..Row::default()
                }],
            )
        }));
    }
    Plan {
        title: "Loss of each material at n = 8",
        parts,
    }
}

/// Returns a row with the loss of each method for each material, sorted by the loss of the paper's method.
fn rows_of_materials(evaluated: &Evaluated<'_, '_>) -> anyhow::Result<Vec<Vec<Cell>>> {
    let cases = evaluated.row.cases.iter();
    let paper = cases.zip(&evaluated.reports);
    let paper = paper.filter(|(case, _)| case.approach == Approach::Paper);
    let losses: Vec<f64> = paper.flat_map(|(_, report)| report.losses()).collect();
    let mut order: Vec<usize> = (0..losses.len()).collect();
    order.sort_by(|a, b| losses[*b].total_cmp(&losses[*a]));
    let row = |index: usize| {
        let materials = evaluated.reports.iter().map(|each| &each.materials[index]);
        let name = materials
            .clone()
            .next()
            .map(|material| Cell::from(&material.name[..]));
        let values = materials.map(|material| Cell::Number(material.metrics.loss));
        name.into_iter().chain(values).collect()
    };
    Ok(order.into_iter().map(row).collect())
}
