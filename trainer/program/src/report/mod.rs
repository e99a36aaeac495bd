//! Output for readers: tables as Markdown, HTML and CSV, plots, pages with pictures, and drawings of sample patterns
//! and lobes.

mod format;
mod gallery;
mod lobe;
mod page;
mod pattern;
mod plot;
mod svg;
mod table;

pub(crate) use gallery::{GalleryRow, Tile};
pub(crate) use lobe::{Lobe, MAX_LOBES, ReadingMark, lobe_directions, lobe_svg};
pub(crate) use page::{Page, document, write_file};
pub(crate) use pattern::pattern_svg;
pub(crate) use plot::{Plot, Scale, Series};
pub(crate) use table::{Column, Compare, Highlight, Table, metric_columns, metric_row, text};
