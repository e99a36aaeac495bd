//! Rows of pictures to compare side by side.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::html::{escape, slug};
use crate::render::Picture;

/// Rows of pictures under common headings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gallery {
    /// What it shows, in a sentence.
    pub caption: String,
    /// The rows.
    pub rows: Vec<GalleryRow>,
}

/// One row: several pictures of one thing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GalleryRow {
    /// What it is, such as the material's name.
    pub title: String,
    /// The pictures, the reference first.
    pub tiles: Vec<Tile>,
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// What sets it apart in its row, such as the method's name.
    pub label: String,
    /// What there is to know, such as its errors; a line each.
    pub details: Vec<String>,
    /// Whether it is the best of its row.
    pub best: bool,
    /// The picture.
    pub picture: Picture,
}

/// Gives each picture of a page a file name of its own.
#[derive(Debug, Default)]
pub(super) struct Names(BTreeSet<String>);

impl Names {
    /// `row-label.png`, made of letters, digits and hyphens, with a number if that name is taken.
    fn next(&mut self, row: &str, label: &str) -> String {
        let stem = slug(&format!("{row} {label}"));
        let numbered = (2..).map(|number| format!("{stem}-{number}.png"));
        let mut names = std::iter::once(format!("{stem}.png")).chain(numbered);
        let free = names.find(|name| !self.0.contains(name)).unwrap_or(stem);
        self.0.insert(free.clone());
        free
    }
}

impl Gallery {
    /// The gallery as HTML, with its pictures in `directory`; adds their names and themselves to
    /// `files`.
    pub(super) fn to_html(
        &self,
        directory: &str,
        names: &mut Names,
        files: &mut Vec<(String, Picture)>,
    ) -> String {
        let mut html = String::from("<section class=\"gallery\">\n");
        let _ = writeln!(html, "<p class=\"caption\">{}</p>", escape(&self.caption));
        for row in &self.rows {
            let title = escape(&row.title);
            let columns = row.tiles.len();
            if !title.is_empty() {
                let _ = writeln!(html, "<h3>{title}</h3>");
            }
            let _ = writeln!(html, "<div class=\"row\" style=\"--columns: {columns}\">");
            for tile in &row.tiles {
                let file = names.next(&row.title, &tile.label);
                html += &tile.to_html(&title, &format!("{directory}/{file}"));
                files.push((file, tile.picture.clone()));
            }
            html += "</div>\n";
        }
        html + "</section>\n"
    }
}

impl Tile {
    fn to_html(&self, title: &str, path: &str) -> String {
        let label = escape(&self.label);
        let Picture { width, height, .. } = self.picture;
        let class = if self.best { " class=\"best\"" } else { "" };
        let mut details = String::new();
        for detail in &self.details {
            let _ = write!(details, "<br>{}", escape(detail));
        }
        format!(
            "<figure{class}><a href=\"{path}\"><img src=\"{path}\" width=\"{width}\" \
             height=\"{height}\" loading=\"lazy\" alt=\"{title}: {label}\"></a>\
             <figcaption><b>{label}</b>{details}</figcaption></figure>\n"
        )
    }
}
