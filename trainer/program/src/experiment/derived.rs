//! Records that are computed from those of the evaluations.

use clap::ValueEnum;
use glimpse_core::geometry::HalfDifference;
use glimpse_evaluation::evaluation::MaterialMetrics;
use glimpse_evaluation::metrics::{METRICS, Metrics};
use glimpse_fitting::choice::Choice;
use glimpse_materials::MODELS;
use glimpse_materials::loss::loss_between;

use super::case::{Approach, Case, SAMPLES, Subset};
use super::glossiness::split_by_glossiness;
use super::record::Record;
use super::store::{Store, TestSet};

/// Adds the loss of black, that is, without a measurement.
pub(super) fn with_black(
    _: &Store<'_>,
    set: &TestSet<'_>,
    mut records: Vec<Record>,
) -> Vec<Record> {
    let black = |_: &HalfDifference<f32>| [0.0; 3];
    let materials = set.materials.iter();
    let losses = materials.map(|material| loss_between(&black, &**material));
    let loss = losses.sum::<f64>() / set.materials.len() as f64;
    let case = Case::new(Approach::Black, MODELS[0], 0);
    records.push(Record::new(case, &[loss]));
    records
}

/// Replaces the metrics of each curve over n by the n, divided by [`SAMPLES`], at which it reaches the paper's method.
pub(super) fn same_quality(_: &Store<'_>, _: &TestSet<'_>, records: Vec<Record>) -> Vec<Record> {
    let (mut published, measured): (Vec<Record>, Vec<Record>) =
        records.into_iter().partition(|record| record.published);
    let (targets, points): (Vec<Record>, Vec<Record>) = measured
        .into_iter()
        .partition(|record| record.case.approach == Approach::Paper);
    let curve_of = |record: &Record| (record.case.model, record.case.approach);
    let mut reached = Vec::new();
    for curve in points.chunk_by(|one, other| curve_of(one) == curve_of(other)) {
        let case = curve[0].case;
        let target = targets
            .iter()
            .find(|record| record.case.model == case.model);
        let metrics = METRICS.iter().enumerate().map(|(index, metric)| {
            let sign = if metric.higher_is_better { -1.0 } else { 1.0 };
            let points = curve
                .iter()
                .map(|record| (record.case.samples as f64, sign * record.metrics[index]));
            let n = samples_to_reach(points, sign * target?.metrics[index])?;
            Some(n / SAMPLES as f64)
        });
        let metrics: Vec<f64> = metrics.map(|ratio| ratio.unwrap_or(f64::NAN)).collect();
        reached.push(Record::new(case, &metrics));
    }
    reached.append(&mut published);
    reached
}

/// Returns the smallest n at which a curve falls to the target, interpolated linearly over ln n. Returns None if no point
/// reaches it.
fn samples_to_reach(points: impl Iterator<Item = (f64, f64)>, target: f64) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for (n, value) in points {
        let excess = value - target;
        if excess <= 0.0 {
            return Some(match before {
                Some((n_before, excess_before)) => {
                    let fraction = excess_before / (excess_before - excess);
                    (n_before.ln() + fraction * (n.ln() - n_before.ln())).exp()
                }
                None => n,
            });
        }
        before = Some((n, excess));
    }
    None
}

/// Returns a record for each material, sorted by the loss of the paper's method, from high to low.
pub(super) fn by_material(_: &Store<'_>, _: &TestSet<'_>, records: Vec<Record>) -> Vec<Record> {
    let mut all = Vec::new();
    for records in records.chunk_by(|one, other| one.case.model == other.case.model) {
        let paper = records
            .iter()
            .find(|record| record.case.approach == Approach::Paper);
        let losses = paper.into_iter().flat_map(materials);
        let losses: Vec<f64> = losses.map(|material| material.metrics.loss).collect();
        let mut order: Vec<usize> = (0..losses.len()).collect();
        order.sort_by(|a, b| losses[*b].total_cmp(&losses[*a]));
        for record in records {
            let ordered = order.iter().map(|index| &materials(record)[*index]);
            all.extend(ordered.enumerate().map(|(position, material)| Record {
                material: Some((position, material.name.clone())),
                ..Record::new(record.case, &material.metrics.values())
            }));
        }
    }
    all
}

/// Returns a record for each half of the materials by glossiness, and for all of them.
pub(super) fn by_subset(store: &Store<'_>, set: &TestSet<'_>, records: Vec<Record>) -> Vec<Record> {
    let mut all = Vec::new();
    for record in &records {
        for (index, subset) in Subset::value_variants().iter().enumerate() {
            let names = split_by_glossiness(set.materials, store.settings.seed, *subset);
            let of_subset = materials(record)
                .iter()
                .filter(|material| names.contains(&material.name));
            let mean = Metrics::mean(of_subset.map(|material| material.metrics));
            all.extend(mean.map(|mean| Record {
                material: Some((index, format!("test materials: {}", subset.name()))),
                ..Record::new(record.case, &mean.values())
            }));
        }
    }
    all
}

fn materials(record: &Record) -> &[MaterialMetrics] {
    record
        .report
        .as_ref()
        .map_or(&[], |report| &report.materials)
}

#[cfg(test)]
mod tests {
    use super::samples_to_reach;

    #[test]
    fn interpolates_between_points() {
        let falling = [(1.0, 0.4), (4.0, 0.2), (16.0, 0.1)];
        let near = |a: Option<f64>, b: f64| (a.unwrap_or(f64::NAN) - b).abs() < 1e-9;
        assert!(near(samples_to_reach(falling.into_iter(), 0.3), 2.0));
        assert!(near(samples_to_reach(falling.into_iter(), 0.4), 1.0));
        assert_eq!(samples_to_reach(falling.into_iter(), 0.05), None);
    }
}
