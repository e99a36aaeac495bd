//! A temporary folder, and commands that run in it.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

use crate::common::assert_names;

pub(crate) const PHONG_N8: &[u8] =
    include_bytes!("../../../../core/examples/recipes/phong-n8.recipe");
pub(crate) const NEURAL_N8: &[u8] =
    include_bytes!("../../../../core/examples/recipes/neural-n8.recipe");
pub(crate) const COOK_TORRANCE_N8: &[u8] =
    include_bytes!("../../../../core/examples/recipes/cook-torrance-n8.recipe");

/// A temporary folder. Names of files are relative to it, and commands run in it.
///
/// A command is one line without the program's name; words are quoted as in a shell.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    /// An empty folder.
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary directory"))
    }

    /// A folder with one file.
    pub(crate) fn with(name: &str, bytes: &[u8]) -> Self {
        let folder = Self::new();
        folder.write(name, bytes);
        folder
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    pub(crate) fn exists(&self, name: &str) -> bool {
        self.at(name).exists()
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.at(name), content).expect("it is written");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub(crate) fn read_text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("it is text")
    }

    pub(crate) fn read_json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).expect("it is JSON")
    }

    /// The sorted names of what lies in a folder of this one; in this one itself for "".
    pub(crate) fn names(&self, of: &str) -> Vec<String> {
        let entries = fs::read_dir(self.at(of)).expect("it can be listed");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<String> = names
            .map(|name| name.into_string().expect("it is text"))
            .collect();
        names.sort();
        names
    }

    /// Copies a bundled recipe here, under its own name.
    pub(crate) fn add_bundled(&self, recipe: &str) {
        let recipes = Path::new(env!("CARGO_MANIFEST_DIR")).join("recipes");
        let name = Path::new(recipe).file_name().expect("a name");
        fs::copy(recipes.join(recipe), self.path().join(name)).expect("it is bundled");
    }

    fn command(&self, command: &str) -> Command {
        let mut process = Command::new(env!("CARGO_BIN_EXE_trainer"));
        let words = shlex::split(command).expect("quotes are in pairs");
        process.args(words).current_dir(self.path());
        process
    }

    /// Runs a command to its end.
    pub(crate) fn run(&self, command: &str) -> Output {
        self.command(command).output().expect("the trainer runs")
    }

    /// Starts a command that prints its messages into the file `talk`.
    pub(crate) fn start(&self, command: &str) -> Child {
        let talk = File::create(self.at("talk")).expect("a file");
        let mut process = self.command(command);
        process.stdout(Stdio::null()).stderr(talk);
        process.spawn().expect("the trainer runs")
    }

    /// Runs a command that must succeed; returns its results and its messages.
    pub(crate) fn succeed_with_talk(&self, command: &str) -> [String; 2] {
        let Output {
            status,
            stdout,
            stderr,
        } = self.run(command);
        let [printed, talk] =
            [stdout, stderr].map(|bytes| String::from_utf8(bytes).expect("it prints text"));
        assert!(status.success(), "{command}: {talk}");
        [printed, talk]
    }

    /// Runs a command that must succeed; returns its results.
    pub(crate) fn succeed(&self, command: &str) -> String {
        let [printed, _] = self.succeed_with_talk(command);
        printed
    }

    /// Runs a command that must succeed, with `--json`.
    pub(crate) fn succeed_as_json(&self, command: &str) -> Value {
        let printed = self.succeed(&format!("{command} --json"));
        serde_json::from_str(&printed).expect("it is JSON")
    }

    /// Runs a command that must fail by an error, which is not a panic; returns its messages.
    pub(crate) fn fail(&self, command: &str) -> String {
        let Output {
            status,
            stdout,
            stderr,
        } = self.run(command);
        let code = status.code();
        assert!(matches!(code, Some(1 | 2)), "{command}: {code:?}");
        assert!(stdout.is_empty(), "results of a failed {command}");
        String::from_utf8(stderr).expect("it prints text")
    }

    /// Runs a command that must fail by a message that names these.
    pub(crate) fn fail_naming(&self, command: &str, named: &[&str]) {
        assert_names(&self.fail(command), named);
    }
}
