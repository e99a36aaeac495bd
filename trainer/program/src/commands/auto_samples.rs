//! `trainer train --samples auto`: the number of samples with the lowest expected loss within the time of a scan.

use crate::report::{Column, Table};
use anyhow::{Context, bail};
use glimpse_materials::Sources;
use glimpse_training::meta::objective::LossEstimate;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::plan::Effort;
use glimpse_training::meta::run::TrainError;
use glimpse_training::meta::scan_budget::{ScanBudget, ScanBudgetError};

use super::load_all;
use super::progress::train_with_progress;

/// The numbers of samples that are compared.
const CANDIDATES: [usize; 12] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];
/// The maximum number of trainings. Smaller numbers of samples, which leave more time for motion, are omitted.
const MAX_TRAININGS: usize = 5;
/// The largest share of a scan without motion.
const MAX_SETTLING: f64 = 0.75;

/// Returns the numbers of samples to compare.
fn candidates(scan: &ScanBudget) -> Vec<usize> {
    let fitting = |samples: &&usize| scan.settle * **samples as f64 <= MAX_SETTLING * scan.seconds;
    let fitting: Vec<usize> = CANDIDATES.iter().filter(fitting).copied().collect();
    fitting[fitting.len().saturating_sub(MAX_TRAININGS)..].to_vec()
}

/// Trains quickly with each number of samples, prints a table of the expected losses to standard error, and returns the number
/// with the smallest one. Numbers whose scans cannot be as fast are omitted. `options_for` returns the options of a training.
/// The quick trainings are not saved: a command that is repeated after Ctrl-C runs them again, with the same result.
pub(super) fn choose_samples(
    sources: &Sources,
    options_for: impl Fn(usize) -> anyhow::Result<Options>,
) -> anyhow::Result<usize> {
    let options = options_for(1)?;
    let effort = match options.effort {
        // Shorter trainings do not find the best number.
        Effort::Brief | Effort::Quick => {
            bail!("--samples auto compares quick trainings: give --effort standard or long")
        }
        Effort::Standard | Effort::Long => Effort::Quick,
    };
    let scan = options.completion_options.scan;
    let scan = scan.context("--samples auto needs the time of a scan: give --scan-seconds")?;
    let candidates = candidates(&scan);
    if candidates.is_empty() {
        bail!(
            "a scan of 1 sample takes {} s without motion, which leaves too little of {} s: give more --scan-seconds",
            scan.settle,
            scan.seconds
        );
    }
    let mut estimates: Vec<(usize, LossEstimate)> = Vec::new();
    for samples in candidates {
        let (materials, source_shares) = load_all(sources)?;
        let options = Options {
            effort,
            source_shares,
            ..options_for(samples)?
        };
        match train_with_progress(&options, materials) {
            Ok(learned) => {
                let estimate = learned.expected_loss.map(|each| each.estimate);
                estimates.extend(estimate.map(|estimate| (samples, estimate)));
            }
            Err(error) if is_too_fast(&error) => eprintln!("n = {samples}: {error}"),
            Err(error) => {
                return Err(error.context(format!("a quick training with {samples} samples")));
            }
        }
    }
    let table = table(&estimates, &scan);
    eprint!("{}\n{}", table.caption, table.to_text());
    let best = estimates
        .iter()
        .min_by(|(_, one), (_, other)| one.loss.total_cmp(&other.loss));
    let (samples, _) =
        best.context("no number of samples was fast enough: give more --scan-seconds")?;
    eprintln!("{samples} samples have the smallest expected loss");
    Ok(*samples)
}

/// Returns true if no pattern of a training was within the time of a scan.
fn is_too_fast(error: &anyhow::Error) -> bool {
    matches!(
        error.downcast_ref(),
        Some(TrainError::ScanBudget(ScanBudgetError::TooFast { .. }))
    )
}

fn table(estimates: &[(usize, LossEstimate)], scan: &ScanBudget) -> Table {
    let seconds = scan.seconds;
    let columns = [
        Column::plain("n", 0),
        Column::plain("seconds of motion", 1),
        Column::loss("expected loss"),
        Column::plain("standard error", 4),
    ];
    let row = |(samples, estimate): &(usize, LossEstimate)| {
        vec![
            (*samples).into(),
            (seconds - scan.settle * *samples as f64).into(),
            f64::from(estimate.loss).into(),
            estimate.standard_error.map(f64::from).into(),
        ]
    };
    let caption = format!("Expected loss of scans of {seconds} s, by quick trainings");
    Table::new(caption, columns, estimates.iter().map(row))
}

#[cfg(test)]
mod tests {
    use glimpse_training::route::Machine;

    use super::*;

    #[test]
    fn candidates_leave_time_for_motion() {
        let scan = |seconds, settle| ScanBudget {
            seconds,
            speeds: Machine::default().speeds,
            settle,
        };
        assert_eq!(candidates(&scan(12.0, 0.5)), [4, 6, 8, 12, 16]);
        assert_eq!(candidates(&scan(3.0, 0.5)), [1, 2, 3, 4]);
        assert_eq!(candidates(&scan(10.0, 0.0)), [16, 24, 32, 48, 64]);
        assert!(candidates(&scan(1.0, 0.9)).is_empty());
    }
}
