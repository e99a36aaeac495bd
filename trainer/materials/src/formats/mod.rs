//! Material file formats: one table of their names, files, readers and writers.

pub(super) mod fitted_material;
pub(super) mod merl;
pub(super) mod nbrdf;
pub(super) mod open_material;
pub(super) mod pab;
pub(super) mod rgl;
pub(super) mod ssdd;

use std::ffi::OsStr;
use std::path::Path;

use clap::ValueEnum;

use self::merl::MerlTable;
use self::nbrdf::NeuralBrdf;
use self::open_material::{read_open_material, to_open_material};
use self::pab::{PabSet, to_pab};
use self::rgl::{RglMeasurement, to_rgl};
use self::ssdd::to_ssdd;
use crate::error::{Defect, SourceError, read_error};
use crate::untrusted::{escaped_start, is_text, is_valid_name, read_head};
use crate::{Material, NotFinite, Tabulation};

/// The number of bytes at the start of a file that detection reads.
const HEAD_BYTES: u64 = 2048;

/// A file format that materials are read from and written to. Its documentation is that of an option: names, contents and size
/// of its files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub enum Format {
    /// NAME.binary: MERL's table of 90 x 90 x 180 values, 33 MiB
    Merl,
    /// NAME_fc1.npy and its five siblings: a network of 675 weights
    Nbrdf,
    /// NAME_rgb.bsdf: a tensor file for Mitsuba 3's plugin `measured`, 12 MB
    Rgl,
    /// NAME_spec.bsdf: the same as spectra, for `measured` in spectral variants and for pbrt-v4, 41 MB
    #[value(name = "rgl-spectral")]
    RglSpectra,
    /// NAME_in00.txt, NAME_in10.txt, ...: PAB-Opto's text files, for Radiance's pabopto2bsdf
    Pab,
    /// NAME_brdf.xompt: spectra in a look-up table of ASAM OpenMATERIAL 3D, 40 MB
    OpenMaterial,
    /// NAME.ssdd: a table in text, of RGB or of bands, for libbsdf and BSDF Processor
    Ssdd,
}

type Read = fn(&Path, String) -> Result<Box<dyn Material>, SourceError>;
/// A writer of a table of any BRDF. It fails if the BRDF is not finite at a direction.
pub type Tabulate = fn(&Tabulation<'_>) -> Result<Vec<Vec<u8>>, NotFinite>;

/// The properties of a format.
pub struct Properties {
    /// The ends of the names of files, after that of the material.
    endings: &'static [&'static str],
    /// The ends of the names of written files, one for each file.
    pub written: &'static [&'static str],
    /// Returns true for the first bytes of a file.
    has_signature: fn(&[u8]) -> bool,
    /// Reads the material of a file, and gives it a name unless the file states one.
    read: Read,
    /// Returns the bytes of each file in the order of `written`; None if the format is not a table of any BRDF.
    pub tabulate: Option<Tabulate>,
    /// True if a table of this format holds a spectrum.
    pub has_spectra: bool,
}

impl Format {
    /// Returns the properties.
    #[must_use]
    pub fn properties(self) -> Properties {
        match self {
            Self::Merl => Properties {
                endings: &[".binary"],
                written: &[".binary"],
                has_signature: merl::has_signature,
                read: |path, name| Ok(Box::new(MerlTable::read(path, name)?)),
                tabulate: Some(|table| Ok(vec![merl::to_merl(table.rgb)?])),
                has_spectra: false,
            },
            Self::RglSpectra => Properties {
                endings: &[],
                written: &["_spec.bsdf"],
                has_signature: rgl::has_spectra,
                read: |path, name| Ok(Box::new(RglMeasurement::read(path, name)?)),
                tabulate: Some(|table| Ok(vec![to_rgl(table, true)?])),
                has_spectra: true,
            },
            Self::Rgl => Properties {
                endings: &[".bsdf"],
                written: &["_rgb.bsdf"],
                has_signature: rgl::has_rgb,
                read: |path, name| Ok(Box::new(RglMeasurement::read(path, name)?)),
                tabulate: Some(|table| Ok(vec![to_rgl(table, false)?])),
                has_spectra: false,
            },
            Self::Nbrdf => Properties {
                endings: &nbrdf::ENDINGS,
                written: &nbrdf::ENDINGS,
                has_signature: |_| false,
                read: |path, name| Ok(Box::new(NeuralBrdf::read(path, name)?)),
                tabulate: None,
                has_spectra: false,
            },
            Self::Pab => Properties {
                endings: &[],
                written: &pab::ENDINGS,
                has_signature: pab::has_signature,
                read: |path, _| PabSet::read(path)?.resampled(path),
                tabulate: Some(to_pab),
                has_spectra: false,
            },
            Self::OpenMaterial => Properties {
                endings: &["_brdf.xompt"],
                written: &["_brdf.xompt"],
                has_signature: |head| is_text(head, "{", &["\"lookupTable\""]),
                read: |path, _| read_open_material(path),
                tabulate: Some(|table| Ok(vec![to_open_material(table)?])),
                has_spectra: true,
            },
            Self::Ssdd => Properties {
                endings: &[".ssdd"],
                written: &[".ssdd"],
                has_signature: |head| is_text(head, ssdd::SIGNATURE, &["DATA_TYPE"]),
                read: |path, name| Ok(Box::new(ssdd::read(path, name)?)),
                tabulate: Some(|table| Ok(vec![to_ssdd(table)?])),
                has_spectra: true,
            },
        }
    }

    /// Returns the format for the ending of a file's name; None for other endings.
    #[must_use]
    pub fn from_ending(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let ends_in = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
        let written = |format: &Self| ends_in(format.properties().written);
        let read = |format: &Self| ends_in(format.properties().endings);
        let mut all = Self::value_variants().iter().copied();
        all.clone().find(written).or_else(|| all.find(read))
    }

    /// Returns the format and the name of a material that a file's name states. None for other files.
    pub(super) fn named(path: &Path) -> Option<(Self, &str)> {
        let file = path.file_name()?.to_str()?;
        let mut endings = Self::value_variants().iter().flat_map(|format| {
            let endings = format.properties().endings.iter();
            endings.map(|ending| (*format, file.strip_suffix(ending)))
        });
        endings.find_map(|(format, name)| Some((format, name.filter(|name| is_valid_name(name))?)))
    }

    /// Returns true if a file's name without regard to case has the extension of a format.
    pub(super) fn is_similar(path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let extension_of = |name: &str| name.rsplit('.').next().map(str::to_lowercase);
        let all = Self::value_variants().iter();
        let mut endings = all.flat_map(|format| format.properties().endings);
        endings.any(|ending| extension_of(&name) == extension_of(ending))
    }

    /// Detects the format of a file: for NBRDF and OpenMATERIAL by its name, and for others by its first bytes.
    ///
    /// # Errors
    /// If the file cannot be read or has none of these formats.
    pub fn detect(path: &Path) -> Result<Self, SourceError> {
        if let Some((format @ (Self::Nbrdf | Self::OpenMaterial), _)) = Self::named(path) {
            return Ok(format);
        }
        if !path.is_file() {
            return Err(Defect::in_file(path)("it is not a regular file"));
        }
        let head = read_head(path, HEAD_BYTES).map_err(read_error(path))?;
        let is_format = |format: &Self| (format.properties().has_signature)(&head);
        let unknown = || SourceError::UnknownFormat {
            path: path.into(),
            start: escaped_start(&head),
        };
        let mut all = Self::value_variants().iter().copied();
        all.find(is_format).ok_or_else(unknown)
    }

    /// Reads the material of a file.
    ///
    /// # Errors
    /// If the file cannot be read, has none of these formats, or is damaged.
    pub(super) fn read(path: &Path) -> Result<Box<dyn Material>, SourceError> {
        let format = Self::detect(path)?;
        let name = match Self::named(path) {
            Some((_, name)) => name,
            None => path.file_name().and_then(OsStr::to_str).unwrap_or_default(),
        };
        match is_valid_name(name) {
            true => (format.properties().read)(path, name.to_owned()),
            false => Err(Defect::in_file(path)("its file name is not UTF-8")),
        }
    }
}
