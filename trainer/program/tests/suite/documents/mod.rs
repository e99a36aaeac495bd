//! Checks of the documents: links are valid, figures name the command that prints them, and commands are
//! accepted by the trainer.

mod commands;
mod figures;
mod links;

use std::fs;
use std::path::{Path, PathBuf};

/// A Markdown file.
struct Document {
    /// The path, relative to the workspace.
    path: PathBuf,
    text: String,
}

/// The root of the workspace.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("the root of the workspace")
}

/// All documents of the workspace.
fn documents() -> Vec<Document> {
    let mut documents = Vec::new();
    let folders = ["core", "trainer", "embedded-demo", "tests"];
    let mut pending: Vec<PathBuf> = folders.map(PathBuf::from).into();
    documents.push(document("README.md".into()));
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(root().join(&folder)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = folder.join(entry.file_name());
            let is_generated = ["target", "corpus"]
                .map(Into::into)
                .contains(&entry.file_name());
            if entry.path().is_dir() && !is_generated {
                pending.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                documents.push(document(path));
            }
        }
    }
    assert!(documents.len() > 10, "only {} documents", documents.len());
    documents
}

fn document(path: PathBuf) -> Document {
    let text = fs::read_to_string(root().join(&path)).expect("a UTF-8 document");
    Document { path, text }
}

/// The documents with figures that commands print: the front page and those of the packages.
fn with_figures() -> impl Iterator<Item = Document> {
    let folders = ["README.md", "core/docs", "trainer/docs"];
    documents().into_iter().filter(move |document| {
        folders
            .iter()
            .any(|folder| document.path.starts_with(folder))
    })
}

#[test]
fn readme_is_short() {
    let lines = document("README.md".into()).text.lines().count();
    assert!(
        lines <= 120,
        "README.md has {lines} lines: move some of it to a document"
    );
}
