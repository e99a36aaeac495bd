//! `trainer train --grid`

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use super::common::assert_names;
use super::survival::start;
use super::{succeed, trainer};

const GRID: [&str; 12] = [
    "train",
    "--grid",
    "--model",
    "phong",
    "--samples",
    "1,2,4",
    "--data",
    "procedural:5",
    "--effort",
    "brief",
    "--out",
    "grid",
];

#[test]
fn a_killed_grid_goes_on_and_skips_what_is_done() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let grid = directory.join("grid");
    let mut killed = start(directory, &GRID);
    while !grid.join("grid.csv").exists() {
        assert!(killed.try_wait().expect("it runs").is_none(), "it ended");
        sleep(Duration::from_millis(1));
    }
    killed.kill().expect("it is killed");
    killed.wait().expect("it ends");
    let first = grid.join("phong-n1.recipe");
    let trained_at = || {
        fs::metadata(&first)
            .and_then(|file| file.modified())
            .expect("it is there")
    };
    let before = (fs::read(&first).expect("it is there"), trained_at());
    assert!(!grid.join("phong-n4.recipe").exists());

    let output = trainer(directory, &GRID);
    let talk = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{talk}");
    assert_names(&talk, &["phong-n1.recipe"]);
    let after = (fs::read(&first).expect("it is there"), trained_at());
    assert_eq!(after, before);
    let names = fs::read_dir(&grid).expect("it can be listed");
    assert_eq!(names.count(), 4, "three recipes and grid.csv");

    let table = String::from_utf8(output.stdout).expect("it is text");
    let csv = fs::read_to_string(grid.join("grid.csv")).expect("it is text");
    for (lines, separator) in [(table.lines(), ' '), (csv.lines(), ',')] {
        let rows: Vec<Vec<&str>> = lines
            .map(|line| {
                line.split(separator)
                    .filter(|cell| !cell.is_empty())
                    .collect()
            })
            .collect();
        assert_eq!(rows.len(), 4, "{table}{csv}");
        for (row, samples) in rows[1..].iter().zip(["1", "2", "4"]) {
            assert_eq!((row[0], row[1]), ("phong", samples), "{table}{csv}");
            // Expected loss and seconds, those of the killed grid's cells too.
            assert!(row[2].parse::<f64>().expect("a number") > 0.0);
            assert!(row[3].parse::<f64>().is_ok());
        }
    }

    // A cell is what would be trained alone.
    let mut alone = GRID.to_vec();
    alone.remove(1);
    alone[4] = "2";
    alone[10] = "alone.recipe";
    succeed(directory, &alone);
    assert_eq!(
        fs::read(directory.join("alone.recipe")).expect("it is there"),
        fs::read(grid.join("phong-n2.recipe")).expect("it is there")
    );
}

#[test]
fn a_cell_that_fails_is_named_and_stops_no_other() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let mut one = GRID.to_vec();
    one[5] = "2";
    succeed(directory, &one);
    let grid = directory.join("grid");
    let trained = fs::read(grid.join("phong-n2.recipe")).expect("it is there");
    fs::write(grid.join("phong-n1.recipe"), "no recipe").expect("it is written");

    let output = trainer(directory, &[&GRID[..], &["--seed", "1"]].concat());
    let talk = String::from_utf8(output.stderr).expect("it is text");
    assert_eq!(output.status.code(), Some(1), "{talk}");
    // Two of three have failed.
    assert_names(&talk, &["phong-n1.recipe", "phong-n2.recipe", "2", "3"]);
    let table = String::from_utf8(output.stdout).expect("it is text");
    assert_eq!(table.lines().count(), 4, "{table}");
    assert!(grid.join("phong-n4.recipe").exists());
    assert_eq!(
        fs::read(grid.join("phong-n2.recipe")).expect("it is there"),
        trained
    );
}
