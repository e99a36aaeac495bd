//! Readings at directions of common instruments, completed without a learned pattern.

use crate::report::{Column, Compare};
use clap::ValueEnum;
use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::Instrument;

use super::case::{Approach, Case, DISPLACEMENTS, Variation};
use super::engine::{Grid, Part, Plan, Row};
use super::shared::{MODELS, title};
use super::store::Store;

/// Each instrument, with exact readings, and with displaced arms.
pub(super) fn any(store: &Store<'_>) -> Plan {
    let intro = "Readings of instruments that everybody has: a handheld multi-angle instrument (light at 45 degrees, \
                 aspecular angles -15, 15, 25, 45, 75 and 110), the same with gloss at 20, 60 and 80 degrees, one line \
                 of a goniometer, and five lines. GGX is today's practice: a diffuse and a GGX lobe with eight \
                 parameters, fitted to the same readings by robust least squares from four starts. The models complete \
                 the readings with a recipe of `trainer train --samples any`.";
    let mut parts = vec![Part::Text(intro.into())];
    for (set, test_set) in store.sets.iter().enumerate() {
        let rows = DISPLACEMENTS
            .into_iter()
            .flat_map(|(displacement, description)| {
                Instrument::value_variants().iter().map(move |&instrument| {
                    let case = |approach, model| {
                        let readings = Variation::Readings(instrument, displacement);
                        Case::new(approach, model, 0).with(readings)
                    };
                    let models = MODELS.map(|model| case(Approach::Any, model));
                    let ggx = case(Approach::Ggx, ModelKind::CookTorrance);
                    Row {
                        labels: vec![
                            instrument_name(instrument).into(),
                            description.into(),
                            instrument.directions(0.0).len().into(),
                        ],
                        cases: [ggx].into_iter().chain(models).collect(),
                        ..Row::default()
                    }
                })
            });
        let mut columns = vec![
            Column::text("Instrument"),
            Column::text("Readings"),
            Column::plain("n", 0),
            Column::loss("GGX"),
        ];
        columns.extend(MODELS.map(|model| Column::loss(title(model))));
        columns.push(Column::plain("color error: GGX", 1));
        columns.push(Column::plain("color error: Linear", 1));
        columns.push(Column::plain("truth / predicted", 2));
        columns.push(Column::plain("bound holds", 2));
        parts.push(Part::Grid(Grid {
            set,
            compare: Compare::WithinRow,
            values: |evaluated| {
                let losses = evaluated.losses();
                let linear = MODELS.iter().position(|model| *model == ModelKind::Linear);
                let linear = 1 + linear.unwrap_or_default();
                let color = |index: usize| evaluated.reports[index].metrics.delta_e;
                let report = &evaluated.reports[linear];
                let predicted = report.predicted_losses().unwrap_or_default();
                let predicted = predicted.iter().sum::<f64>() / predicted.len() as f64;
                let more = [
                    color(0),
                    color(linear),
                    losses[linear] / predicted,
                    report.bound_coverage().unwrap_or(f64::NAN),
                ];
                Ok(evaluated.row_of(losses.iter().copied().chain(more)))
            },
            ..Grid::new(
                format!("any-{}", test_set.label),
                "Mean loss by instrument",
                columns,
                rows.collect(),
            )
        }));
    }
    Plan {
        title: "Readings at any directions",
        parts,
    }
}

fn instrument_name(instrument: Instrument) -> &'static str {
    match instrument {
        Instrument::MultiAngle => "six aspecular angles",
        Instrument::MultiAngleGloss => "the same and gloss",
        Instrument::InPlane => "one line",
        Instrument::FiveLines => "five lines",
    }
}
