//! A web page that needs nothing from elsewhere: one file, and its pictures in a folder beside it.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_materials::files::{make_folder, write_whole, write_whole_below};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::gallery::Names;
use super::{Gallery, Table};
use crate::render::{Picture, PictureError};

/// The file of a part of a page, in its folder.
const PART: &str = "part.html";
/// The look: readable on a phone and in the dark; blue against orange for the color-blind.
const STYLE: &str = include_str!("page.css");
/// Clicking a picture shows its row large. Without scripts the link leads to the picture.
const SCRIPT: &str = include_str!("page.js");

/// Why a page cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// One of its pictures cannot be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The page itself cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A part of it cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// A page, part by part from the top.
#[derive(Debug)]
pub struct Page {
    title: String,
    /// Where the pictures lie, seen from the page.
    folder: String,
    body: String,
    names: Names,
    pictures: Vec<(String, Picture)>,
}

/// Returns a whole document of HTML, in the style of all pages followed by one of its own.
#[must_use]
pub fn document(title: &str, style: &str, body: &Markup) -> String {
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
    /// An empty page.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            folder: "pictures".into(),
            body: String::new(),
            names: Names::default(),
            pictures: Vec::new(),
        }
    }

    /// The same, with its pictures in a folder of this name instead of `pictures`: for pages that
    /// share a directory.
    #[must_use]
    pub fn with_pictures_in(title: impl Into<String>, folder: impl Into<String>) -> Self {
        Self {
            folder: folder.into(),
            ..Self::new(title)
        }
    }

    /// Another page as a part of this one, if [`Page::write_part`] has left it in a folder.
    ///
    /// # Errors
    /// If it is there and cannot be read.
    pub fn part(self, folder: &Path) -> Result<Self, PageError> {
        let path = folder.join(PART);
        match std::fs::read_to_string(&path) {
            Ok(html) => Ok(self.push(&PreEscaped(html))),
            Err(source) if source.kind() == io::ErrorKind::NotFound => Ok(self),
            Err(source) => Err(PageError::Read { path, source }),
        }
    }

    /// A heading within the page.
    #[must_use]
    pub fn heading(self, text: &str) -> Self {
        self.push(&html! { h2 { (text) } "\n" })
    }

    /// A command or a program's text, as it is.
    #[must_use]
    pub fn code(self, text: &str) -> Self {
        self.push(&html! { pre { code { (text) } } "\n" })
    }

    /// A paragraph of plain text.
    #[must_use]
    pub fn paragraph(self, text: &str) -> Self {
        self.push(&html! { p { (text) } "\n" })
    }

    /// A table, its best numbers marked.
    #[must_use]
    pub fn table(self, table: &Table) -> Self {
        self.push(&PreEscaped(table.to_html()))
    }

    /// Rows of pictures.
    #[must_use]
    pub fn gallery(mut self, gallery: &Gallery) -> Self {
        let html = gallery.to_html(&self.folder, &mut self.names, &mut self.pictures);
        self.push(&html)
    }

    /// A drawing, such as [`pattern_svg`](super::pattern_svg) makes, with a caption. The SVG goes
    /// into the page as it is.
    #[must_use]
    pub fn drawing(self, svg: &str, caption: &str) -> Self {
        self.push(&html! {
            figure.drawing { (PreEscaped(svg)) figcaption { (caption) } } "\n"
        })
    }

    /// Writes `index.html` and, in `pictures/`, PNG files into a directory, which is made if need
    /// be. The page comes last and at once, so it never shows less than everything.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, directory: &Path) -> Result<(), PageError> {
        make_folder(directory).map_err(|source| PageError::Write {
            path: directory.into(),
            source,
        })?;
        self.write_as(&directory.join("index.html"))
    }

    /// The same with another name of the page.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write_as(&self, path: &Path) -> Result<(), PageError> {
        self.write_pictures(path.parent().unwrap_or(Path::new("")))?;
        write_whole(path, self.to_html().as_bytes()).map_err(|source| PageError::Write {
            path: path.into(),
            source,
        })
    }

    /// Writes it as a part of a page that will lie in a directory: its pictures where that page
    /// will look for them, the rest in one of the directory's folders.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write_part(&self, directory: &Path, folder: &str) -> Result<(), PageError> {
        self.write_pictures(directory)?;
        let path = Path::new(folder).join(PART);
        let part = html! {
            section.part { "\n" h2 { (self.title) } "\n" (PreEscaped(&self.body)) } "\n"
        };
        let html = part.into_string();
        write_whole_below(directory, &path, html.as_bytes()).map_err(|source| PageError::Write {
            path: directory.join(path),
            source,
        })
    }

    fn write_pictures(&self, directory: &Path) -> Result<(), PageError> {
        for (name, picture) in &self.pictures {
            let relative = Path::new(&self.folder).join(name);
            write_whole_below(directory, &relative, &picture.to_png()?).map_err(|source| {
                PageError::Write {
                    path: directory.join(relative),
                    source,
                }
            })?;
        }
        Ok(())
    }

    /// The page as HTML.
    fn to_html(&self) -> String {
        let body = html! {
            main { h1 { (self.title) } "\n" (PreEscaped(&self.body)) }
            script { (PreEscaped(SCRIPT)) }
        };
        document(&self.title, "", &body)
    }

    fn push(mut self, html: &Markup) -> Self {
        self.body.push_str(&html.0);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{GalleryRow, Tile};

    /// A row of pictures with these labels.
    fn gallery(title: &str, labels: &[&str]) -> Gallery {
        let tile = |label: &&str| Tile {
            label: (*label).into(),
            details: vec!["loss 0.1".into(), "<b>".into()],
            best: *label == "Ours",
            picture: Picture::filled(8, 8, [1, 2, 3]),
        };
        Gallery {
            caption: "Spheres".into(),
            rows: vec![GalleryRow {
                title: title.into(),
                tiles: labels.iter().map(tile).collect(),
            }],
        }
    }

    fn page() -> Page {
        let gallery = gallery("blue & rubber", &["Reference", "Ours", "ours"]);
        Page::new("A <title>").paragraph("2 < 3").gallery(&gallery)
    }

    #[test]
    fn a_page_lies_in_its_directory_with_all_it_shows() {
        let scratch = tempfile::tempdir().unwrap();
        let directory = scratch.path().join("new");
        page().write(&directory).unwrap();
        let html = std::fs::read_to_string(directory.join("index.html")).unwrap();
        let sources: Vec<&str> = html.split("src=\"").skip(1).collect();
        assert_eq!(sources.len(), 3);
        for source in sources {
            let (file, _) = source.split_once('"').unwrap();
            assert!(directory.join(file).is_file(), "{file}");
        }
        assert!(html.contains("pictures/blue-rubber-ours-2.png"));
        // Drawings on white are turned in the dark.
        assert!(html.contains(".drawing svg.on-white { filter: invert("));
        assert!(!html.contains("http"), "nothing is loaded from elsewhere");
    }

    #[test]
    fn parts_become_one_page() {
        let scratch = tempfile::tempdir().unwrap();
        Page::with_pictures_in("First", "first/pictures")
            .gallery(&gallery("gold", &["Ours"]))
            .write_part(scratch.path(), "first")
            .unwrap();
        let whole = Page::new("All")
            .part(&scratch.path().join("first"))
            .unwrap()
            .part(&scratch.path().join("never-made"))
            .unwrap();
        whole.write(scratch.path()).unwrap();
        let html = std::fs::read_to_string(scratch.path().join("index.html")).unwrap();
        assert!(html.contains("<h2>First</h2>"));
        assert!(html.contains("src=\"first/pictures/gold-ours.png\""));
        let picture = scratch.path().join("first/pictures/gold-ours.png");
        assert!(picture.is_file());
    }

    #[test]
    fn text_is_escaped() {
        let html = page().to_html();
        assert!(html.contains("<title>A &lt;title&gt;</title>"));
        assert!(html.contains("alt=\"blue &amp; rubber: Ours\""));
        assert!(html.contains("<p>2 &lt; 3</p>"));
        assert!(html.contains("<br>&lt;b&gt;"));
    }

    #[test]
    fn without_its_pictures_there_is_no_page() {
        let scratch = tempfile::tempdir().unwrap();
        std::fs::write(scratch.path().join("pictures"), b"in the way").unwrap();
        assert!(page().write(scratch.path()).is_err());
        assert!(!scratch.path().join("index.html").exists());
    }
}
