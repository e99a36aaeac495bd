//! What is left to read: tables for terminal, page and spreadsheet, plots, pages with pictures,
//! drawings of sample patterns and lobes.

mod format;
mod gallery;
mod lobe;
mod page;
mod pattern;
mod plot;
mod svg;
mod table;

pub use gallery::{Gallery, GalleryRow, Tile};
pub use lobe::{Lobe, MOST_LOBES, lobe, lobe_svg};
pub use page::{Page, PageError, document};
pub use pattern::pattern_svg;
pub use plot::{Axis, Hue, Mark, Plot, PlotError, Scale, Series};
pub use table::{Best, Cell, Column, Compare, Table};
