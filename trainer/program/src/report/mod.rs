//! Output for readers: tables as text, HTML and CSV, plots, pages with pictures, and drawings of sample patterns
//! and lobes.

mod format;
mod gallery;
mod lobe;
mod page;
mod pattern;
mod plot;
mod svg;
mod table;

pub use gallery::{Gallery, GalleryRow, Tile};
pub use lobe::{Lobe, MAX_LOBES, lobe, lobe_directions, lobe_svg, luminance};
pub use page::{Page, PageError, document};
pub use pattern::pattern_svg;
pub use plot::{Axis, Marker, Plot, Scale, Series, SeriesColor};
pub use table::{Cell, Column, Compare, Highlight, Table, metric_columns};
