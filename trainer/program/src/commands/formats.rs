//! Formats of materials, as named on the command line.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glimpse_evaluation::conversion::{OutputFormat, WrittenErrors};
use glimpse_evaluation::shading::ShadingModel;

/// Returns a parser of the names of output formats.
pub(super) fn parser() -> impl TypedValueParser<Value = OutputFormat> {
    let values = OutputFormat::ALL
        .map(|format| PossibleValue::new(format.name()).help(describe_files(format)));
    PossibleValuesParser::new(values)
        .try_map(|name| OutputFormat::from_name(&name).ok_or("unknown format"))
}

fn describe_files(format: OutputFormat) -> &'static str {
    match format {
        OutputFormat::Brdf(format) => format.description(),
        OutputFormat::Shading(ShadingModel::Principled) => {
            "NAME_principled.json: parameters of Mitsuba 3's BSDF `principled`, for load_dict"
        }
        OutputFormat::Shading(ShadingModel::Gltf) => {
            "NAME.gltf: a sphere with a material of glTF 2.0"
        }
        OutputFormat::Shading(ShadingModel::OpenPbr) => {
            "NAME.mtlx: parameters of OpenPBR, in MaterialX"
        }
    }
}

/// A group of files that are written together: their paths and contents.
pub(super) type Files = Vec<(PathBuf, Vec<u8>)>;

/// Describes the physical errors of a material and of its files, for stderr.
pub(super) fn physical_errors(errors: &WrittenErrors) -> String {
    let [before, after] = [errors.before, errors.after].map(|errors| {
        format!(
            "reciprocity error {:.3} and largest albedo {:.3}",
            errors.reciprocity, errors.albedo
        )
    });
    format!("{after}; before {before}")
}
