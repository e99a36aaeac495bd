//! `trainer bench`

use anyhow::ensure;
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_kernels::lanes::InstructionSet;
use glimpse_trainer::benchmark::{Item, Peak, Threads, Timing, Workload, materials, measure, peak};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::{model, numbers, print};

/// Time the computations of meta-learning, and compare them with this machine's peak.
///
/// Each line times the outer step of one task: the inner loop of 20 steps, its loss, and the exact
/// gradient of the loss with respect to all learned parameters, with data in memory. "A training
/// step" is a whole step of `train` (random draws, measurements, a batch of tasks, Adam), divided by
/// the number of tasks. For the model neural, the last lines time the two sums over samples that
/// take most of the time.
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
    #[arg(long, value_parser = model())]
    model: Option<ModelKind>,
    /// Duration of each line in seconds, 0.001 to 3600
    #[arg(long, default_value_t = 1.0, value_parser = numbers::number(0.001..=3_600.0))]
    seconds: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Peaks of an instruction set: on one thread, and on all.
type Peaks = [Peak; 2];

impl Bench {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        ensure!(
            !matches!(self.model, Some(ModelKind::Linear)),
            "--model linear has no inner loop to time: give another model"
        );
        // On a thread of the pool, like training.
        let (peaks, lines) = rayon::scope(|_| self.measure());
        match self.json {
            true => print(&(serde_json::to_string_pretty(&to_json(&peaks, &lines))? + "\n")),
            false => print(&to_text(&peaks, &lines)),
        }
    }

    fn measure(&self) -> (Vec<Peaks>, Vec<Line>) {
        let materials = materials();
        let workload = Workload::new(&materials);
        let mut items = workload.items(self.model.map(ModelKind::from));
        let sets = instruction_sets();
        let progress = MeasurementProgress::new(2 * sets.len() + items.len());
        let mut peaks = Vec::new();
        for set in sets {
            peaks.push([Threads::One, Threads::All].map(|threads| {
                progress.begin(&format!("peak of {}", set.name()));
                peak(set, threads, 0.5 * self.seconds)
            }));
        }
        let mut lines = Vec::new();
        for item in &mut items {
            progress.begin(&item.name());
            let timing = measure(item, self.seconds);
            lines.push(Line::new(item, timing, &peaks));
        }
        (peaks, lines)
    }
}

/// Returns the instruction set in use, and AVX2 too if that is AVX-512.
fn instruction_sets() -> Vec<InstructionSet> {
    match InstructionSet::detect() {
        InstructionSet::Avx512 => vec![InstructionSet::Avx512, InstructionSet::Avx2],
        other => vec![other],
    }
}

/// A line of the table.
struct Line {
    model: ModelKind,
    name: String,
    threads: usize,
    timing: Timing,
    /// Share of each instruction set's peak on as many threads.
    shares: Option<Vec<f64>>,
}

impl Line {
    fn new(item: &Item<'_>, timing: Timing, peaks: &[Peaks]) -> Self {
        let share = |gflops: f64| {
            let of = |[one, all]: &Peaks| match item.threads {
                Threads::One => gflops / one.gflops,
                Threads::All => gflops / all.gflops,
            };
            peaks.iter().map(of).collect()
        };
        Self {
            model: item.model,
            name: item.name(),
            threads: item.threads.count(),
            timing,
            shares: timing.gflops.map(share),
        }
    }
}

fn to_text(peaks: &[Peaks], lines: &[Line]) -> String {
    let mut text = String::new();
    for [one, all] in peaks {
        let name = one.instruction_set.name();
        text += &format!("peak of {name}: {:.1} GFLOP/s on 1 thread", one.gflops);
        text += &match all.threads {
            1 => "\n".to_owned(),
            threads => format!(", {:.1} on {threads}\n", all.gflops),
        };
    }
    let width = lines.iter().map(|line| line.name.len()).max().unwrap_or(0);
    text += &format!(
        "\n{:width$} {:>7} {:>10} {:>19} {:>8}",
        "", "threads", "median ms", "10 % .. 90 %", "GFLOP/s"
    );
    for [one, _] in peaks {
        text += &format!("  of {}", one.instruction_set.name());
    }
    for line in lines {
        let timing = &line.timing;
        let range = format!("{:.4} .. {:.4}", timing.fast, timing.slow);
        text += &format!(
            "\n{:width$} {:7} {:10.4} {range:>19}",
            line.name, line.threads, timing.median
        );
        let (Some(gflops), Some(shares)) = (timing.gflops, &line.shares) else {
            continue;
        };
        text += &format!(" {gflops:8.1}");
        for (share, [one, _]) in shares.iter().zip(peaks) {
            let width = one.instruction_set.name().len() + 3;
            text += &format!("  {:>width$}", format!("{:.0} %", 100.0 * share));
        }
    }
    text += "\n\n\
        Times depend on the clock frequency and on other processes; their ratios vary much less.\n\
        To compare with another program, run both alternately and compare medians:\n    \
        for i in 1 2 3; do trainer bench --model neural; OTHER; done\n";
    text
}

fn to_json(peaks: &[Peaks], lines: &[Line]) -> Value {
    let peak = |peak: &Peak| {
        json!({
            "lanes": peak.instruction_set.name(),
            "threads": peak.threads,
            "gflops": peak.gflops,
        })
    };
    let line = |line: &Line| {
        let shares = line.shares.iter().flatten().zip(peaks);
        let shares = shares.map(|(share, [one, _])| {
            let name = one.instruction_set.name();
            (name.to_owned(), json!(share))
        });
        json!({
            "name": line.name,
            "model": line.model.name(),
            "threads": line.threads,
            "median_ms": line.timing.median,
            "fast_ms": line.timing.fast,
            "slow_ms": line.timing.slow,
            "runs": line.timing.runs,
            "gflops": line.timing.gflops,
            "share_of_peak": shares.collect::<serde_json::Map<_, _>>(),
        })
    };
    json!({
        "peaks": peaks.iter().flatten().map(peak).collect::<Vec<_>>(),
        "items": lines.iter().map(line).collect::<Vec<_>>(),
    })
}

/// Displays the current measurement: in a progress bar on a terminal, or else line by line.
struct MeasurementProgress(ProgressBar);

impl MeasurementProgress {
    fn new(steps: usize) -> Self {
        let bar = ProgressBar::new(steps as u64);
        if let Ok(style) = ProgressStyle::with_template("{wide_bar:.cyan/dim} {pos}/{len} {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    fn begin(&self, name: &str) {
        if self.0.is_hidden() {
            eprintln!("{name}");
        }
        self.0.inc(1);
        self.0.set_message(name.to_owned());
    }
}

impl Drop for MeasurementProgress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
