//! A BRDF to write as a table.

use crate::Brdf;

/// A BRDF to write as a table.
#[derive(Clone, Copy)]
pub struct Tabulation<'b> {
    /// The name of the material.
    pub name: &'b str,
    /// The BRDF in RGB.
    pub rgb: &'b dyn Brdf,
    /// The wavelengths of its bands in nm, in ascending order; empty if it has none.
    pub wavelengths: &'b [f32],
    /// A BRDF for each three bands.
    pub groups: &'b [&'b dyn Brdf],
}

impl<'b> Tabulation<'b> {
    /// Returns the table of a BRDF without bands.
    #[must_use]
    pub fn rgb(name: &'b str, rgb: &'b dyn Brdf) -> Self {
        Self {
            name,
            rgb,
            wavelengths: &[],
            groups: &[],
        }
    }

    /// Returns the BRDF of each group of bands, or that in RGB without bands.
    pub(crate) fn columns(&self) -> Vec<&'b dyn Brdf> {
        if self.wavelengths.is_empty() {
            return vec![self.rgb];
        }
        self.groups.to_vec()
    }
}
