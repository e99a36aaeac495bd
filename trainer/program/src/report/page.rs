//! A web page without remote resources: one file, and its pictures in a folder next to it.

use std::fs;
use std::path::Path;

use anyhow::Context;
use glimpse_evaluation::render::Picture;
use glimpse_materials::files::write_atomic;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{GalleryRow, Table, gallery};

/// The folder of the pictures, next to the page.
const PICTURES: &str = "pictures";
/// The style sheet: for phones, for dark mode, and with colors for color-blind readers.
const STYLE: &str = include_str!("page.css");
/// The script that enlarges a row of pictures on a click. Without scripts, the link opens the picture.
const SCRIPT: &str = include_str!("page.js");

/// A page that is built from top to bottom.
#[derive(Debug)]
pub(crate) struct Page {
    title: String,
    body: String,
    pictures: Vec<(String, Picture)>,
}

/// Returns an HTML document with the common style sheet, followed by `style`.
pub(crate) fn document(title: &str, style: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}

impl Page {
    /// Creates an empty page.
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            body: String::new(),
            pictures: Vec::new(),
        }
    }

    /// Adds a heading.
    pub(crate) fn heading(&mut self, text: &str) -> &mut Self {
        self.push(&html! { h2 { (text) } "\n" })
    }

    /// Adds preformatted text, such as a command.
    pub(crate) fn code(&mut self, text: &str) -> &mut Self {
        self.push(&html! { pre { code { (text) } } "\n" })
    }

    /// Adds a paragraph of plain text.
    pub(crate) fn paragraph(&mut self, text: &str) -> &mut Self {
        self.push(&html! { p { (text) } "\n" })
    }

    /// Adds a table.
    pub(crate) fn table(&mut self, table: &Table) -> &mut Self {
        self.push(&PreEscaped(table.to_html()))
    }

    /// Adds rows of pictures.
    pub(crate) fn gallery(&mut self, caption: &str, rows: &[GalleryRow]) -> &mut Self {
        let html = gallery::to_html(caption, rows, PICTURES, &mut self.pictures);
        self.push(&html)
    }

    /// Adds an SVG drawing, such as the result of [`pattern_svg`](super::pattern_svg), with a caption. The SVG is
    /// not escaped.
    pub(crate) fn drawing(&mut self, svg: &str, caption: &str) -> &mut Self {
        self.push(&html! {
            figure.drawing { (PreEscaped(svg)) figcaption { (caption) } } "\n"
        })
    }

    /// Writes `index.html` and the folder of PNG files into a directory, and creates the directory if it does not
    /// exist. Reports the page on stderr. The page is written last and atomically, so that all of its pictures exist.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub(crate) fn write(&self, directory: &Path) -> anyhow::Result<()> {
        let folder = directory.join(PICTURES);
        for (name, picture) in &self.pictures {
            write_file(&folder.join(name), &picture.to_png()?)?;
        }
        let index = directory.join("index.html");
        write_file(&index, self.to_html().as_bytes())?;
        eprintln!("wrote {}", index.display());
        Ok(())
    }

    /// Formats the page as HTML.
    fn to_html(&self) -> String {
        let body = html! {
            main { h1 { (self.title) } "\n" (PreEscaped(&self.body)) }
            script { (PreEscaped(SCRIPT)) }
        };
        document(&self.title, "", &body)
    }

    fn push(&mut self, html: &Markup) -> &mut Self {
        self.body.push_str(&html.0);
        self
    }
}

/// Writes a file atomically, and creates its folder if it does not exist.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder)
        .and_then(|()| write_atomic(path, bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}
