//! Rows of pictures to compare side by side.

use maud::{Markup, html};

use glimpse_evaluation::metrics::Metrics;
use glimpse_evaluation::render::Picture;

/// A row of pictures of one subject.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct GalleryRow {
    /// Title, such as the material's name.
    pub(crate) title: String,
    /// The pictures, the reference first.
    pub(crate) tiles: Vec<Tile>,
}

impl GalleryRow {
    /// Creates a row of a reference and its fits, each with its label, errors and picture. The fit with the lowest loss is
    /// marked as the best if there are several.
    pub(crate) fn of_fits(
        title: &str,
        reference: Picture,
        fits: Vec<(String, Metrics, Picture)>,
    ) -> Self {
        let losses = fits.iter().map(|(_, metrics, _)| metrics.loss);
        let lowest_loss = losses.fold(f64::INFINITY, f64::min);
        let several = fits.len() > 1;
        let tiles = fits.into_iter().map(|(label, metrics, picture)| Tile {
            label,
            details: vec![
                format!("loss {:.4}, delta E {:.2}", metrics.loss, metrics.delta_e),
                format!("DSSIM {:.4}, {:.1} dB", metrics.dssim, metrics.psnr),
            ],
            best: several && metrics.loss == lowest_loss,
            picture,
        });
        let reference = Tile::plain("Reference", reference);
        Self {
            title: title.into(),
            tiles: [reference].into_iter().chain(tiles).collect(),
        }
    }
}

/// A picture with its label.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tile {
    /// Label within the row, such as the method's name.
    pub(crate) label: String,
    /// Lines of details, such as errors.
    pub(crate) details: Vec<String>,
    /// True if the picture is marked as the best of its row.
    pub(crate) best: bool,
    /// The picture.
    pub(crate) picture: Picture,
}

/// Formats rows of pictures with a caption as HTML that refers to pictures in `directory`, and adds their file names and
/// contents to `files`. A name is a number, the row and the label.
pub(super) fn to_html(
    caption: &str,
    rows: &[GalleryRow],
    directory: &str,
    files: &mut Vec<(String, Picture)>,
) -> Markup {
    html! {
        section.gallery {
            p.caption { (caption) } "\n"
            @for row in rows {
                @if !row.title.is_empty() { h3 { (row.title) } "\n" }
                div.row style={ "--columns: " (row.tiles.len()) } {
                    @for tile in &row.tiles {
                        @let file = slug(&format!("{} {} {}", files.len(), row.title, tile.label)) + ".png";
                        (tile.to_html(&row.title, &format!("{directory}/{file}"))) "\n"
                        @let () = files.push((file, tile.picture.clone()));
                    }
                }
            }
        }
    }
}

impl Tile {
    /// Creates a tile without details.
    pub(crate) fn plain(label: impl Into<String>, picture: Picture) -> Self {
        Self {
            label: label.into(),
            details: Vec::new(),
            best: false,
            picture,
        }
    }

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

/// Converts text to a part of a file name: lowercase letters, digits and single hyphens.
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
