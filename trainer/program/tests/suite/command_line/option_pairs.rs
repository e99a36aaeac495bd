//! Each option changes the result of its command, or is refused: alone, and beside each other option.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;

use rayon::prelude::*;

use super::folder::Folder;
use super::shared::files_below;

/// A command with its required arguments, and values for its options.
struct Case {
    base: &'static str,
    options: &'static [&'static [&'static str]],
}

/// Options of readings.
const READINGS: &[&str] = &[
    "--quantity brdf-cos-o",
    "--white white.csv",
    "--dark 0.001",
    "--white-reflectance 0.5",
    "--saturation 0.5",
    "--footprint light",
    "--noise 0.5",
];
/// Options of a machine.
const MACHINE: &[&str] = &[
    "--speed 5",
    "--settle 3",
    "--max-theta-i 12",
    "--max-theta-o 10",
    "--min-separation 110",
    "--in-plane",
];

/// Options without an effect on results: permissions, and those that all commands have.
const PERMISSIONS: [&str; 5] = [
    "--force",
    "--help",
    "--seed",
    "--threads",
    "--accept-implausible",
];
/// Commands without pairs of options that can be compared. `bench` prints times, `virtual-scanner` waits for a device,
/// `quickstart` and `recipes` have one option. An experiment takes minutes. The options of a training are compared
/// by `each_option_changes_the_training_or_is_refused_beside_each_other`.
const OTHERS: [&str; 6] = [
    "bench",
    "quickstart",
    "recipes",
    "reproduce",
    "train",
    "virtual-scanner",
];

const CASES: [Case; 22] = [
    Case {
        base: "evaluate --recipe l.recipe --test procedural:2:3",
        options: &[&[
            "--basis small.basis",
            "--geometry in-plane",
            "--first 3",
            "--lose 1",
            "--noise 0.05",
            "--additive 0.02",
            "--levels 16",
            "--target 0.2",
            "--seeds 2",
            "--json",
            "--adaptive 6",
        ]],
    },
    Case {
        base: "evaluate --recipe any.recipe --test procedural:1:3 --adaptive 6",
        options: &[MACHINE, &["--noise 0.05"]],
    },
    Case {
        base: "next any.recipe --measurements n.csv --count 2",
        options: &[
            READINGS,
            MACHINE,
            &[
                "--geometry multi-angle,gloss-60",
                "--target 0.001",
                "--blank blank.csv",
                "--json",
            ],
        ],
    },
    Case {
        base: "next --measurements radians.csv --unit radians",
        options: &[&[
            "--count 3",
            "--convention elevation",
            "--azimuth-unit degrees",
            "--ignore noise",
            "--speed 5",
        ]],
    },
    Case {
        base: "evaluate --recipe any.recipe --test procedural:2:3 --geometry in-plane",
        options: &[&[
            "--noise 0.05",
            "--seeds 2",
            "--basis small.basis",
            "--out page",
        ]],
    },
    Case {
        base: "fit m.recipe --measurements m.csv --out fit",
        options: &[
            READINGS,
            &["--format gltf", "--as-fitted", "--keep-all", "--json"],
        ],
    },
    Case {
        base: "fit n.recipe --measurements n.csv --out fit --format rgl",
        options: &[&["--as-fitted", "--quantity brdf-cos-i"]],
    },
    Case {
        base: "fit --measurements radians.csv --out fit --unit radians",
        options: &[&[
            "--convention elevation",
            "--azimuth-unit degrees",
            "--ignore noise",
            "--quantity brdf-cos-i",
            "--json",
        ]],
    },
    Case {
        base: "fit --measurements bands.csv --out fit",
        options: &[&[
            "--illuminant a",
            "--observer 10",
            "--white-reflectance 0.9",
            "--by quantity",
            "--ignore 550",
        ]],
    },
    Case {
        base: "photo set/a.png set/b.png --lights set/lights.csv",
        options: &[&[
            "--circle 20,23,15",
            "--mask mask.png",
            "--field-of-view 20",
            "--dark set/a.png",
            "--saturation 0.5",
            "--white set/b.png",
            "--albedo 0.3",
            "--compare fitted/material.json",
            "--out p.csv",
            "--json",
        ]],
    },
    Case {
        base: "photo set/a.png --lights set/lights.csv --white set/b.png",
        options: &[&[
            "--white-shape tile",
            "--white-reflectance 0.5",
            "--dark set/a.png",
        ]],
    },
    Case {
        base: "photo set/a.png --chrome set/a.png --chrome-circle 23,23,20 --albedo 0.3",
        options: &[&[
            "--field-of-view 20",
            "--compare fitted/material.json --out p.png --measurements read.csv",
        ]],
    },
    Case {
        base: "plan n.recipe",
        options: &[&[
            "--geometry in-plane",
            "--order progressive",
            "--speed 5",
            "--settle 3",
            "--no-full-turns",
            "--max-theta-i 85",
            "--max-theta-o 20",
            "--min-separation 5",
            "--in-plane",
            "--out plan.csv",
            "--blank blank.csv",
            "--json",
        ]],
    },
    Case {
        base: "plan --geometry five-lines",
        options: &[&["--speed 5", "--max-theta-i 85", "--blank blank.csv"]],
    },
    Case {
        base: "query procedural:2:3 --angles radians.csv --unit radians",
        options: &[&[
            "--convention elevation",
            "--azimuth-unit degrees",
            "--out q.csv",
            "--json",
        ]],
    },
    Case {
        base: "render sphere procedural:2:3",
        options: &[&["--out s.npy", "--size 40", "--columns 1", "--json"]],
    },
    Case {
        base: "render sphere procedural:1:3 --lights lights.csv --out rendered",
        options: &[&["--size 40", "--columns 1", "--json"]],
    },
    Case {
        base: "render view n.recipe --material procedural:1:3",
        options: &[&[
            "--measurements n.csv",
            "--reference procedural:1:4",
            "--noise 0.1",
            "--out v.html",
        ]],
    },
    Case {
        base: "render view n.recipe --measurements n.csv",
        options: &[&["--reference procedural:1:4", "--noise 0.1", "--out v.html"]],
    },
    Case {
        base: "export l.recipe --format postcard --out e",
        options: &[&["--geometry in-plane", "--components 3", "--strip"]],
    },
    Case {
        base: "export l.recipe --format basis --out e",
        options: &[&["--components 3", "--strip"]],
    },
    Case {
        base: "convert fitted/material.json m --format pab",
        options: &[&["--as-fitted", "--json"]],
    },
];

/// Names of options in a command's help, which clap prints from their definition.
fn options_in_help(folder: &Folder, command: &str) -> BTreeSet<String> {
    let help = folder.succeed(&format!("{command} -h"));
    let lines = help
        .lines()
        .map(str::trim_start)
        .filter(|line| line.starts_with('-'));
    let names = lines.filter_map(|line| line.split([' ', ',']).find(|word| word.starts_with("--")));
    names.map(str::to_owned).collect()
}

/// Writes the inputs of all cases.
fn write_inputs(folder: &Folder) {
    folder.succeed(
        "train --model linear --samples 4 --missing 0.5 --effort brief --data procedural:8 --out l.recipe",
    );
    folder.succeed("export l.recipe --format basis --components 6 --out small.basis");
    for (bundled, name) in [
        ("any/linear-any.recipe", "any.recipe"),
        ("any/linear-any.basis", "any.basis"),
        ("completed/neural-n8.recipe", "n.recipe"),
        ("masked/neural-n16.recipe", "m.recipe"),
    ] {
        folder.add_bundled(bundled);
        let (_, own) = bundled.split_once('/').expect("a folder");
        fs::rename(folder.at(own), folder.at(name)).expect("renamed");
    }
    for recipe in ["m", "n"] {
        folder.succeed(&format!("plan {recipe}.recipe --blank {recipe}-blank.csv"));
        folder.succeed(&format!(
            "query procedural:1:3 --angles {recipe}-blank.csv --out {recipe}.csv"
        ));
    }
    // One reading of the fit is wrong.
    let readings = folder.read_text("m.csv");
    let mut lines: Vec<&str> = readings.lines().collect();
    let angles: Vec<&str> = lines[2].split(',').collect();
    let wrong = format!("{},9,9,9", angles[..angles.len() - 3].join(","));
    lines[2] = &wrong;
    folder.write("m.csv", lines.join("\n"));
    let white =
        readings.lines().map(
            |line| match line.starts_with("material") || line.contains("theta") {
                true => line.to_owned(),
                false => {
                    let cells: Vec<&str> = line.split(',').collect();
                    format!("{},0.3,0.3,0.3", cells[..cells.len() - 3].join(","))
                }
            },
        );
    folder.write("white.csv", white.collect::<Vec<_>>().join("\n"));
    folder.write(
        "bands.csv",
        "theta_i,theta_o,quantity,450,550,650\n20,50,reflectance-factor,0.3,0.4,0.5\n\
         45,-20,reflectance-factor,0.2,0.3,0.3\n",
    );
    folder.write(
        "radians.csv",
        "theta_i,phi_i,theta_o,phi_o,r,g,b,noise\n0.5,0,0.4,1.5,0.2,0.1,0.1,0.1\n\
         0.9,0,0.3,3.1,0.4,0.3,0.1,0.3\n",
    );
    folder.write("lights.csv", "picture,x,y,z\na.png,0,0,1\n");
    folder.succeed("fit n.recipe --measurements n.csv --out fitted");
    folder.write(
        "lamps.csv",
        "picture,x,y,z\na.png,0.2,0,1\nb.png,-0.5,0.5,1\n",
    );
    folder.succeed("render sphere procedural:1:3 --lights lamps.csv --size 48 --out set");
    folder.succeed("photo set/a.png --lights set/lights.csv --out read.csv");
    folder.succeed("render sphere procedural:1:4 --out mask.png --size 48");
}

/// Paths and contents of files.
type Files = Vec<(PathBuf, Vec<u8>)>;

/// Returns the output of a command and the files that it writes; None if it fails.
fn result(inputs: &Folder, command: &str) -> Option<(Vec<u8>, Files)> {
    let folder = Folder::new();
    for (name, bytes) in files_below(inputs.path()) {
        let path = folder.at(&name.to_string_lossy());
        fs::create_dir_all(path.parent().expect("a folder")).expect("created");
        fs::write(path, bytes).expect("written");
    }
    let output = folder.run(command);
    let mut files = files_below(folder.path());
    files.sort();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        matches!(output.status.code(), Some(0..=2)),
        "{command}: {error}"
    );
    if !output.status.success() {
        assert!(error.contains("error: "), "{command}: {error}");
        return None;
    }
    Some((output.stdout, files))
}

#[test]
fn each_option_changes_the_result_or_is_refused_beside_each_other() {
    let inputs = Folder::new();
    write_inputs(&inputs);

    // The cases have all options of all commands.
    let help = inputs.succeed("-h");
    let (_, commands) = help.split_once("Commands:").expect("commands");
    let (commands, _) = commands.split_once("Options:").expect("options");
    let mut in_help = BTreeMap::new();
    for line in commands
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
    {
        let command = line.split_whitespace().next().expect("a name");
        if command == "help" || OTHERS.contains(&command) {
            continue;
        }
        let subcommands: &[&str] = match command {
            "render" => &["render sphere", "render view"],
            other => &[other],
        };
        for command in subcommands {
            in_help.insert((*command).to_owned(), options_in_help(&inputs, command));
        }
    }
    for case in &CASES {
        let words = [&[case.base], &case.options.concat()[..]]
            .concat()
            .join(" ");
        let command = in_help
            .iter_mut()
            .find(|(name, _)| case.base.starts_with(*name));
        let (_, missing) = command.expect("a command");
        missing.retain(|option| !words.split(' ').any(|word| word == option));
    }
    // Their only option is --json or --out, with the one or other result.
    for command in ["compare", "inspect"] {
        in_help.remove(command);
    }
    for (command, missing) in in_help {
        let missing: Vec<_> = missing
            .iter()
            .filter(|option| !PERMISSIONS.contains(&&***option))
            .collect();
        assert!(missing.is_empty(), "{command}: {missing:?}");
    }

    let failures: Vec<String> = CASES
        .par_iter()
        .flat_map(|case| check(&inputs, case))
        .collect();
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Returns the options and pairs without effect, and options that are always refused although no other case accepts them.
fn check(inputs: &Folder, case: &Case) -> Vec<String> {
    let run = |options: &[&str]| result(inputs, &[&[case.base], options].concat().join(" "));
    let base = run(&[]);
    let mut failures = Vec::new();
    if base.is_none() {
        failures.push(format!("{} fails", case.base));
    }
    let options = case.options.concat();
    let alone: Vec<_> = options.iter().map(|option| run(&[option])).collect();
    for (option, alone) in options.iter().zip(&alone) {
        if alone.is_some() && *alone == base {
            failures.push(format!("{} {option}: no effect", case.base));
        }
    }
    for (second, other) in options.iter().enumerate() {
        for (first, one) in options[..second].iter().enumerate() {
            let Some(both) = run(&[one, other]) else {
                continue;
            };
            for (index, without) in [(first, other), (second, one)] {
                let single = &alone[if index == first { second } else { first }];
                if single.as_ref() == Some(&both) {
                    failures.push(format!(
                        "{} {without}: {} has no effect beside it",
                        case.base, options[index]
                    ));
                }
            }
        }
    }
    failures
}
