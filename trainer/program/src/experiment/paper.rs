//! The paper's published values, shown next to ours.

use super::case::Case;
use super::record::Record;

/// The values: names of experiments and of a case, the metrics loss, DSSIM, L2 and PSNR, and the increase of the loss by a
/// variation in percent; NaN if the paper does not state one.
const VALUES: &str = include_str!("paper.csv");

/// Returns the published values of cases in an experiment.
pub(super) fn published(experiment: &str, cases: &[Case]) -> Result<Vec<Record>, csv::Error> {
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.comment(Some(b'#')).from_reader(VALUES.as_bytes());
    let rows = reader.deserialize().collect::<Result<Vec<_>, _>>()?;
    let row_of = |case: &Case| {
        let name = case.name();
        let mut rows = rows.iter();
        rows.find(
            |(experiments, case, ..): &&(String, String, [f64; 4], f64)| {
                *case == name && experiments.split(' ').any(|of| of == experiment)
            },
        )
    };
    let record = |case: &Case| {
        let (_, _, metrics, increase) = row_of(case)?;
        Some(Record {
            published: true,
            increase: *increase,
            ..Record::new(*case, metrics)
        })
    };
    Ok(cases.iter().filter_map(record).collect())
}

#[cfg(test)]
mod tests {
    use super::super::definitions::EXPERIMENTS;
    use super::*;

    #[test]
    fn every_published_value_is_shown() {
        let shown = EXPERIMENTS.iter().flat_map(|experiment| {
            let cases = (experiment.cases)(&[1, 2, 4, 8]);
            let records = published(experiment.name, &cases).expect("valid values");
            let names = records.into_iter().map(|record| record.case.name());
            names.map(|case| (experiment.name, case))
        });
        let shown: Vec<_> = shown.collect();
        let rows = VALUES.lines().filter(|line| !line.starts_with('#')).skip(1);
        for row in rows {
            let cells: Vec<&str> = row.splitn(3, ',').collect();
            let is_shown = |experiment| shown.contains(&(experiment, cells[1].to_owned()));
            assert!(cells[0].split(' ').any(is_shown), "{row}");
        }
    }
}
