//! Photographs, compared with those of a fit: `trainer photo --compare`

use std::path::Path;

use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::Ggx;
use glimpse_evaluation::render::compare_photographs;
use glimpse_fitting::linear::PosteriorReading;
use glimpse_fitting::measurement::{Multiple, NamedRecipe, ReadingQuantity, ReadingRows, Readings};
use glimpse_fitting::photo::Photograph;
use glimpse_materials::Source;
use serde_json::{Value, json};

use super::super::{emit, load_single};
use super::Photo;
use crate::output::{file_as_json, file_type, write_file};
use crate::report::Table;

impl Photo {
    /// Compares photographs, whose lights have known intensities, with those of a fit, and with Lambert and GGX fitted to
    /// --measurements. Writes a picture, and prints the errors, and their means in the last row.
    pub(super) fn compare(&self, photographs: &[Photograph], fit: &Path) -> anyhow::Result<()> {
        file_type(&self.out, &["png"])?;
        let readings = self.measurements.as_deref();
        let fit = load_single(&Source(fit.display().to_string()))?;
        let (errors, picture) = compare_photographs(photographs, &*fit);
        let ggx = readings.map(fit_ggx).transpose()?;
        let ggx = ggx.map(|ggx| compare_photographs(photographs, &ggx).0);
        write_file(&self.out, &picture.to_png()?, self.force)?;
        let names = photographs.iter().map(|one| &one.name[..]);
        let rows = names.chain(["mean"]).enumerate().map(|(row, name)| {
            let ggx = ggx.as_ref().map(|errors| errors[row]);
            json!({ "picture": name, "levels_and_loss": errors[row], "ggx": ggx })
        });
        let rows: Vec<Value> = rows.collect();
        let report = json!({ "file": file_as_json(&self.out), "pictures": rows });
        let table = Table::of_records("compared photographs", &rows)?;
        emit(self.json, &report, || table.to_markdown())
    }
}

/// Fits Lambert and GGX to the readings of a file.
fn fit_ggx(path: &Path) -> anyhow::Result<Ggx> {
    let rows = ReadingRows::read(path, &Default::default())?;
    let quantity = ReadingQuantity::of_values(None, None, &rows);
    let quantity = quantity.unwrap_or(ReadingQuantity::of(Multiple::Brdf));
    let readings = Readings::new(&NamedRecipe::any(ModelKind::Linear), rows, quantity)?;
    let used = readings.samples.iter();
    let used = used.filter_map(|one| Some(PosteriorReading::new(one.angles, one.used()?)));
    Ok(Ggx::fit(&used.collect::<Vec<_>>()))
}
