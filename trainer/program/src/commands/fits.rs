//! Fits of materials by several methods, for a page: their mean errors, and spheres.

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{Evaluator, Method};
use glimpse_evaluation::metrics::Metrics;
use glimpse_fitting::bundled;
use glimpse_fitting::recipe::Metadata;
use glimpse_fitting::route::{Order, Route};
use rayon::prelude::*;
use serde_json::Value;

use crate::progress::StepProgress;
use crate::report::{Column, GalleryRow, Page, Table, metric_columns, metric_row};

/// A method with its name and the costs of a scan.
pub(super) struct NamedMethod<'a> {
    name: String,
    method: Method<'a>,
    /// Duration of a scan in seconds; None if the directions differ between materials.
    seconds: Option<f64>,
    /// Cycles of a fit on a Cortex-M4F, if they were measured.
    cycles: Option<u64>,
}

impl<'a> NamedMethod<'a> {
    /// Creates the method of a recipe, with the costs of a scan on its machine.
    pub(super) fn of_recipe(
        name: &str,
        recipe: &Recipe<'_>,
        method: Method<'a>,
    ) -> anyhow::Result<Self> {
        let machine = Metadata::of(recipe)?.machine();
        let route = Route::of_recipe(recipe, &machine, Order::Travel);
        let route = route.filter(|_| !method.pattern().is_empty());
        let bundled = bundled::find_by_checksum(recipe.checksum());
        Ok(Self {
            name: name.to_owned(),
            method,
            seconds: route.map(|route| route.total()),
            cycles: bundled.and_then(bundled::BundledRecipe::cycles),
        })
    }
}

/// Fits all materials with all methods. Adds the spheres and a table of mean errors to a page, and returns the table.
pub(super) fn add_fits(
    page: &mut Page,
    caption: &str,
    evaluator: &Evaluator<'_>,
    methods: &[NamedMethod<'_>],
    seed: u64,
) -> anyhow::Result<Table> {
    let materials = evaluator.materials;
    let progress = StepProgress::new("rendering fits", materials.len());
    let fit = |index: usize| -> anyhow::Result<_> {
        let fits = methods.iter().map(|named| {
            let seed = seed.wrapping_add(index as u64);
            let fitted = named.method.fit(&*materials[index], seed)?.fitted;
            let (metrics, picture) = evaluator.compare(index, &*fitted);
            Ok((named.name.clone(), metrics, picture))
        });
        let fits = fits.collect::<anyhow::Result<Vec<_>>>();
        progress.increment();
        fits
    };
    let indices = (0..materials.len()).into_par_iter();
    let fits = indices.map(fit).collect::<anyhow::Result<Vec<_>>>()?;
    drop(progress);

    let rows = methods.iter().enumerate().map(|(index, named)| {
        let mean = Metrics::mean(fits.iter().map(|fits| fits[index].1)).unwrap_or_default();
        let cycles = named.cycles.map(|cycles| cycles as f64);
        let costs = [named.seconds, cycles].map(Value::from);
        metric_row(&[named.name[..].into()], &mean, &costs)
    });
    let costs = [
        Column::plain("Scan (s)", 1),
        Column::plain("Fit (cycles)", 0),
    ];
    let columns = [&[Column::text("Method")][..], &metric_columns(), &costs].concat();
    let table = Table::new(caption, columns, rows);

    let rows = fits.into_iter().enumerate().map(|(index, fits)| {
        let reference = evaluator.reference(index).clone();
        GalleryRow::of_fits(materials[index].name(), reference, fits)
    });
    page.table(&table)
        .gallery(caption, &rows.collect::<Vec<_>>());
    Ok(table)
}
