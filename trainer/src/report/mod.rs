//! What is left to read: tables for terminal, page and spreadsheet, plots, pages with pictures,
//! drawings of sample patterns.

mod format;
mod gallery;
mod html;
mod page;
mod pattern;
mod plot;
mod raster;
mod table;

pub use gallery::{Gallery, GalleryRow, Tile};
pub use page::{Page, PageError};
pub use pattern::pattern_svg;
pub use plot::{Axis, Hue, Mark, Plot, PlotError, Scale, Series};
pub use raster::{RasterError, svg_to_png};
pub use table::{Best, Cell, Column, Compare, Table};
