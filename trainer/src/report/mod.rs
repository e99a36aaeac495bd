//! What is left to read: tables for terminal, page and spreadsheet, pages with pictures, drawings
//! of sample patterns.

mod format;
mod gallery;
mod html;
mod page;
mod pattern;
mod table;

pub use gallery::{Gallery, GalleryRow, Tile};
pub use page::{Page, PageError};
pub use pattern::pattern_svg;
pub use table::{Best, Cell, Column, Compare, Table};
