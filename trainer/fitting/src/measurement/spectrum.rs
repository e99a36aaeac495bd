//! The spectrum of a fit: the colors of readings and fit in bands.

use std::f64::consts::PI;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::lists::dot;
use glimpse_materials::{Lab, Material, Viewing, ciede2000, have_color, weighted_sums};
use serde::Serialize;

use super::bands::mean_bands;
use super::fit::MaterialFit;
use super::optics::{COLUMNS, Optics};
use crate::choice::Choice;

/// The colors of readings in bands and of their fit, in CIELAB.
#[derive(Clone, Debug, Serialize)]
pub struct SpectrumReport {
    /// The name of the illuminant; None if the bands [have no color](have_color).
    pub illuminant: Option<String>,
    /// The name of the observer; None if the bands have no color.
    pub observer: Option<String>,
    /// The wavelengths of the bands in nm.
    pub wavelengths: Vec<f32>,
    /// The used readings.
    pub readings: Vec<SpectrumReading>,
}

/// A used reading, and the fit there.
#[derive(Clone, Debug, Serialize)]
pub struct SpectrumReading {
    /// The index of the sample.
    pub sample: usize,
    /// Its directions, in radians.
    #[serde(skip)]
    pub angles: Angles<f32>,
    /// Its instrument.
    #[serde(skip)]
    pub optics: Optics,
    /// The sensor's angle from the mirror direction, degrees; positive toward the light.
    pub aspecular: f32,
    /// The color of the reading: L\*, a\* and b\*; None if the bands have no color.
    pub lab: Option<[f64; 3]>,
    /// The color of the fit.
    pub fitted_lab: Option<[f64; 3]>,
    /// The difference of both, CIEDE2000.
    pub delta_e: Option<f64>,
    /// The BRDF of the reading and of the fit in each band, sr^-1.
    #[serde(skip)]
    pub spectra: [Vec<f32>; 2],
}

impl SpectrumReport {
    /// Returns the report of a fit; None without bands.
    pub(super) fn new(fit: &MaterialFit, viewing: Viewing) -> Option<Self> {
        let bands = fit.material.spectrum()?;
        let weights = viewing.xyz_weights(bands.wavelengths());
        let viewing = have_color(bands.wavelengths()).then_some(viewing);
        let lab = |spectrum: &[f32]| {
            // The reflectance factor.
            let factors = spectrum.iter().map(|value| PI * f64::from(*value));
            Lab::from_relative_xyz(weighted_sums(factors, &weights))
        };
        let samples = fit.selection.readings.samples.iter().enumerate();
        let used = samples.filter(|(_, reading)| reading.used().is_some());
        // A gloss meter has no spectrum.
        let used = used.filter(|(_, reading)| reading.optics.gloss_unit().is_none());
        let readings = used.map(|(sample, reading)| {
            let at = HalfDifference::from_angles(reading.angles);
            let fitted = mean_bands(bands, reading.angles, reading.aperture.as_deref());
            let spectra = [reading.bands.clone(), fitted];
            let [one, other] = spectra.each_ref().map(|spectrum| lab(spectrum));
            SpectrumReading {
                sample,
                angles: reading.angles,
                optics: reading.optics,
                aspecular: aspecular(&at),
                lab: viewing.map(|_| [one.l, one.a, one.b]),
                fitted_lab: viewing.map(|_| [other.l, other.a, other.b]),
                delta_e: viewing.map(|_| ciede2000(one, other)),
                spectra,
            }
        });
        Some(Self {
            illuminant: viewing.map(|viewing| viewing.illuminant.name()),
            observer: viewing.map(|viewing| viewing.observer.name()),
            wavelengths: bands.wavelengths().to_vec(),
            readings: readings.collect(),
        })
    }

    /// Returns bands.csv, with a row for each reading. It can be fitted again.
    pub(super) fn to_csv(&self) -> String {
        let names = |prefix: &str| -> String {
            let names = self.wavelengths.iter().map(|nm| format!(",{prefix}{nm}"));
            names.collect()
        };
        let cell = |value: f64| format!(",{value:.3}");
        let colors = ",L*,a*,b*,fitted_L*,fitted_a*,fitted_b*,delta_e";
        let colors = self.illuminant.as_ref().map_or("", |_| colors);
        let mut all = self.readings.iter();
        let has_optics = all.any(|reading| reading.optics != Optics::default());
        let optics = ["", COLUMNS][usize::from(has_optics)];
        let mut csv = format!(
            "{optics}theta_h,theta_d,phi_d,quantity,aspecular{colors}{}{}\n",
            names(""),
            names("fitted_")
        );
        for reading in &self.readings {
            let degrees = reading.angles.map(f32::to_degrees).to_array();
            let fixed = reading.optics.fixed();
            let degrees =
                degrees.map(|angle| fixed.map_or(format!("{angle:.5}"), |_| String::new()));
            let spectra = reading.spectra.iter().flatten();
            let labs = [reading.lab, reading.fitted_lab].into_iter().flatten();
            let colors = labs.flatten().chain(reading.delta_e);
            if has_optics {
                csv += &reading.optics.to_csv(None);
            }
            csv += &format!(
                "{},brdf,{:.2}{}{}\n",
                degrees.join(","),
                reading.aspecular,
                colors.map(cell).collect::<String>(),
                spectra.map(|value| format!(",{value}")).collect::<String>(),
            );
        }
        csv
    }
}

/// Returns the sensor's angle from the mirror direction in degrees, negative if it is further from the light.
pub(super) fn aspecular(at: &HalfDifference<f32>) -> f32 {
    let pair = at.directions();
    let [x, y, z] = pair.incoming;
    let mirror = [-x, -y, z];
    let angle = dot(&mirror, &pair.outgoing)
        .clamp(-1.0, 1.0)
        .acos()
        .to_degrees();
    if dot(&pair.incoming, &pair.outgoing) < dot(&pair.incoming, &mirror) {
        -angle
    } else {
        angle
    }
}
