//! Long work survives: kills, other numbers of threads, places that cannot be written.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::common::assert_names;
use super::{fail_naming, succeed, trainer};

/// A small run of either schedule, saved so often that kills hit writes too.
const JOINT: [&str; 15] = train(["3", "brief", "joint"], "0.01");
const PAPER: [&str; 15] = train(["3", "brief", "paper"], "0.001");
/// What nobody waits for.
const HOURS: [&str; 15] = train(["512", "long", "joint"], "0.01");

const fn train<'a>([samples, effort, schedule]: [&'a str; 3], every: &'a str) -> [&'a str; 15] {
    [
        "train",
        "--model",
        "phong",
        "--samples",
        samples,
        "--data",
        "procedural:5",
        "--effort",
        effort,
        "--schedule",
        schedule,
        "--checkpoint-every",
        every,
        "--out",
        "phong.recipe",
    ]
}

pub(super) fn start(directory: &Path, arguments: &[&str]) -> Child {
    let talk = File::create(directory.join("talk")).expect("a file");
    Command::new(env!("CARGO_BIN_EXE_trainer"))
        .args(arguments)
        .current_dir(directory)
        .stdout(Stdio::null())
        .stderr(talk)
        .spawn()
        .expect("the trainer runs")
}

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).expect("it can be listed");
    let mut names: Vec<_> = entries
        .map(|entry| {
            let name = entry.expect("an entry").file_name();
            name.into_string().expect("it is text")
        })
        .collect();
    names.sort();
    names
}

fn recipe(directory: &Path) -> Vec<u8> {
    fs::read(directory.join("phong.recipe")).expect("the recipe is there")
}

/// Kills the run `kills` times, each at a random moment; it always comes to the same bytes.
fn killed_runs_end_like_undisturbed_ones(arguments: &[&str], kills: usize, seed: u64) {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let begin = Instant::now();
    succeed(directory, arguments);
    let undisturbed = begin.elapsed();
    let expected = recipe(directory);

    let mut resume = arguments.to_vec();
    resume.push("--resume");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut killed, mut in_writing) = (0, 0);
    while killed < kills {
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let directory = scratch.path();
        loop {
            let mut run = start(directory, &resume);
            sleep(undisturbed.mul_f64(random.random()));
            // An error says that it has ended already.
            let _ = run.kill();
            let status = run.wait().expect("it ends");
            if status.success() {
                break;
            }
            let talk = fs::read_to_string(directory.join("talk")).expect("it is text");
            assert_eq!(
                status.code(),
                None,
                "it was not the kill that ended it: {talk}"
            );
            killed += 1;
            let saved = directory.join("phong.recipe.checkpoint");
            let half = |name: &String| name.starts_with(".unfinished-");
            if saved.exists() && names(&saved).iter().any(half) {
                in_writing += 1;
            }
        }
        assert_eq!(recipe(directory), expected);
        assert_eq!(names(directory), ["phong.recipe", "talk"], "left-overs");
    }
    eprintln!("{killed} kills, {in_writing} of them while a checkpoint was written");
}

#[test]
fn a_killed_joint_run_goes_on_to_the_same_recipe() {
    killed_runs_end_like_undisturbed_ones(&JOINT, 10, 1);
}

#[test]
fn a_killed_paper_run_goes_on_to_the_same_recipe() {
    killed_runs_end_like_undisturbed_ones(&PAPER, 40, 2);
}

#[test]
fn resuming_says_where_it_stands() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let run = |more: &[&str]| {
        let output = trainer(directory, &[&JOINT, more].concat());
        let talk = String::from_utf8(output.stderr).expect("it is text");
        assert!(output.status.success(), "{talk}");
        talk
    };
    // What a run left that was killed before its first checkpoint was whole.
    let saved = directory.join("phong.recipe.checkpoint");
    fs::create_dir(&saved).expect("it is made");
    fs::write(saved.join(".unfinished-checkpoint.bin-aBc123"), "half").expect("it is written");
    let talk = run(&["--resume"]);
    assert_names(&talk, &["phong.recipe.checkpoint"]);
    assert_eq!(names(directory), ["phong.recipe"]);
    let first = recipe(directory);

    // Killed when the recipe was there and the checkpoint was gone, but not its directory.
    fs::create_dir(&saved).expect("it is made");
    let written_at = || {
        let metadata = fs::metadata(directory.join("phong.recipe"));
        metadata
            .and_then(|file| file.modified())
            .expect("it is there")
    };
    let before = written_at();
    run(&["--resume"]);
    assert_eq!(names(directory), ["phong.recipe"]);
    assert_eq!((recipe(directory), written_at()), (first.clone(), before));

    // The recipe of another run is not this one's, and stays until it is told to go.
    let other = [&JOINT[..], &["--resume", "--seed", "1"]].concat();
    fail_naming(directory, &other, &["phong.recipe", "--force"]);
    assert_eq!(recipe(directory), first);
    run(&["--resume", "--seed", "1", "--force"]);
    assert_ne!(recipe(directory), first);
}

#[test]
fn the_same_recipe_comes_of_any_number_of_threads() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    for arguments in [JOINT, PAPER] {
        let recipes = ["1", "2", "7"].map(|threads| {
            succeed(
                scratch.path(),
                &[&arguments[..], &["--threads", threads, "--force"]].concat(),
            );
            recipe(scratch.path())
        });
        assert!(recipes.iter().all(|bytes| *bytes == recipes[0]));
    }
}

#[test]
fn places_that_cannot_be_written_are_named_before_hours_are_spent() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::create_dir(directory.join("directory")).expect("it is made");
    fs::write(directory.join("file"), "text").expect("it is written");
    for (option, place) in [
        ("--out", "directory"),
        ("--out", "file/phong.recipe"),
        ("--checkpoint", "file"),
        ("--checkpoint", "file/checkpoint"),
    ] {
        let mut arguments = HOURS.to_vec();
        arguments.truncate(13);
        if option != "--out" {
            arguments.extend(["--out", "phong.recipe"]);
        }
        arguments.extend([option, place]);
        let begin = Instant::now();
        fail_naming(directory, &arguments, &[place]);
        let seconds = begin.elapsed().as_secs_f64();
        assert!(seconds < 60.0, "it was trained first: {seconds}");
        assert_eq!(names(directory), ["directory", "file"]);
    }
}

/// Files may have so many blocks of 512 bytes only, as on a disk that is nearly full.
#[cfg(unix)]
#[test]
fn a_full_disk_is_named_before_hours_are_spent() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let mut arguments = HOURS;
    arguments[2] = "neural";
    // The recipe, and a checkpoint, which is larger.
    for (blocks, place) in [("64", "phong.recipe"), ("160", "checkpoint.bin")] {
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let begin = Instant::now();
        let output = Command::new("sh")
            .args(["-c", &limited, env!("CARGO_BIN_EXE_trainer")])
            .args(arguments)
            .current_dir(scratch.path())
            .output()
            .expect("the shell runs");
        let seconds = begin.elapsed().as_secs_f64();
        assert!(seconds < 60.0, "it was trained first: {seconds}");
        let message = String::from_utf8(output.stderr).expect("it is text");
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert_names(&message, &[place]);
        assert!(!scratch.path().join("phong.recipe").exists());
    }
}

/// A checkpoint that cannot be written any more is an error, and the one before stays whole.
#[test]
fn a_disk_that_goes_away_costs_only_what_was_not_saved() {
    use std::ops::ControlFlow;

    use glimpse_core::model::ModelKind;
    use glimpse_materials::Source;
    use glimpse_training::meta::checkpoint::CheckpointError;
    use glimpse_training::meta::options::Options;
    use glimpse_training::meta::outer::Checkpoints;
    use glimpse_training::meta::plan::{Effort, Schedule};
    use glimpse_training::meta::run::{TrainError, train};

    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path().join("checkpoint");
    let away = scratch.path().join("away");
    let materials = || Source("procedural:5".into()).load().expect("materials");
    let mut options = Options::new(ModelKind::Phong, 3, Schedule::Paper, Effort::Quick, 3);
    let go_on = &mut |_: &_| ControlFlow::Continue(());
    let whole = train(&options, materials(), go_on).expect("it is trained");
    options.checkpoints = Some(Checkpoints {
        directory: directory.clone(),
        every: Duration::ZERO,
        resume: true,
    });
    let outcome = train(&options, materials(), &mut |progress| {
        if progress.done == 770 {
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
    let outcome = train(&options, materials(), &mut |progress| {
        first.get_or_insert(progress.done);
        ControlFlow::Continue(())
    });
    assert_eq!(outcome.expect("it is trained"), whole);
    assert_eq!(first, Some(770));
}
