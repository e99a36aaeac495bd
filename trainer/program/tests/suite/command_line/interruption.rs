//! Interrupted and resumed training, other numbers of threads, and unwritable checkpoints.

use std::fs;
use std::ops::ControlFlow;
use std::thread::sleep;
use std::time::Instant;

use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::options::{Effort, Schedule, TrainingOptions};
use glimpse_materials::Source;
use glimpse_training::checkpoint::CheckpointError;
use glimpse_training::outer::Checkpoints;
use glimpse_training::run::{TrainError, TrainedRecipe, train};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Folder;
use crate::common::assert_names;

/// A small run.
const PAPER: &str = "train --model phong --samples 3 --data procedural:5 --effort brief \
                     --schedule paper --out phong.recipe";

/// A run is killed at random moments and resumed, in all phases and folds. Every recipe equals that of an uninterrupted
/// run.
#[test]
fn killed_runs_resume() {
    const KILLS: usize = 8;
    let command = "train --model phong --samples 3 --data procedural:10:3 --effort brief --missing 0.5 --noise 0.02 \
                   --scan-seconds 8 --seed 3 --out phong.recipe";
    let folder = Folder::new();
    let begin = Instant::now();
    folder.succeed(command);
    let duration = begin.elapsed();
    let expected = folder.read("phong.recipe");

    let resume = format!("{command} --resume");
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut killed = 0;
    while killed < KILLS {
        let folder = Folder::new();
        loop {
            let mut run = folder.start(&resume);
            sleep(duration.mul_f64(random.random()));
            // This fails if the process has ended already.
            let _ = run.kill();
            let status = run.wait().expect("the process ends");
            if status.success() {
                break;
            }
            let messages = folder.read_text("stderr");
            assert_eq!(
                status.code(),
                None,
                "the process was not ended by the kill: {messages}"
            );
            killed += 1;
        }
        assert_eq!(folder.read("phong.recipe"), expected);
        assert_eq!(
            folder.names(""),
            ["phong.recipe", "stderr"],
            "other files remain"
        );
    }
}

#[test]
fn resume_without_checkpoint() {
    let folder = Folder::new();
    // The files of a run that was killed during its first checkpoint.
    let checkpoint = folder.at("phong.recipe.checkpoint");
    fs::create_dir(&checkpoint).expect("the folder is created");
    fs::write(checkpoint.join(".unfinished-checkpoint.bin-aBc123"), "half")
        .expect("the file is written");
    let resume = format!("{PAPER} --resume");
    let [_, messages] = folder.succeed_with_messages(&resume);
    assert_names(&messages, &["phong.recipe.checkpoint"]);
    assert_eq!(folder.names(""), ["phong.recipe"]);
    let first = folder.read("phong.recipe");

    // The files of a run that was killed after it removed the checkpoint, but not its directory.
    fs::create_dir(&checkpoint).expect("the folder is created");
    let written_at = || {
        let metadata = fs::metadata(folder.at("phong.recipe"));
        metadata
            .and_then(|file| file.modified())
            .expect("the file exists")
    };
    let before = written_at();
    folder.succeed(&resume);
    assert_eq!(folder.names(""), ["phong.recipe"]);
    assert_eq!(
        (folder.read("phong.recipe"), written_at()),
        (first.clone(), before)
    );

    // The recipe of another run is replaced only with --force.
    let other = format!("{resume} --seed 1");
    folder.fail_naming(&other, &["phong.recipe", "--force"]);
    assert_eq!(folder.read("phong.recipe"), first);
    folder.succeed(&format!("{other} --force"));
    assert_ne!(folder.read("phong.recipe"), first);
}

/// Trains a recipe.
fn train_on(
    checkpoints: Option<&Checkpoints>,
    at_each_step: &mut (dyn FnMut(usize) -> ControlFlow<()> + Send),
) -> Result<TrainedRecipe, TrainError> {
    let materials = Source("procedural:5".into()).load().expect("materials");
    let options = TrainingOptions::new(ModelKind::Phong, 3, Schedule::Paper, Effort::Quick, 3);
    train(
        &options,
        "procedural:5",
        materials,
        checkpoints,
        &mut |progress| at_each_step(progress.done),
    )
}

/// A checkpoint that cannot be written is an error, and the previous checkpoint remains valid.
#[test]
fn failed_checkpoint_keeps_previous_one() {
    let folder = Folder::new();
    let [directory, away] = ["checkpoint", "away"].map(|name| folder.at(name));
    let proceed = &mut |_| ControlFlow::Continue(());
    let whole = train_on(None, proceed).expect("the recipe is trained");
    let checkpoints = Checkpoints {
        directory: directory.clone(),
        resume: true,
    };
    let outcome = train_on(Some(&checkpoints), &mut |done| {
        if done == 510 {
            fs::rename(&directory, &away).expect("the file is renamed");
            fs::write(&directory, "in the way").expect("the file is written");
        }
        ControlFlow::Continue(())
    });
    assert!(
        matches!(
            &outcome,
            Err(TrainError::Checkpoint(CheckpointError::Write { path, .. }))
                if path.ends_with("checkpoint.bin")
        ),
        "{outcome:?}"
    );
    fs::remove_file(&directory).expect("the file is removed");
    fs::rename(&away, &directory).expect("the file is renamed");
    let mut first_step = None;
    let outcome = train_on(Some(&checkpoints), &mut |done| {
        first_step.get_or_insert(done);
        ControlFlow::Continue(())
    });
    let resumed = outcome.expect("the recipe is trained");
    assert_eq!(resumed.file.bytes(), whole.file.bytes());
    // The first step is always saved.
    assert!(
        first_step.is_some_and(|step| (2..=510).contains(&step)),
        "{first_step:?}"
    );
}
