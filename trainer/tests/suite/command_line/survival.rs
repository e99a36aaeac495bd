//! Long work survives: kills, other numbers of threads, places that cannot be written.

use std::fs;
use std::ops::ControlFlow;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use glimpse_core::model::ModelKind;
use glimpse_materials::Source;
use glimpse_training::meta::checkpoint::CheckpointError;
use glimpse_training::meta::learned::Learned;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::Checkpoints;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::run::{TrainError, train};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Folder;
use crate::common::assert_names;

/// A small run of either schedule, saved so often that kills hit writes too.
const JOINT: &str = "train --model phong --samples 3 --data procedural:5 --effort brief \
                     --schedule joint --checkpoint-every 0.01 --out phong.recipe";
const PAPER: &str = "train --model phong --samples 3 --data procedural:5 --effort brief \
                     --schedule paper --checkpoint-every 0.001 --out phong.recipe";
/// A run that takes hours, without `--out`.
const HOURS: &str = "train --samples 512 --data procedural:5 --effort long --schedule joint \
                     --checkpoint-every 0.01";

/// Kills the run `kills` times, each at a random moment; it always comes to the same bytes.
fn killed_runs_end_like_undisturbed_ones(command: &str, kills: usize, seed: u64) {
    let folder = Folder::new();
    let begin = Instant::now();
    folder.succeed(command);
    let undisturbed = begin.elapsed();
    let expected = folder.read("phong.recipe");

    let resume = format!("{command} --resume");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut killed, mut in_writing) = (0, 0);
    while killed < kills {
        let folder = Folder::new();
        loop {
            let mut run = folder.start(&resume);
            sleep(undisturbed.mul_f64(random.random()));
            // An error says that it has ended already.
            let _ = run.kill();
            let status = run.wait().expect("it ends");
            if status.success() {
                break;
            }
            let talk = folder.read_text("talk");
            assert_eq!(
                status.code(),
                None,
                "it was not the kill that ended it: {talk}"
            );
            killed += 1;
            let saved = "phong.recipe.checkpoint";
            let half = |name: &String| name.starts_with(".unfinished-");
            if folder.exists(saved) && folder.names(saved).iter().any(half) {
                in_writing += 1;
            }
        }
        assert_eq!(folder.read("phong.recipe"), expected);
        assert_eq!(folder.names(""), ["phong.recipe", "talk"], "left-overs");
    }
    eprintln!("{killed} kills, {in_writing} of them while a checkpoint was written");
}

#[test]
fn a_killed_joint_run_goes_on_to_the_same_recipe() {
    killed_runs_end_like_undisturbed_ones(JOINT, 10, 1);
}

#[test]
fn a_killed_paper_run_goes_on_to_the_same_recipe() {
    killed_runs_end_like_undisturbed_ones(PAPER, 40, 2);
}

#[test]
fn resuming_says_where_it_stands() {
    let folder = Folder::new();
    // The remains of a run that was killed while it wrote its first checkpoint.
    let saved = folder.at("phong.recipe.checkpoint");
    fs::create_dir(&saved).expect("it is made");
    fs::write(saved.join(".unfinished-checkpoint.bin-aBc123"), "half").expect("it is written");
    let resume = format!("{JOINT} --resume");
    let [_, talk] = folder.succeed_with_talk(&resume);
    assert_names(&talk, &["phong.recipe.checkpoint"]);
    assert_eq!(folder.names(""), ["phong.recipe"]);
    let first = folder.read("phong.recipe");

    // Killed when the recipe was there and the checkpoint was gone, but not its directory.
    fs::create_dir(&saved).expect("it is made");
    let written_at = || {
        let metadata = fs::metadata(folder.at("phong.recipe"));
        metadata
            .and_then(|file| file.modified())
            .expect("it is there")
    };
    let before = written_at();
    folder.succeed(&resume);
    assert_eq!(folder.names(""), ["phong.recipe"]);
    assert_eq!(
        (folder.read("phong.recipe"), written_at()),
        (first.clone(), before)
    );

    // The recipe of another run is not this one's, and stays until it is told to go.
    let other = format!("{resume} --seed 1");
    folder.fail_naming(&other, &["phong.recipe", "--force"]);
    assert_eq!(folder.read("phong.recipe"), first);
    folder.succeed(&format!("{other} --force"));
    assert_ne!(folder.read("phong.recipe"), first);
}

#[test]
fn the_same_recipe_comes_of_any_number_of_threads() {
    let folder = Folder::new();
    for command in [JOINT, PAPER] {
        let recipes = [1, 2, 7].map(|threads| {
            folder.succeed(&format!("{command} --threads {threads} --force"));
            folder.read("phong.recipe")
        });
        assert!(recipes.iter().all(|bytes| *bytes == recipes[0]));
    }
}

/// Does some work, and asserts that it ends within a minute.
fn in_a_minute<T>(work: impl FnOnce() -> T) -> T {
    let begin = Instant::now();
    let done = work();
    let seconds = begin.elapsed().as_secs_f64();
    assert!(seconds < 60.0, "it was trained first: {seconds}");
    done
}

#[test]
fn places_that_cannot_be_written_are_named_before_hours_are_spent() {
    let folder = Folder::with("file", b"text");
    fs::create_dir(folder.at("directory")).expect("it is made");
    for (options, place) in [
        ("--out directory", "directory"),
        ("--out file/phong.recipe", "file/phong.recipe"),
        ("--out phong.recipe --checkpoint file", "file"),
        (
            "--out phong.recipe --checkpoint file/checkpoint",
            "file/checkpoint",
        ),
    ] {
        let command = format!("{HOURS} --model phong {options}");
        in_a_minute(|| folder.fail_naming(&command, &[place]));
        assert_eq!(folder.names(""), ["directory", "file"]);
    }
}

/// Files may have so many blocks of 512 bytes only, as on a disk that is nearly full.
#[cfg(unix)]
#[test]
fn a_full_disk_is_named_before_hours_are_spent() {
    let folder = Folder::new();
    // The recipe, and a checkpoint, which is larger.
    for (blocks, place) in [("64", "phong.recipe"), ("160", "checkpoint.bin")] {
        let trainer = env!("CARGO_BIN_EXE_trainer");
        let command = format!("{HOURS} --model neural --out phong.recipe");
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" {command}");
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &limited, trainer])
            .current_dir(folder.path());
        let output = in_a_minute(|| shell.output().expect("the shell runs"));
        let message = String::from_utf8(output.stderr).expect("it is text");
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert_names(&message, &[place]);
        assert!(!folder.exists("phong.recipe"));
    }
}

/// Trains on the built-in materials of a source.
fn train_on(
    source: &str,
    options: &Options,
    at_each_step: &mut (dyn FnMut(usize) -> ControlFlow<()> + Send),
) -> Result<Learned, TrainError> {
    let materials = Source(source.into()).load().expect("materials");
    train(options, materials, &mut |progress| {
        at_each_step(progress.done)
    })
}

/// A run that is stopped goes on where its last checkpoint was, to the same numbers.
#[test]
fn a_stopped_run_goes_on_to_the_same_recipe() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let go_on = &mut |_| ControlFlow::Continue(());
    let mut options = Options::new(ModelKind::Phong, 4, Schedule::Joint, Effort::Brief, 3);
    let whole = train_on("procedural:12", &options, go_on).expect("it is trained");
    let mut checkpoints = Checkpoints {
        directory: scratch.path().join("checkpoint"),
        every: Duration::from_secs(10),
        resume: false,
    };
    // In a phase of gradients, at the very end of one, and in two of evolution.
    for stop in [123, 300, 320, 750] {
        options.checkpoints = Some(checkpoints.clone());
        let outcome = train_on("procedural:12", &options, &mut |done| match done == stop {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        });
        assert!(
            matches!(outcome, Err(TrainError::Stopped(done)) if done == stop),
            "{outcome:?}"
        );
        checkpoints.resume = true;
    }
    options.checkpoints = Some(checkpoints);
    let resumed = train_on("procedural:12", &options, go_on).expect("it is trained");
    assert_eq!(resumed, whole);

    options.seed = 4;
    let outcome = train_on("procedural:12", &options, go_on);
    assert!(
        matches!(
            outcome,
            Err(TrainError::Checkpoint(CheckpointError::OtherRun { .. }))
        ),
        "{outcome:?}"
    );
}

/// A checkpoint that cannot be written any more is an error, and the one before stays whole.
#[test]
fn a_disk_that_goes_away_costs_only_what_was_not_saved() {
    let folder = Folder::new();
    let [directory, away] = ["checkpoint", "away"].map(|name| folder.at(name));
    let mut options = Options::new(ModelKind::Phong, 3, Schedule::Paper, Effort::Quick, 3);
    let go_on = &mut |_| ControlFlow::Continue(());
    let whole = train_on("procedural:5", &options, go_on).expect("it is trained");
    options.checkpoints = Some(Checkpoints {
        directory: directory.clone(),
        every: Duration::ZERO,
        resume: true,
    });
    let outcome = train_on("procedural:5", &options, &mut |done| {
        if done == 770 {
            fs::rename(&directory, &away).expect("it is renamed");
            fs::write(&directory, "in the way").expect("it is written");
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
    fs::remove_file(&directory).expect("it is removed");
    fs::rename(&away, &directory).expect("it is renamed");
    let mut first = None;
    let outcome = train_on("procedural:5", &options, &mut |done| {
        first.get_or_insert(done);
        ControlFlow::Continue(())
    });
    assert_eq!(outcome.expect("it is trained"), whole);
    assert_eq!(first, Some(770));
}
