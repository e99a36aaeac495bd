//! `trainer bench`

use anyhow::ensure;
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_kernels::lanes::InstructionSet;
use glimpse_trainer::benchmark::{Ground, Item, Peak, Threads, Timing, materials, measure, peak};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::{ModelName, numbers, print};

/// Time the work of meta-learning, and hold it against what this machine can do.
///
/// Each line is an outer step of one task: the inner loop of 20 steps, the loss it leads to, and
/// the exact gradient of that by all that is learned. Data are ready in memory. "A training step"
/// is what `train` repeats, all included (draws, measurements, a batch of tasks, Adam),
/// divided by its tasks. The last lines of neural are the two sums over samples that the time
/// goes into.
///
/// GFLOP/s count two for each multiply-accumulate of the network's matrix products, and nothing
/// else, so they understate the work; for the small models none are claimed. The peaks are
/// measured in the same run: independent multiply-adds in registers, the fastest of many bursts,
/// on as many threads as the line has.
///
/// Example: trainer bench
///          trainer bench --model neural --seconds 5 --threads 1
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Bench {
    /// Only this model
    #[arg(long, value_enum)]
    model: Option<ModelName>,
    /// Seconds for each line, 0.001 to 3600
    #[arg(long, default_value_t = 1.0, value_parser = numbers::number(0.001..=3_600.0))]
    seconds: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Peaks of one kind of lanes: of one thread, and of all.
type Peaks = [Peak; 2];

impl Bench {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        ensure!(
            !matches!(self.model, Some(ModelName::Linear)),
            "--model linear has no inner loop to be timed: give another model"
        );
        // On a thread of the pool, as training is.
        let (peaks, lines) = rayon::scope(|_| self.measure());
        match self.json {
            true => print(&(serde_json::to_string_pretty(&to_json(&peaks, &lines))? + "\n")),
            false => print(&to_text(&peaks, &lines)),
        }
    }

    fn measure(&self) -> (Vec<Peaks>, Vec<Line>) {
        let materials = materials();
        let ground = Ground::new(&materials);
        let mut items = ground.items(self.model.map(ModelKind::from));
        let sets = instruction_sets();
        let progress = Bar::new(2 * sets.len() + items.len());
        let mut peaks = Vec::new();
        for set in sets {
            peaks.push([Threads::One, Threads::All].map(|threads| {
                progress.now(&format!("peak of {}", set.name()));
                peak(set, threads, 0.5 * self.seconds)
            }));
        }
        let mut lines = Vec::new();
        for item in &mut items {
            progress.now(&item.name());
            let timing = measure(item, self.seconds);
            lines.push(Line::new(item, timing, &peaks));
        }
        (peaks, lines)
    }
}

/// The lanes in use, and AVX2 where they are wider.
fn instruction_sets() -> Vec<InstructionSet> {
    match InstructionSet::of_this_machine() {
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
    /// Of each kind of lanes' peak on as many threads.
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
        Times move with the clock and with what else the machine does; ratios do much less.\n\
        To compare with a rival run both in turn, in the same minutes, and compare medians:\n    \
        for i in 1 2 3; do trainer bench --model neural; RIVAL; done\n";
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

/// Says what is being measured: in a bar on a terminal, line by line elsewhere.
struct Bar(ProgressBar);

impl Bar {
    fn new(steps: usize) -> Self {
        let bar = ProgressBar::new(steps as u64);
        if let Ok(style) = ProgressStyle::with_template("{wide_bar:.cyan/dim} {pos}/{len} {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    fn now(&self, what: &str) {
        if self.0.is_hidden() {
            eprintln!("{what}");
        }
        self.0.inc(1);
        self.0.set_message(what.to_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
