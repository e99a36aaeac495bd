//! The items of `trainer bench`, watched for regressions.
//!
//! `cargo bench -p glimpse-trainer` takes about a minute; `-- neural` runs the items with that in
//! their names; `-- --save-baseline NAME` and `-- --baseline NAME` compare two versions.

use std::time::Duration;

use criterion::Criterion;
use glimpse_trainer::benchmark::{Ground, materials};

fn main() {
    // On a thread of the pool, as training is.
    rayon::scope(|_| {
        let mut criterion = Criterion::default()
            .sample_size(20)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(2))
            .configure_from_args();
        let materials = materials();
        let ground = Ground::new(&materials);
        for mut item in ground.items(None) {
            criterion.bench_function(&item.name(), |bencher| bencher.iter(|| item.run()));
        }
        criterion.final_summary();
    });
}
