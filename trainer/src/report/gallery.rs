//! Rows of pictures to compare side by side.

use std::collections::BTreeSet;

use maud::{Markup, html};

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
    ) -> Markup {
        html! {
            section.gallery {
                p.caption { (self.caption) } "\n"
                @for row in &self.rows {
                    @if !row.title.is_empty() { h3 { (row.title) } "\n" }
                    div.row style={ "--columns: " (row.tiles.len()) } {
                        @for tile in &row.tiles {
                            @let file = names.next(&row.title, &tile.label);
                            (tile.to_html(&row.title, &format!("{directory}/{file}"))) "\n"
                            @let () = files.push((file, tile.picture.clone()));
                        }
                    }
                }
            }
        }
    }
}

impl Tile {
    fn to_html(&self, title: &str, path: &str) -> Markup {
        let Picture { width, height, .. } = self.picture;
        html! {
            figure.best[self.best] {
                a href=(path) {
                    img src=(path) width=(width) height=(height) loading="lazy"
                        alt={ (title) ": " (self.label) };
                }
                figcaption {
                    b { (self.label) }
                    @for detail in &self.details { br; (detail) }
                }
            }
        }
    }
}

/// Text as part of a file name: small letters, digits and single hyphens.
fn slug(text: &str) -> String {
    let words: Vec<String> = text
        .split(|character: char| !character.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_lowercase)
        .collect();
    words.join("-")
}

#[cfg(test)]
mod tests {
    use super::slug;

    #[test]
    fn slugs_are_safe_file_names() {
        assert_eq!(slug("../Blue Rubber (2)/é"), "blue-rubber-2");
        assert_eq!(slug("***"), "");
    }
}
