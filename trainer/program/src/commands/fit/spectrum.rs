//! The spectrum of a fit: bands.csv, bands.svg, and the colors of readings and fit.

use std::f64::consts::PI;

use crate::report::{Axis, Marker, Plot, Scale, Series, SeriesColor};
use clap::Args;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_evaluation::metrics::{Lab, ciede2000};
use glimpse_fitting::measurement::Fit;
use glimpse_materials::{Illuminant, Material, Observer, Viewing, weighted_sums};
use serde::Serialize;

use super::super::choice::choice;

const ILLUMINANTS: [(&str, Illuminant); 4] = [
    ("d65", Illuminant::D65),
    ("d50", Illuminant::D50),
    ("a", Illuminant::A),
    ("e", Illuminant::E),
];
const OBSERVERS: [(&str, Observer); 2] = [("2", Observer::Cie1931), ("10", Observer::Cie1964)];

/// The colors of the plot; it has at most as many readings.
const COLORS: [SeriesColor; 7] = [
    SeriesColor::Blue,
    SeriesColor::Vermillion,
    SeriesColor::Green,
    SeriesColor::Purple,
    SeriesColor::Sky,
    SeriesColor::Orange,
    SeriesColor::Black,
];

/// Options for colors of bands.
#[derive(Args)]
pub(super) struct ViewingArgs {
    /// With bands: illuminant of CIELAB [default: d65]
    #[arg(long, value_parser = choice(&ILLUMINANTS, &[]))]
    illuminant: Option<Illuminant>,
    /// With bands: observer of CIELAB, degrees [default: 2]
    #[arg(long, value_parser = choice(&OBSERVERS, &[]))]
    observer: Option<Observer>,
}

impl ViewingArgs {
    /// Returns true if an option was given.
    pub(super) fn is_given(&self) -> bool {
        self.illuminant.is_some() || self.observer.is_some()
    }

    fn viewing(&self) -> Viewing {
        Viewing {
            illuminant: self.illuminant.unwrap_or_default(),
            observer: self.observer.unwrap_or_default(),
        }
    }
}

/// The colors of readings in bands and of their fit, in CIELAB.
#[derive(Serialize)]
pub(super) struct SpectrumReport {
    /// Values of the options.
    illuminant: &'static str,
    observer: &'static str,
    wavelengths: Vec<f32>,
    readings: Vec<SpectrumReading>,
}

/// A used reading, and the fit there.
#[derive(Serialize)]
struct SpectrumReading {
    sample: usize,
    #[serde(skip)]
    angles: Angles<f32>,
    /// The sensor's angle from the mirror direction, degrees; positive toward the light.
    aspecular: f32,
    lab: [f64; 3],
    fitted_lab: [f64; 3],
    /// CIEDE2000.
    delta_e: f64,
    #[serde(skip)]
    spectra: [Vec<f32>; 2],
}

impl SpectrumReport {
    /// Returns the report of a fit; None without bands.
    pub(super) fn new(fit: &Fit, pattern: &[Angles<f32>], args: &ViewingArgs) -> Option<Self> {
        let bands = fit.material.spectrum()?;
        let weights = args.viewing().xyz_weights(bands.wavelengths());
        let lab = |spectrum: &[f32]| {
            // The reflectance factor.
            let factors = spectrum.iter().map(|value| PI * f64::from(*value));
            Lab::from_relative_xyz(weighted_sums(factors, &weights))
        };
        let used = fit.selection.used();
        let samples = pattern.iter().zip(used).enumerate();
        let samples =
            samples.filter_map(|(sample, (angles, used))| used.map(|_| (sample, *angles)));
        let readings = samples.map(|(sample, angles)| {
            let at = HalfDifference::from_angles(angles);
            let fitted = bands.evaluate(&[at]).swap_remove(0);
            let measured = fit.selection.measurements.spectra[sample].clone();
            let [one, other] = [&measured, &fitted].map(|spectrum| lab(spectrum));
            SpectrumReading {
                sample,
                angles,
                aspecular: aspecular(&at),
                lab: [one.l, one.a, one.b],
                fitted_lab: [other.l, other.a, other.b],
                delta_e: ciede2000(one, other),
                spectra: [measured, fitted],
            }
        });
        let Viewing {
            illuminant,
            observer,
        } = args.viewing();
        Some(Self {
            illuminant: name_of(&ILLUMINANTS, illuminant),
            observer: name_of(&OBSERVERS, observer),
            wavelengths: bands.wavelengths().to_vec(),
            readings: readings.collect(),
        })
    }

    /// Returns the text for the terminal.
    pub(super) fn to_text(&self) -> String {
        let sum: f64 = self.readings.iter().map(|reading| reading.delta_e).sum();
        let worst = self.readings.iter();
        let worst = worst.max_by(|one, other| one.delta_e.total_cmp(&other.delta_e));
        let worst = worst.map_or(String::new(), |worst| {
            let SpectrumReading {
                delta_e, sample, aspecular, ..
            } = worst;
            format!(", largest {delta_e:.2} at sample {sample} ({aspecular:.0} degrees from the mirror direction)")
        });
        format!(
            "{} bands, {} to {} nm; color error (CIEDE2000, {}, {} degrees) mean {:.2}{worst}",
            self.wavelengths.len(),
            self.wavelengths.first().unwrap_or(&0.0),
            self.wavelengths.last().unwrap_or(&0.0),
            self.illuminant.to_uppercase(),
            self.observer,
            sum / self.readings.len().max(1) as f64,
        )
    }

    /// Returns bands.svg, the spectra of readings over the whole range of aspecular angles, and of the fit there.
    pub(super) fn to_svg(&self) -> String {
        let mut order: Vec<&SpectrumReading> = self.readings.iter().collect();
        order.sort_by(|one, other| one.aspecular.total_cmp(&other.aspecular));
        let count = order.len().min(COLORS.len());
        let shown = (0..count).map(|index| order[index * (order.len() - 1) / (count - 1).max(1)]);
        let series = shown.zip(COLORS).flat_map(|(reading, color)| {
            let spectra = reading.spectra.iter();
            let kinds = [("reading", Marker::Ring), ("fit", Marker::Disc)];
            kinds
                .into_iter()
                .zip(spectra)
                .map(move |((kind, marker), spectrum)| {
                    let pairs = self.wavelengths.iter().zip(spectrum);
                    Series {
                        name: format!("{:.0}\u{b0}: {kind}", reading.aspecular),
                        color,
                        marker,
                        points: pairs
                            .map(|(nm, value)| [*nm, *value].map(f64::from))
                            .collect(),
                    }
                })
        });
        let axis = |title: &str, scale| Axis {
            title: title.into(),
            scale,
        };
        let plot = Plot {
            title: "Spectra, by the angle from the mirror direction".into(),
            x: axis("wavelength, nm", Scale::Interval),
            y: axis("BRDF, sr\u{207b}\u{b9}", Scale::Log10),
            series: series.collect(),
        };
        plot.to_svg()
    }

    /// Returns bands.csv, with a row for each reading. It can be fitted again.
    pub(super) fn to_csv(&self) -> String {
        let numbers = |values: &[f64]| {
            let values = values.iter().map(|value| format!("{value:.3}"));
            values.collect::<Vec<_>>().join(",")
        };
        let names = |prefix: &str| -> String {
            let names = self.wavelengths.iter().map(|nm| format!(",{prefix}{nm}"));
            names.collect()
        };
        let mut csv = format!(
            "theta_h,theta_d,phi_d,quantity,aspecular,L*,a*,b*,fitted_L*,fitted_a*,fitted_b*,delta_e{}{}\n",
            names(""),
            names("fitted_")
        );
        for reading in &self.readings {
            let Angles {
                theta_h,
                theta_d,
                phi_d,
            } = reading.angles;
            let degrees =
                [theta_h, theta_d, phi_d].map(|angle| format!("{:.5}", angle.to_degrees()));
            let spectra = reading.spectra.iter().flatten();
            csv += &format!(
                "{},brdf,{:.2},{},{},{:.3}{}\n",
                degrees.join(","),
                reading.aspecular,
                numbers(&reading.lab),
                numbers(&reading.fitted_lab),
                reading.delta_e,
                spectra.map(|value| format!(",{value}")).collect::<String>(),
            );
        }
        csv
    }
}

fn name_of<T: PartialEq>(names: &[(&'static str, T)], value: T) -> &'static str {
    let named = names.iter().find(|(_, other)| *other == value);
    named.map_or("unknown", |(name, _)| name)
}

/// Returns the sensor's angle from the mirror direction in degrees, negative if it is further from the light.
fn aspecular(at: &HalfDifference<f32>) -> f32 {
    let pair = at.directions();
    let [x, y, z] = pair.incoming;
    let mirror = [-x, -y, z];
    let dot = |a: [f32; 3], b: [f32; 3]| -> f32 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let angle = dot(mirror, pair.outgoing)
        .clamp(-1.0, 1.0)
        .acos()
        .to_degrees();
    match dot(pair.incoming, pair.outgoing) < dot(pair.incoming, mirror) {
        true => -angle,
        false => angle,
    }
}
