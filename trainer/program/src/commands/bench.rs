//! `trainer bench`

use anyhow::ensure;
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::options::model_parser;
use glimpse_kernels::lanes::InstructionSet;
use serde::Serialize;

use super::progress::StepProgress;
use super::{emit, numbers};
use crate::benchmark::{Workload, peak};
use crate::report::{Column, Table};

/// Time the computations of meta-learning, and compare them with this machine's peak.
///
/// Each line times the outer step of one task: the inner loop of 20 steps, its loss, and the exact
/// gradient of the loss with respect to all learned parameters, with data in memory.
///
/// GFLOP/s count two operations for each multiply-accumulate of the network's matrix products. Other
/// operations are not counted, so the numbers understate the work. The models without a network have
/// no GFLOP/s. The peaks are measured in the same run, on the same number of threads: independent
/// multiply-adds in registers, the fastest of many bursts.
///
/// Example: trainer bench
///          trainer bench --model neural --seconds 5 --threads 1
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Bench {
    /// Model to time [default: all except linear]
    #[arg(long, value_parser = model_parser())]
    model: Option<ModelKind>,
    /// Duration of each line in seconds, 0.001 to 3600
    #[arg(long, default_value_t = 1.0, value_parser = numbers::number(0.001..=3_600.0))]
    seconds: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A line of the table.
#[derive(Serialize)]
struct Line {
    name: String,
    threads: usize,
    /// Median time of a run in milliseconds; None for a peak.
    median_ms: Option<f64>,
    gflops: Option<f64>,
    share_of_peak: Option<f64>,
}

impl Bench {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        ensure!(
            self.model != Some(ModelKind::Linear),
            "--model linear has no inner loop to time: give another model"
        );
        // On a thread of the pool, like training.
        let lines = rayon::scope(|_| self.measure());
        emit(self.json, &lines, || table(&lines).to_markdown())
    }

    fn measure(&self) -> Vec<Line> {
        let workload = Workload::default();
        let mut items = workload.items(self.model);
        let progress = StepProgress::new("timing", 2 + items.len());
        let threads = |is_parallel| match is_parallel {
            true => rayon::current_num_threads(),
            false => 1,
        };
        let peaks = [false, true].map(|is_parallel| {
            let gflops = peak(is_parallel, 0.5 * self.seconds);
            progress.increment();
            gflops
        });
        let mut lines = Vec::new();
        for is_parallel in [false, true] {
            lines.push(Line {
                name: format!("peak of {}", InstructionSet::detect().name()),
                threads: threads(is_parallel),
                median_ms: None,
                gflops: Some(peaks[usize::from(is_parallel)]),
                share_of_peak: None,
            });
        }
        for item in &mut items {
            let seconds = item.measure(self.seconds);
            progress.increment();
            let count = item.multiply_accumulates;
            let gflops = count.map(|count| 2e-9 * count as f64 / seconds);
            lines.push(Line {
                name: format!("{}: {}", item.model, item.work),
                threads: threads(item.is_parallel),
                median_ms: Some(1e3 * seconds),
                gflops,
                share_of_peak: gflops.map(|gflops| gflops / peaks[usize::from(item.is_parallel)]),
            });
        }
        lines
    }
}

fn table(lines: &[Line]) -> Table {
    let columns = [
        Column::text(""),
        Column::plain("threads", 0),
        Column::plain("median ms", 4),
        Column::plain("GFLOP/s", 1),
        Column::plain("% of peak", 0),
    ];
    let row = |line: &Line| {
        vec![
            line.name[..].into(),
            line.threads.into(),
            line.median_ms.into(),
            line.gflops.into(),
            line.share_of_peak.map(|share| 100.0 * share).into(),
        ]
    };
    Table::new("", columns, lines.iter().map(row))
}
