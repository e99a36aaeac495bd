//! The host side of Glimpse: evaluation, rendering, reports, and readings from a lab.
//!
//! Modules from the bottom up. Imports point down only: a module imports those that stand before it, and no
//! two files import each other. `tests/check_layers.py` checks it by this list.
//!
//! - [`measurement`]: readings from a lab, matched to a pattern, examined and fitted
//! - [`export`]: recipes in other formats
//! - [`bundled`]: bundled recipes
//! - [`render`]: spheres under light
//! - [`metrics`]: errors of a fit against its material
//! - [`evaluation`]: methods and their errors on materials
//! - [`conversion`]: materials in the formats of other programs
//! - [`scanner`]: the virtual scanner
//! - [`route`]: the order in which a machine's arms visit a recipe's samples
//! - [`report`]: tables, plots, pages
//! - [`benchmark`]: the work that training spends its time on
//! - `commit`, of the program: its version
//! - `experiment`, of the program: the paper's tables and figures
//! - `commands`, of the program: one file per subcommand
//!
//! Below all of them are crates of their own, which the compiler keeps in order: [`glimpse_training`]
//! (meta-learning, recipes), [`glimpse_materials`] (sources of BRDFs, the loss), [`glimpse_optimizer`] (the
//! meta-parameters as burn holds and steps them) and [`glimpse_kernels`] (sums over samples on lanes, and the
//! adjoint of the fit).

pub mod benchmark;
pub mod bundled;
pub mod conversion;
pub mod evaluation;
pub mod export;
pub mod measurement;
pub mod metrics;
pub mod render;
pub mod report;
pub mod route;
pub mod scanner;
