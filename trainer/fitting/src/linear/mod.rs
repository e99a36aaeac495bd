//! Components of materials at any directions: the posterior of readings, proposals of directions, and files of bases.

mod aperture;
mod bands;
mod compact;
mod components_at;
mod design;
mod evidence;
mod inverse;
mod least_squares;
mod material_basis;
mod next;
mod posterior;
mod prior;
mod uncertainty;

pub use aperture::Aperture;
pub use compact::{COMPACT_COMPONENTS, COMPACT_NODES, HOST_NODES, to_compact_bytes, to_host_bytes};
pub use components_at::{ComponentsAt, bounded_precision};
pub(crate) use evidence::Evidence;
pub use material_basis::{CHANNEL_COEFFICIENTS, material_basis};
pub use next::{Candidates, Proposal};
pub use posterior::{DEFAULT_NOISE, LeftOut, MIN_NOISE, Posterior, PosteriorReading, gain_without};
pub use prior::MaterialPrior;

#[cfg(test)]
mod tests;
