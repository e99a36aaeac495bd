//! The loss for all models, methods and schedules in one table, next to the published values.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_materials::Material;
use glimpse_materials::loss::directions;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use glimpse_training::linear::Prior;
use glimpse_training::meta::plan::Schedule;
use rayon::prelude::*;

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::{Store, TestSet};
use super::{MODELS, SAMPLES, SCHEDULE, paper, powers_of_two, title};

/// The schedules that the table compares.
const SCHEDULES: [Schedule; 3] = [Schedule::Paper, Schedule::Joint, Schedule::Prior];

/// Tabulates the loss of all methods at n = 8, and the loss without any measurement.
pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Losses of all methods at n = 8", &SCHEDULES);
    let mut rows = Vec::new();
    for model in MODELS {
        rows.push(row(store, model)?);
    }
    let reference_losses: Vec<[f64; 2]> = store
        .test
        .materials
        .par_iter()
        .map(|material| losses_without_measurement(&**material))
        .collect();
    let names = [
        "black: f = 0",
        "the best Lambertian for each material and channel",
    ];
    for (index, name) in names.into_iter().enumerate() {
        let sum: f64 = reference_losses.iter().map(|losses| losses[index]).sum();
        let mean = sum / reference_losses.len().max(1) as f64;
        let none = std::iter::repeat_n(Cell::Missing, PUBLISHED.len());
        rows.push([Cell::Text(name.into())].into_iter().chain(none).collect());
        rows[MODELS.len() + index].push(Cell::Number(mean));
    }
    let mut columns = vec![Column::text(format!("n = {SAMPLES}"))];
    columns
        .extend(PUBLISHED.map(|column| paper_column(format!("published: {}", names_of(column)))));
    columns.extend(MEASURED.map(|column| loss_column(titles_of(column))));
    findings.table(
        "losses",
        Table {
            caption: format!(
                "Mean loss over the test set at n = {SAMPLES}. Published: the paper's values, on {} \
                 other materials. All other columns: our values on the test set named here, with the \
                 schedule in parentheses. Linear has 5 components and eta = 40, also for Optimum. With \
                 schedule joint, it has 60 components, each with a learned precision. With schedule prior, \
                 a learned map replaces the prior",
                paper::MATERIALS
            ),
            columns,
            rows,
            compare: Compare::WithinColumn,
        },
    );
    Ok(findings)
}

/// The two methods of a column: the one for Phong, Cook-Torrance and Neural, then the one for Linear.
type ColumnMethods = [Approach; 2];

/// Columns with the published values.
const PUBLISHED: [ColumnMethods; 3] = [
    [Approach::Random; 2],
    [Approach::Meta(Schedule::Paper), Approach::Njr15],
    [Approach::Ours(Schedule::Paper); 2],
];

/// Columns with our values.
const MEASURED: [ColumnMethods; 6] = [
    [Approach::Random; 2],
    [Approach::Meta(Schedule::Paper), Approach::Njr15],
    [Approach::Ours(Schedule::Paper); 2],
    [Approach::Ours(Schedule::Joint); 2],
    [Approach::Ours(Schedule::Prior); 2],
    [Approach::Optimum; 2],
];

fn names_of([others, linear]: ColumnMethods) -> String {
    match others == linear {
        true => others.name().into(),
        false => format!("{}, {}", others.name(), linear.name()),
    }
}

fn titles_of([others, linear]: ColumnMethods) -> String {
    match others == linear {
        true => others.title(),
        false => format!("{}, {}", others.title(), linear.title()),
    }
}

fn loss_column(title: impl Into<String>) -> Column {
    Column::number(title, 4, Highlight::None)
}

/// Returns a column with the decimals of the paper.
fn paper_column(title: impl Into<String>) -> Column {
    Column::number(title, 3, Highlight::None)
}

/// Returns a model's row: its losses with each method.
fn row(store: &Store<'_>, model: ModelKind) -> anyhow::Result<Vec<Cell>> {
    let method_of = |[others, linear]: ColumnMethods| match model {
        ModelKind::Linear => linear,
        _ => others,
    };
    let published = PUBLISHED.map(|column| {
        paper::same_samples(model, method_of(column))
            .map_or(Cell::Missing, |[loss, ..]| Cell::Number(loss))
    });
    let mut row = vec![Cell::Text(title(model).into())];
    row.extend(published);
    for column in MEASURED {
        let approach = method_of(column);
        let case = Case {
            prior: match approach.schedule() {
                Some(Schedule::Joint | Schedule::Prior) => Prior::LEARNED,
                Some(Schedule::Paper) | None => Prior::PAPER,
            },
            ..Case::new(approach, model, SAMPLES)
        };
        row.push(Cell::Number(store.evaluation(&case)?.metrics.loss));
    }
    Ok(row)
}

/// Tabulates the loss of Ours over the number of samples.
pub(super) fn losses_over_samples(store: &Store<'_>, max_samples: usize) -> anyhow::Result<Table> {
    let mut columns = vec![Column::text("n")];
    columns.extend(powers_of_two(max_samples).map(|n| loss_column(n.to_string())));
    let mut rows = Vec::new();
    for model in MODELS {
        let mut row = vec![Cell::Text(title(model).into())];
        for n in powers_of_two(max_samples) {
            let case = Case {
                prior: Prior::LEARNED,
                ..Case::new(Approach::Ours(SCHEDULE), model, n)
            };
            row.push(Cell::Number(store.evaluation(&case)?.metrics.loss));
        }
        rows.push(row);
    }
    Ok(Table {
        caption: format!(
            "Loss of {} over the number of samples; Linear with learned precisions",
            Approach::Ours(SCHEDULE).title()
        ),
        columns,
        rows,
        compare: Compare::WithinColumn,
    })
}

/// Tabulates the losses of Ours and its baseline on materials of another source.
pub(super) fn losses_on_other_source(
    store: &Store<'_>,
    set: &TestSet<'_>,
) -> anyhow::Result<Table> {
    let mut columns = vec![Column::text(format!("n = {SAMPLES}"))];
    for column in [
        [Approach::Meta(SCHEDULE), Approach::Njr15],
        [Approach::Ours(SCHEDULE); 2],
    ] {
        let published = format!("published: {}", names_of(column));
        columns.extend([loss_column(titles_of(column)), paper_column(published)]);
    }
    let mut rows = Vec::new();
    for model in MODELS {
        let mut row = vec![Cell::Text(title(model).into())];
        for approach in [
            Approach::baseline(model, SCHEDULE),
            Approach::Ours(SCHEDULE),
        ] {
            let evaluation = store.evaluation_on(set, &Case::new(approach, model, SAMPLES))?;
            row.push(Cell::Number(evaluation.metrics.loss));
            row.push(match paper::rgl(model, approach) {
                Some([loss, ..]) => Cell::Number(loss),
                None => Cell::Missing,
            });
        }
        rows.push(row);
    }
    Ok(Table {
        caption: format!(
            "Loss at n = {SAMPLES}. Published: the paper's values, on other materials of the RGL database"
        ),
        columns,
        rows,
        compare: Compare::WithinColumn,
    })
}

/// Returns two losses, averaged over the channels: of black, and of each channel's best Lambertian BRDF.
fn losses_without_measurement(material: &dyn Material) -> [f64; 2] {
    let at: Vec<HalfDifference<f32>> = directions()
        .into_iter()
        .map(HalfDifference::from_angles)
        .collect();
    let mut values = vec![[0.0; 3]; at.len()];
    material.brdf_batch(&at, &mut values);
    let (mut black, mut best) = (0.0, 0.0);
    for channel in 0..3 {
        let samples = at.iter().zip(&values);
        let samples: Vec<[f64; 2]> = samples
            .map(|(at, value)| [value[channel], at.cos_theta_i()].map(f64::from))
            .collect();
        black += lambertian_loss(&samples, 0.0) / 3.0;
        best += best_lambertian_loss(&samples) / 3.0;
    }
    [black, best]
}

/// Returns the loss of a constant BRDF on pairs of value and cosine.
fn lambertian_loss(samples: &[[f64; 2]], constant: f64) -> f64 {
    let error =
        |[value, cosine]: &[f64; 2]| ((value * cosine).ln_1p() - (constant * cosine).ln_1p()).abs();
    samples.iter().map(error).sum::<f64>() / samples.len().max(1) as f64
}

/// Returns the minimum loss of all constants between 1e-4 and 10, by a logarithmic grid search with three refinements.
fn best_lambertian_loss(samples: &[[f64; 2]]) -> f64 {
    let (mut center, mut reach, mut best) = (-1.5, 2.5, f64::INFINITY);
    for _ in 0..4 {
        let begin = center - reach;
        for step in 0..=40 {
            let exponent = begin + reach * f64::from(step) / 20.0;
            let loss = lambertian_loss(samples, 10f64.powf(exponent));
            if loss < best {
                (best, center) = (loss, exponent);
            }
        }
        reach /= 10.0;
    }
    best
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::Angles;

    use super::*;

    /// A material with a constant BRDF in each channel.
    struct Diffuse([f32; 3]);

    impl Material for Diffuse {
        fn name(&self) -> &str {
            "diffuse"
        }

        fn brdf(&self, _: Angles<f32>) -> [f32; 3] {
            self.0
        }

        fn brdf_with_derivative(&self, _: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
            (self.0, [[0.0; 3]; 3])
        }
    }

    #[test]
    fn best_lambertian_fits_lambertian_material() {
        let [black, best] = losses_without_measurement(&Diffuse([0.3, 0.02, 4.0]));
        assert!(best < 1e-4, "{best}");
        let at = directions();
        let count = at.len() as f64;
        let cosines = at
            .into_iter()
            .map(|angles| f64::from(HalfDifference::from_angles(angles).cos_theta_i()));
        let loss = cosines.map(|cosine| {
            let channels = [0.3, 0.02, 4.0].map(|f: f64| (f * cosine).ln_1p());
            channels.iter().sum::<f64>() / 3.0
        });
        let expected = loss.sum::<f64>() / count;
        assert!((black - expected).abs() < 1e-6, "{black} {expected}");
    }

    #[test]
    fn best_lambertian_of_two_values() {
        let samples = [[0.1, 1.0], [0.4, 1.0], [0.1, 1.0], [0.4, 1.0]];
        let expected = (1.4_f64.ln() - 1.1_f64.ln()) / 2.0;
        assert!((best_lambertian_loss(&samples) - expected).abs() < 1e-6);
    }
}
