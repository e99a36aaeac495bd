//! `trainer bench`

use anyhow::ensure;
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::options::model_parser;
use glimpse_kernels::ModelKernels;
use glimpse_kernels::lanes::InstructionSet;
use glimpse_kernels::peak::peak;
use serde::Serialize;

use super::{emit, numbers};
use crate::benchmark::works;
use crate::progress::StepProgress;
use crate::report::Table;

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
#[derive(Default, Serialize)]
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
        let table = Table::of_records("benchmarks", &lines)?;
        emit(self.json, &lines, || table.to_markdown())
    }

    fn measure(&self) -> Vec<Line> {
        let models = [ModelKind::Neural, ModelKind::Phong, ModelKind::CookTorrance];
        let is_timed = |model: &ModelKind| self.model.is_none_or(|only| only == *model);
        let kernels = models
            .into_iter()
            .filter(is_timed)
            .filter_map(ModelKernels::of);
        let works =
            kernels.flat_map(|kernels| works().into_iter().map(move |work| (kernels, work)));
        let works: Vec<_> = works.collect();
        let progress = StepProgress::new("timing", 2 + works.len());
        let threads = [1, rayon::current_num_threads()];
        let peaks = [false, true].map(|is_parallel| {
            let gflops = peak(is_parallel, 0.5 * self.seconds);
            progress.increment();
            gflops
        });
        let lines_of_peaks = threads.into_iter().zip(peaks);
        let lines_of_peaks = lines_of_peaks.map(|(threads, gflops)| Line {
            name: format!("peak of {}", InstructionSet::detect().name()),
            threads,
            gflops: Some(gflops),
            ..Line::default()
        });
        let lines = works.into_iter().map(|(kernels, work)| {
            let seconds = work.measure(kernels, self.seconds);
            progress.increment();
            let count = work.multiply_accumulates(kernels.model);
            let gflops = count.map(|count| 2e-9 * count as f64 / seconds);
            Line {
                name: format!("{}: {}", kernels.model, work.name),
                threads: threads[usize::from(work.is_parallel)],
                median_ms: Some(1e3 * seconds),
                gflops,
                share_of_peak: gflops.map(|gflops| gflops / peaks[usize::from(work.is_parallel)]),
            }
        });
        lines_of_peaks.chain(lines).collect()
    }
}
