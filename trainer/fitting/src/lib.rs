//! Readings from a lab, completed to a BRDF by a recipe.
//!
//! The list has the modules in order, lowest first. A module imports only modules above it in this list, and
//! no two files import each other. `tests/check_layers.py` reads the list and enforces both.
//!
//! - [`choice`]: names of choices on the command line
//! - [`route`]: the order in which a machine's arms visit samples
//! - [`linear`]: components of materials at any directions, posteriors, proposals, and files of bases
//! - [`recipe`]: recipe files, and how they were trained
//! - [`bundled`]: bundled recipes
//! - [`measurement`]: readings from a lab, matched to a pattern, checked for outliers and fitted
//! - [`photo`]: readings of photographs
//! - [`export`]: recipes in other formats
//! - [`scanner`]: the virtual scanner

pub mod bundled;
pub mod choice;
pub mod export;
pub mod linear;
pub mod measurement;
pub mod photo;
pub mod recipe;
pub mod route;
pub mod scanner;
