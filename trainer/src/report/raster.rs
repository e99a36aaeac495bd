//! SVG drawings as PNG.

use std::sync::{Arc, OnceLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

/// Pixels of the PNG for each unit of the SVG.
const SCALE: f32 = 2.0;

/// A drawing cannot be turned into pixels.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// It is no SVG.
    #[error("a drawing is no SVG: {0}")]
    Svg(#[from] resvg::usvg::Error),
    /// It has no size, or too large a one.
    #[error("a drawing of {0} x {1} has no pixels")]
    Size(f32, f32),
    /// The pixels cannot be encoded.
    #[error("a drawing cannot be written as PNG: {0}")]
    Encode(String),
}

/// The one font of drawings, so that they look the same on every machine.
fn fonts() -> Arc<fontdb::Database> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    let load = || {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        let family = fonts
            .faces()
            .next()
            .and_then(|face| face.families.first())
            .map(|(name, _)| name.clone());
        if let Some(family) = family {
            fonts.set_sans_serif_family(&family);
            fonts.set_serif_family(family);
        }
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// An SVG drawing as a PNG file, twice as large, on white; colours that its style
/// sheet gives names to are those for light surroundings.
///
/// # Errors
/// If it is no SVG, or has no size.
pub fn svg_to_png(svg: &str) -> Result<Vec<u8>, RasterError> {
    let options = Options {
        fontdb: fonts(),
        ..Options::default()
    };
    let tree = Tree::from_str(&without_variables(svg), &options)?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|side| (side * SCALE).ceil() as u32);
    let mut pixels =
        Pixmap::new(width, height).ok_or(RasterError::Size(size.width(), size.height()))?;
    pixels.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(
        &tree,
        Transform::from_scale(SCALE, SCALE),
        &mut pixels.as_mut(),
    );
    pixels
        .encode_png()
        .map_err(|error| RasterError::Encode(error.to_string()))
}

/// The drawing with `var(--name)` replaced by what its style sheet first says of `--name`, and
/// without what it says for dark surroundings: neither is known to the renderer.
fn without_variables(svg: &str) -> String {
    let mut text = match svg.find("@media") {
        Some(start) => {
            let mut depth = 0;
            let end = svg[start..].char_indices().find_map(|(index, character)| {
                match character {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    _ => return None,
                }
                (depth == 0 && character == '}').then_some(start + index + 1)
            });
            match end {
                Some(end) => svg[..start].to_owned() + &svg[end..],
                None => svg.to_owned(),
            }
        }
        None => svg.to_owned(),
    };
    while let Some(start) = text.find("var(--") {
        let Some(length) = text[start..].find(')') else {
            break;
        };
        let name = text[start + 4..start + length].to_owned();
        let value = text
            .split_once(&format!("{name}:"))
            .map_or("", |(_, rest)| {
                rest.split([';', '}']).next().unwrap_or_default()
            });
        let value = match value.contains("var(") {
            true => String::new(),
            false => value.to_owned(),
        };
        text.replace_range(start..=start + length, &value);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_by_name_are_those_for_light_surroundings() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 8 4\"><style>\
                   .a{--ink:#ff0000;--other:#00ff00}@media(prefers-color-scheme:dark){.a{--ink:#0000ff}}\
                   .a rect{fill:var(--ink)}</style><g class=\"a\"><rect width=\"8\" height=\"4\"/></g></svg>";
        assert!(without_variables(svg).contains("fill:#ff0000"));
        let png = svg_to_png(svg).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (16, 8));
        assert_eq!(&pixels[..3], [255, 0, 0]);
    }

    #[test]
    fn letters_are_drawn() {
        let svg = |text: &str| {
            format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"60\" height=\"20\">\
                 <text x=\"2\" y=\"15\" font-family=\"system-ui, sans-serif\">{text}</text></svg>"
            )
        };
        assert_ne!(
            svg_to_png(&svg("Ours")).unwrap(),
            svg_to_png(&svg("")).unwrap()
        );
    }

    #[test]
    fn what_is_no_drawing_is_refused() {
        assert!(matches!(svg_to_png("nonsense"), Err(RasterError::Svg(_))));
        // Neither an unknown variable nor one that names itself is followed for ever.
        for style in [".a{fill:var(--b)}", ".a{--b:var(--b);fill:var(--b)}"] {
            let svg = format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"2\" height=\"2\"><style>{style}</style></svg>"
            );
            assert!(svg_to_png(&svg).is_ok());
        }
    }
}
