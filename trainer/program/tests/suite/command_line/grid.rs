//! `trainer train --grid`

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use super::Folder;
use crate::common::assert_names;

const GRID: &str =
    "train --grid --model phong --samples 1,2 --data procedural:5 --effort brief --out grid";

#[test]
fn killed_grid_resumes() {
    let folder = Folder::new();
    let mut killed = folder.start(GRID);
    while !folder.exists("grid/grid.csv") {
        assert!(
            killed.try_wait().expect("the process runs").is_none(),
            "the process ended early"
        );
        sleep(Duration::from_millis(1));
    }
    killed.kill().expect("the process is killed");
    killed.wait().expect("the process ends");
    let first_recipe = || {
        let file = fs::metadata(folder.at("grid/phong-n1.recipe"));
        let trained_at = file.and_then(|file| file.modified());
        (
            folder.read("grid/phong-n1.recipe"),
            trained_at.expect("the file exists"),
        )
    };
    let before = first_recipe();
    assert!(!folder.exists("grid/phong-n2.recipe"));

    let [table, messages] = folder.succeed_with_messages(GRID);
    assert_names(&messages, &["phong-n1.recipe"]);
    assert_eq!(first_recipe(), before);
    let names = folder.names("grid");
    assert_eq!(names.len(), 3, "two recipes and grid.csv: {names:?}");

    let csv = folder.read_text("grid/grid.csv");
    for (lines, separator) in [(table.lines(), ' '), (csv.lines(), ',')] {
        let rows: Vec<Vec<&str>> = lines
            .map(|line| {
                let cells = line.split(separator);
                cells.filter(|cell| !cell.is_empty()).collect()
            })
            .collect();
        assert_eq!(rows.len(), 3, "{table}{csv}");
        for (row, samples) in rows[1..].iter().zip(["1", "2"]) {
            assert_eq!((row[0], row[1]), ("phong", samples), "{table}{csv}");
            // The expected loss, also for cells of the killed grid.
            assert!(row[2].parse::<f64>().expect("a number") > 0.0);
        }
    }
}

#[test]
fn failed_cell_does_not_stop_others() {
    let folder = Folder::new();
    let grid = format!("{GRID} --schedule paper");
    folder.succeed(&grid.replace("1,2", "2"));
    let trained = folder.read("grid/phong-n2.recipe");
    folder.write("grid/phong-n1.recipe", "not a recipe");

    let output = folder.run(&format!("{} --seed 1", grid.replace("1,2", "1,2,4")));
    let messages = String::from_utf8(output.stderr).expect("UTF-8 text");
    assert_eq!(output.status.code(), Some(1), "{messages}");
    // Two of three cells fail.
    assert_names(&messages, &["phong-n1.recipe", "phong-n2.recipe", "2", "3"]);
    let table = String::from_utf8(output.stdout).expect("UTF-8 text");
    assert_eq!(table.lines().count(), 4, "{table}");
    assert!(folder.exists("grid/phong-n4.recipe"));
    assert_eq!(folder.read("grid/phong-n2.recipe"), trained);
}
