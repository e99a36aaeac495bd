//! The loss alone, of all models and methods in one table: what the front page shows.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::directions;
use glimpse_trainer::linear::Prior;
use glimpse_trainer::material::Material;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use rayon::prelude::*;

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::{Store, TestSet};
use super::{MODELS, SAMPLES, doublings, paper, title};

/// The columns of the table of methods.
const APPROACHES: [Approach; 5] = [
    Approach::Random,
    Approach::Meta,
    Approach::Njr15,
    Approach::Ours,
    Approach::Optimum,
];

/// All methods at n = 8, and what is lost without any measurement.
pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new("Losses of all methods: n = 8");
    findings.text(
        "Means over the materials judged; Random and Meta over several seeds too. Linear has 5 \
         components and eta = 40, where it says learned, more of them with a learned precision \
         each; the paper's figures are on its own 20 materials of MERL.",
    );
    let mut rows = Vec::new();
    for model in MODELS {
        rows.push(row(store, model, Prior::PAPER)?);
        if model == ModelKind::Linear {
            rows.push(row(store, model, Prior::LEARNED)?);
        }
    }
    let floors: Vec<[f64; 2]> = store
        .test
        .materials
        .par_iter()
        .map(|material| without_measurement(&**material))
        .collect();
    let names = [
        "black: f = 0",
        "the best Lambertian for each material and channel",
    ];
    for (index, name) in names.into_iter().enumerate() {
        let sum: f64 = floors.iter().map(|floor| floor[index]).sum();
        rows.push(vec![
            Cell::Text(name.into()),
            Cell::Number(sum / floors.len().max(1) as f64),
        ]);
    }
    let mut columns = vec![Column::text(format!("n = {SAMPLES}"))];
    columns.extend(APPROACHES.map(|approach| loss_column(approach.title())));
    columns.push(paper_column("the paper's Ours"));
    findings.table(
        "losses",
        Table {
            caption: format!("Loss, n = {SAMPLES}"),
            columns,
            rows,
            compare: Compare::Down,
        },
    );
    Ok(findings)
}

fn loss_column(title: impl Into<String>) -> Column {
    Column::number(title, 4, Best::None)
}

/// With the digits that the paper gives.
fn paper_column(title: &str) -> Column {
    Column::number(title, 3, Best::None)
}

/// A model's losses by each method that it has.
fn row(store: &Store<'_>, model: ModelKind, prior: Prior) -> anyhow::Result<Vec<Cell>> {
    let learned = model == ModelKind::Linear && prior.eta.is_none();
    let name = title(model);
    let mut row = vec![Cell::Text(match learned {
        true => format!("{name}, learned"),
        false => name.into(),
    })];
    for approach in APPROACHES {
        let is_there = match approach {
            Approach::Ours => true,
            // Linear's start is its mean: to learn precisions is all that is left to Meta.
            Approach::Meta => learned || model != ModelKind::Linear,
            Approach::Njr15 => model == ModelKind::Linear && !learned,
            Approach::Random | Approach::Optimum => !learned,
        };
        row.push(match is_there {
            true => {
                let case = Case {
                    prior,
                    ..Case::new(approach, model, SAMPLES)
                };
                Cell::Number(store.evaluation(&case)?.scores.loss)
            }
            false => Cell::Missing,
        });
    }
    row.push(match paper::same_samples(model, Approach::Ours) {
        Some([loss, ..]) if !learned => Cell::Number(loss),
        _ => Cell::Missing,
    });
    Ok(row)
}

/// Ours by the number of samples.
pub(super) fn by_samples(store: &Store<'_>, most: usize) -> anyhow::Result<Table> {
    let mut columns = vec![Column::text("n")];
    columns.extend(doublings(most).map(|n| loss_column(n.to_string())));
    let mut rows = Vec::new();
    for model in MODELS {
        let mut row = vec![Cell::Text(title(model).into())];
        for n in doublings(most) {
            let case = Case {
                prior: Prior::LEARNED,
                ..Case::new(Approach::Ours, model, n)
            };
            row.push(Cell::Number(store.evaluation(&case)?.scores.loss));
        }
        rows.push(row);
    }
    Ok(Table {
        caption: "Loss of Ours by number of samples; Linear with learned precisions".into(),
        columns,
        rows,
        compare: Compare::Down,
    })
}

/// Ours and what learns less, on materials of another source.
pub(super) fn on_others(store: &Store<'_>, set: &TestSet<'_>) -> anyhow::Result<Table> {
    let mut columns = vec![Column::text(format!("n = {SAMPLES}"))];
    for method in ["Meta, NJR15", "Ours"] {
        columns.extend([loss_column(method), paper_column("the paper's")]);
    }
    let mut rows = Vec::new();
    for model in MODELS {
        let mut row = vec![Cell::Text(title(model).into())];
        for approach in [Approach::baseline(model), Approach::Ours] {
            let evaluation = store.evaluation_on(set, &Case::new(approach, model, SAMPLES))?;
            row.push(Cell::Number(evaluation.scores.loss));
            row.push(match paper::rgl(model, approach) {
                Some([loss, ..]) => Cell::Number(loss),
                None => Cell::Missing,
            });
        }
        rows.push(row);
    }
    Ok(Table {
        caption: format!(
            "Loss on {}: {} materials, the paper's on RGL's",
            set.label,
            set.materials.len()
        ),
        columns,
        rows,
        compare: Compare::Down,
    })
}

/// The loss of black, and of the best Lambertian BRDF for each channel.
fn without_measurement(material: &dyn Material) -> [f64; 2] {
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
        black += lambertian(&samples, 0.0) / 3.0;
        best += best_lambertian(&samples) / 3.0;
    }
    [black, best]
}

/// The loss of a constant BRDF on pairs of value and cosine.
fn lambertian(samples: &[[f64; 2]], constant: f64) -> f64 {
    let error =
        |[value, cosine]: &[f64; 2]| ((value * cosine).ln_1p() - (constant * cosine).ln_1p()).abs();
    samples.iter().map(error).sum::<f64>() / samples.len().max(1) as f64
}

/// The least loss of any constant between 1e-4 and 10: a coarse search by factors, and a finer one
/// around what it finds.
fn best_lambertian(samples: &[[f64; 2]]) -> f64 {
    let (mut centre, mut reach, mut best) = (-1.5, 2.5, f64::INFINITY);
    for _ in 0..4 {
        let begin = centre - reach;
        for step in 0..=40 {
            let exponent = begin + reach * f64::from(step) / 20.0;
            let loss = lambertian(samples, 10f64.powf(exponent));
            if loss < best {
                (best, centre) = (loss, exponent);
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

    /// Constant in each channel.
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
    fn a_lambertian_material_loses_nothing_to_the_best_one() {
        let [black, best] = without_measurement(&Diffuse([0.3, 0.02, 4.0]));
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
    fn half_and_half_is_served_by_either() {
        let samples = [[0.1, 1.0], [0.4, 1.0], [0.1, 1.0], [0.4, 1.0]];
        let expected = (1.4_f64.ln() - 1.1_f64.ln()) / 2.0;
        assert!((best_lambertian(&samples) - expected).abs() < 1e-6);
    }
}
