//! Pictures of a fit: a sphere, lobes, and the spectra of bands.

use std::path::Path;

use glimpse_evaluation::evaluation::SPHERE_SIZE;
use glimpse_evaluation::render::render_sphere;
use glimpse_fitting::measurement::{
    FitReport, MaterialFiles, MaterialFit, SpectrumReading, SpectrumReport,
};
use glimpse_materials::{Material, angles_of, luminance};

use super::plane::{PlaneReading, plotted_theta_i};
use crate::report::{Lobe, Plot, Scale, Series, lobe_directions, lobe_svg};

/// The largest number of readings in the plot of spectra, each with a color of its own.
const MAX_PLOTTED: usize = 7;

/// Returns lobe.svg, with bands bands.svg, and unless they have no color sphere.png.
pub(super) fn pictures(
    fit: &MaterialFit,
    report: &FitReport,
    folder: &Path,
) -> anyhow::Result<MaterialFiles> {
    let mut files = vec![(folder.join("lobe.svg"), lobes(fit).into_bytes())];
    let spectrum = report.spectrum.as_ref();
    if let Some(spectrum) = spectrum {
        files.push((folder.join("bands.svg"), spectra(spectrum).into_bytes()));
    }
    if spectrum.is_none_or(|spectrum| spectrum.illuminant.is_some()) {
        let sphere = render_sphere(&fit.material as &dyn Material, SPHERE_SIZE);
        files.push((folder.join("sphere.png"), sphere.tone_map().to_png()?));
    }
    Ok(files)
}

fn lobes(fit: &MaterialFit) -> String {
    let material = &fit.material;
    let samples = &fit.selection.readings.samples;
    let readings: Vec<PlaneReading> = samples.iter().filter_map(PlaneReading::new).collect();
    let lobes = plotted_theta_i(&readings).into_iter().map(|degrees| {
        let theta_i = (degrees as f32).to_radians();
        let (_, directions) = lobe_directions(theta_i);
        let angles = directions.iter().map(angles_of).collect();
        let posterior = &fit.selection.posterior;
        let deviations = posterior.deviations(material.fitted(), angles);
        let marks = readings
            .iter()
            .filter_map(|reading| reading.mark(degrees as f32));
        let name = format!("{}, light at {degrees}\u{b0}", material.name());
        Lobe {
            deviations: deviations.into_iter().map(luminance).collect(),
            readings: marks.collect(),
            ..Lobe::new(name, material as &dyn Material, theta_i)
        }
    });
    lobe_svg(&lobes.collect::<Vec<_>>())
}

/// Plots the spectra of readings over the whole range of aspecular angles, and of the fit there.
fn spectra(report: &SpectrumReport) -> String {
    let mut order: Vec<&SpectrumReading> = report.readings.iter().collect();
    order.sort_by(|one, other| one.aspecular.total_cmp(&other.aspecular));
    let count = order.len().min(MAX_PLOTTED);
    let shown = (0..count).map(|index| order[index * (order.len() - 1) / (count - 1).max(1)]);
    let series = shown.enumerate().flat_map(|(color, reading)| {
        let kinds = [("reading", true), ("fit", false)];
        let spectra = kinds.into_iter().zip(&reading.spectra);
        spectra.map(move |((kind, is_dashed), spectrum)| {
            let points = report.wavelengths.iter().zip(spectrum);
            Series {
                name: format!("{:.0}\u{b0}: {kind}", reading.aspecular),
                color,
                is_dashed,
                points: points
                    .map(|(nm, value)| [*nm, *value].map(f64::from))
                    .collect(),
            }
        })
    });
    let plot = Plot {
        title: "Spectra, by the angle from the mirror direction".into(),
        x: ("wavelength, nm".into(), Scale::Linear),
        y: "BRDF, sr\u{207b}\u{b9}".into(),
        series: series.collect(),
    };
    plot.to_svg()
}
