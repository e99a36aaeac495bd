//! A temporary folder in which commands run.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

pub(crate) use crate::common::Folder;
use crate::common::assert_names;

pub(crate) const PHONG_N8: &[u8] =
    include_bytes!("../../../../../core/examples/recipes/phong-n8.recipe");
pub(crate) const NEURAL_N8: &[u8] =
    include_bytes!("../../../../../core/examples/recipes/neural-n8.recipe");
pub(crate) const COOK_TORRANCE_N8: &[u8] =
    include_bytes!("../../../../../core/examples/recipes/cook-torrance-n8.recipe");

/// Commands run in the folder. A command is one line without the program's name. Words are quoted as in a shell.
impl Folder {
    /// A folder with one file.
    pub(crate) fn with(name: &str, bytes: &[u8]) -> Self {
        let folder = Self::new();
        folder.write(name, bytes);
        folder
    }

    pub(crate) fn exists(&self, name: &str) -> bool {
        self.at(name).exists()
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub(crate) fn read_text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("UTF-8 text")
    }

    pub(crate) fn read_json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).expect("valid JSON")
    }

    /// Returns the cells of a column of a CSV file.
    pub(crate) fn column(&self, file: &str, name: &str) -> Vec<String> {
        let text = self.read_text(file);
        let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let header = rows.next().expect("a header");
        let column = header.iter().position(|title| *title == name);
        let column = column.expect("a column of this name");
        rows.map(|row| row[column].to_owned()).collect()
    }

    /// Returns the sorted names of the entries of a subfolder, or of this folder for "".
    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.at(folder)).expect("a readable folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<String> = names
            .map(|name| name.into_string().expect("UTF-8 text"))
            .collect();
        names.sort();
        names
    }

    /// Copies a bundled recipe into this folder, under its own name.
    pub(crate) fn add_bundled(&self, recipe: &str) {
        let recipes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recipes");
        let name = Path::new(recipe).file_name().expect("a name");
        fs::copy(recipes.join(recipe), self.path().join(name)).expect("a bundled recipe");
    }

    fn command(&self, command: &str) -> Command {
        let mut process = Command::new(env!("CARGO_BIN_EXE_trainer"));
        let words = shlex::split(command).expect("paired quotes");
        process.args(words).current_dir(self.path());
        process
    }

    /// Runs a command to its end.
    pub(crate) fn run(&self, command: &str) -> Output {
        self.command(command).output().expect("the trainer runs")
    }

    /// Starts a command, with stderr redirected to the file `stderr`.
    pub(crate) fn start(&self, command: &str) -> Child {
        let stderr = File::create(self.at("stderr")).expect("a file");
        let mut process = self.command(command);
        process.stdout(Stdio::null()).stderr(stderr);
        process.spawn().expect("the trainer runs")
    }

    /// Runs a command that must succeed. Returns stdout and stderr.
    pub(crate) fn succeed_with_messages(&self, command: &str) -> [String; 2] {
        let Output {
            status,
            stdout,
            stderr,
        } = self.run(command);
        let [printed, messages] =
            [stdout, stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8 output"));
        assert!(status.success(), "{command}: {messages}");
        [printed, messages]
    }

    /// Runs a command that must succeed. Returns stdout.
    pub(crate) fn succeed(&self, command: &str) -> String {
        let [printed, _] = self.succeed_with_messages(command);
        printed
    }

    /// Runs a command with `--json`, which must succeed. Returns stdout.
    pub(crate) fn succeed_as_json(&self, command: &str) -> Value {
        let printed = self.succeed(&format!("{command} --json"));
        serde_json::from_str(&printed).expect("valid JSON")
    }

    /// Runs a command that must fail with an error, not a panic. Returns stderr.
    pub(crate) fn fail(&self, command: &str) -> String {
        let Output {
            status,
            stdout,
            stderr,
        } = self.run(command);
        let code = status.code();
        assert!(matches!(code, Some(1 | 2)), "{command}: {code:?}");
        assert!(stdout.is_empty(), "output of the failed command {command}");
        String::from_utf8(stderr).expect("UTF-8 output")
    }

    /// Runs a command that must fail with a message that contains these words.
    pub(crate) fn fail_naming(&self, command: &str, words: &[&str]) {
        assert_names(&self.fail(command), words);
    }

    /// Runs a command with different options, and fails as [`Self::fail_naming`]. Each case is "OPTIONS => WORDS".
    pub(crate) fn fail_each(&self, command: &str, cases: &[&str]) {
        for case in cases {
            let (options, words) = case.split_once("=>").expect("options and words");
            let words: Vec<&str> = words.split_whitespace().collect();
            self.fail_naming(&format!("{command} {options}"), &words);
        }
    }
}
