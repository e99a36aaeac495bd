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

/// The font of drawings, so that they look the same on every machine, and one for the signs that it
/// lacks, as the minus of an exponent.
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
        fonts.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// An SVG drawing as a PNG file, twice as large, on white; what its style sheet says of dark
/// surroundings is passed over.
///
/// # Errors
/// If it is no SVG, or has no size.
pub fn svg_to_png(svg: &str) -> Result<Vec<u8>, RasterError> {
    let options = Options {
        fontdb: fonts(),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_for_light_surroundings() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 8 4\"><style>\
                   .a rect{fill:#ff0000}@media(prefers-color-scheme:dark){.a rect{fill:#0000ff}}\
                   </style><g class=\"a\"><rect width=\"8\" height=\"4\"/></g></svg>";
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
    fn letters_and_exponents_are_drawn() {
        let drawn = |text: &str| {
            svg_to_png(&format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"60\" height=\"20\">\
                 <text x=\"2\" y=\"15\" font-family=\"system-ui, sans-serif\">{text}</text></svg>"
            ))
            .unwrap()
        };
        let (nothing, no_sign) = (drawn(""), drawn("\u{e000}"));
        for text in ["Ours", "⁻", "³", "°", "θ"] {
            assert_ne!(drawn(text), nothing, "{text}");
            assert_ne!(drawn(text), no_sign, "{text}");
        }
    }

    #[test]
    fn what_is_no_drawing_is_refused() {
        assert!(matches!(svg_to_png("nonsense"), Err(RasterError::Svg(_))));
    }
}
