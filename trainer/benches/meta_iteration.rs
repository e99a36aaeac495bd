//! Regression benchmarks of the items of `trainer bench`.
//!
//! `cargo bench -p glimpse-trainer` takes about a minute. `-- neural` runs the items with `neural` in their names.
//! `-- --save-baseline NAME` and `-- --baseline NAME` compare two versions.

use std::time::Duration;

use criterion::Criterion;
use glimpse_trainer::benchmark::{Workload, materials};

fn main() {
    // On a thread of the pool, as in training.
    rayon::scope(|_| {
        let mut criterion = Criterion::default()
            .sample_size(20)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(2))
            .configure_from_args();
        let materials = materials();
        let workload = Workload::new(&materials);
        for mut item in workload.items(None) {
            criterion.bench_function(&item.name(), |bencher| bencher.iter(|| item.run()));
        }
        criterion.final_summary();
    });
}
