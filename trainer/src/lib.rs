//! The host side of Glimpse: materials, meta-learning, evaluation, export.
//!
//! Rooms from the bottom up. Imports point down only: a room imports those that stand before it, and no
//! two files import each other. `tests/check_layers.py` checks it by this list.
//!
//! - [`files`]: files that are written whole or not at all
//! - `foreign`: files of other people, read within bounds and quoted without harm
//! - [`setting`]: settings that errors name
//! - [`basis`]: what makes a BRDF of the model Linear's coefficients
//! - [`material`]: sources of BRDFs
//! - [`measurement`]: readings from a lab, matched to a pattern, looked at and fitted
//! - [`sampling`]: places to look
//! - [`linear`]: principal components of materials
//! - [`meta`]: what is meta-learned, by which plan, saved how
//! - [`export`]: what was learned, as a recipe, and recipes in other formats
//! - [`shipped`]: recipes that come along
//! - [`render`]: spheres under light
//! - [`metrics`]: how far a fit is from its material
//! - [`evaluation`]: methods, and how well they do
//! - [`conversion`]: materials in the formats of other programs
//! - [`scanner`]: the virtual scanner
//! - [`route`]: in which order a machine's arms go to a recipe's samples
//! - [`report`]: tables, plots, pages
//! - [`benchmark`]: the work that training spends its time on
//! - `commit`, of the program: its version
//! - `experiment`, of the program: the paper's tables and figures
//! - `commands`, of the program: one file a subcommand
//!
//! Below all of them are crates of their own, which are compiled beside the other dependencies:
//! [`glimpse_kernels`], sums over samples on lanes and the adjoint of the fit, and
//! [`glimpse_optimizer`], the meta-parameters as burn holds and steps them.

pub mod basis;
pub mod benchmark;
pub mod conversion;
pub mod evaluation;
pub mod export;
pub mod files;
mod foreign;
pub mod linear;
pub mod material;
pub mod measurement;
pub mod meta;
pub mod metrics;
pub mod render;
pub mod report;
pub mod route;
pub mod sampling;
pub mod scanner;
pub mod setting;
pub mod shipped;
