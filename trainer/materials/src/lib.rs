//! Sources of BRDFs, and the loss between two BRDFs.
//!
//! [`Source`] reads MERL tables, RGL measurements, NBRDF networks, PAB-Opto files, fitted materials and the built-in
//! procedural set. Every material implements [`Material`]. [`Format`] lists the formats that can be written.
//!
//! The materials build on five modules: [`untrusted`] reads files, [`files`] writes them, [`setting`] names settings in
//! errors, [`lists`] sums lists, and [`basis`] converts coefficients of the model Linear to a BRDF. Two modules build on
//! the materials: [`sampling`] draws directions, and [`loss`] is the paper's loss of a whole BRDF.

pub mod basis;
pub mod files;
pub mod lists;
pub mod loss;
pub mod sampling;
pub mod setting;
pub mod untrusted;

mod brdf;
mod color;
mod coverage;
mod error;
mod fitted_brdf;
mod formats;
mod identity;
mod interpolation;
mod lab;
mod material;
mod omission;
mod physical;
mod procedural;
mod rows;
mod sensor;
mod source;
mod spectrum;

pub use basis::{angles_of, half_differences};
pub use brdf::{Brdf, BrdfWithDerivative, LUMINANCE, Tabulation, luminance};
pub use coverage::Coverage;
pub use error::{Defect, NotFinite, SourceError};
pub use fitted_brdf::{BandGroup, BandValues, Bands, FittedBrdf};
pub use formats::fitted_material::{BasisFile, Convention, FittedMaterial, MODELS};
pub use formats::merl::{MerlTable, table_nodes, to_merl};
pub use formats::nbrdf::{NeuralBrdf, to_nbrdf, to_npy};
pub use formats::pab::PabSet;
pub use formats::{Format, Tabulate};
pub use identity::{Identity, digest};
pub use lab::{Lab, ciede2000};
pub use material::Material;
pub use omission::Omission;
pub use physical::{Physical, PhysicalErrors, directional_albedo};
pub use procedural::Procedural;
pub use rows::rows;
pub use sensor::quantize;
pub use source::{MaterialsAndShares, Origin, ShareError, Source, SourceShare, Sources};
pub use spectrum::{COLOR_BANDS, Illuminant, Observer, Viewing, have_color, weighted_sums};
