//! Drawings of the learned patterns (paper, figure "Pattern").

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_trainer::report::pattern_svg;

use super::case::{Approach, Case};
use super::findings::Findings;
use super::store::Store;
use super::{MODELS, SAMPLES, SCHEDULE, title};

pub(super) fn run(store: &Store<'_>) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(store, "Learned sample patterns of each model", &[SCHEDULE]);
    let cases = MODELS.map(|model| (Approach::Ours(SCHEDULE), model));
    for (approach, model) in cases
        .into_iter()
        .chain([(Approach::Njr15, ModelKind::Linear)])
    {
        let case = Case::new(approach, model, SAMPLES);
        if store.record_only(&case)? {
            continue;
        }
        let pattern: Vec<Angles<f32>> =
            store.with_method(&case, |method| Ok(method.pattern().to_vec()))?;
        let name = format!("{}-{}", model.name(), approach.name().to_lowercase());
        let caption = format!("{}, {}, n = {SAMPLES}", title(model), approach.title());
        findings.drawing(name, pattern_svg(&pattern), &caption);
    }
    Ok(findings)
}
