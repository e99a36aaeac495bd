//! The omissions of materials.

/// A part of a file that its material lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Omission {
    /// Light that passes through the surface, or is at its back.
    #[error("its transmitted light (BTDF) is not read")]
    Transmission,
    /// The reflectance of the mirror direction alone, which adds to the BRDF.
    #[error("its specular reflectance, which adds to the BRDF, is not read")]
    SpecularReflectance,
    /// The transmittance of the unscattered light.
    #[error("its specular transmittance is not read")]
    SpecularTransmittance,
    /// The color of bands [without one](crate::have_color): each channel is the mean of the bands.
    #[error("its bands have no color, which needs blue, green and red; each channel is their mean")]
    Color,
}
