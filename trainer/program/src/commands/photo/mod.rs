//! `trainer photo`

mod compare;
mod options;

use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use glimpse_evaluation::render::overview;
use glimpse_fitting::choice::Choice;
use glimpse_fitting::measurement::polar;
use glimpse_fitting::photo::{PhotoReading, Photograph, PixelUse, choose, set_albedo};
use serde_json::{Value, json};

use super::emit;
use super::numbers::number;
use crate::output::{file_as_json, file_type, refuse_input, write_files};
use crate::report::Table;
use options::PhotographArgs;

/// Turn photographs of a ball into readings, for `trainer fit`.
///
/// Each pixel of a ball has its own normal, so a photograph under one distant lamp has thousands of
/// readings of a material that is the same everywhere. The photographs are of one ball by one camera,
/// which do not move, in a dark room, with a lamp at another place in each. Three are far better than
/// one: with the lamp near the camera, and 45 and 90 degrees aside.
///
/// PICTURES are PNG or TIFF of 16 bits, TIFF of floats, or OpenEXR, and linear: a pixel is
/// proportional to the light, which a camera's JPEG is not. Convert raw files, all equally:
///
///   dcraw -4 -T FILE.NEF
///   rawpy: postprocess(gamma=(1, 1), no_auto_bright=True, adjust_maximum_thr=0, output_bps=16)
///   darktable: TIFF of 16 bits, profile linear Rec709 RGB, without filmic and base curve
///
/// LIGHTS.csv has the columns picture, x, y, z, and r, g, b if known: the direction toward the lamp
/// (x right, y up, z toward the camera), and its intensity. A pixel, as a share of full scale,
/// divided by the intensity is the BRDF times cos(theta_i). Without r, g, b the scale comes from
/// --white or --albedo.
///
/// OUTPUT. At most 300 readings, each a mean of neighboring pixels, with noise and a place, which
/// `trainer fit` names if the reading is an outlier. A PNG file of the same name shows what was
/// understood. Look at it before you fit. On the left, the outline is green, and a cross is where a
/// glossy ball has its highlight. On the right, used pixels are gray, or green if they are the place
/// of a reading, saturated ones red, shadowed ones blue, grazing ones and the rim orange, outliers
/// (dust, reflections of the room) pink, and masked ones violet.
///
/// Example: trainer render sphere gold.binary --lights lights.csv --out set      # without a camera
///          trainer photo set/*.png --lights set/lights.csv --out gold.csv
///          trainer fit --measurements gold.csv --out fit
///          trainer photo set/*.png --lights set/lights.csv --compare fit/material.json \
///            --measurements gold.csv --out comparison.png
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Photo {
    #[command(flatten)]
    photographs: PhotographArgs,
    /// Without a known scale: the albedo (the median of pi times the BRDF) of the material, 0.001 to 1. Values
    /// are then relative to it
    #[arg(long, value_name = "A", conflicts_with = "white", value_parser = number(0.001..=1.0_f64))]
    albedo: Option<f64>,
    /// Instead of readings, write photograph, fit and difference (times 8) of a fitted material side by
    /// side to --out, a PNG file, and print the mean error of each photograph
    #[arg(long, value_name = "MATERIAL")]
    compare: Option<PathBuf>,
    /// With --compare: the readings of the fit, to which Lambert and GGX are fitted for comparison
    #[arg(long, value_name = "FILE.csv", requires = "compare")]
    measurements: Option<PathBuf>,
    /// CSV file of readings
    #[arg(long, short, value_name = "FILE", default_value = "photo.csv")]
    out: PathBuf,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Photo {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if self.compare.is_none() {
            file_type(&self.out, &["csv"])?;
        }
        let picture = self.out.with_extension("png");
        let compared = self.compare.iter().chain(&self.measurements);
        for input in self.photographs.files().chain(compared) {
            refuse_input(&self.out, input)?;
            refuse_input(&picture, input)?;
        }
        let (mut photographs, block) = self.photographs.read()?;
        match self.albedo {
            Some(albedo) => set_albedo(&mut photographs, albedo),
            None => ensure!(
                self.photographs.has_scale(&photographs),
                "the scale is unknown: add r, g, b to the table of lights, or give --white, or --albedo for \
                 relative values"
            ),
        }
        if let Some(material) = &self.compare {
            return self.compare(&photographs, material);
        }
        let mut uses: Vec<_> = photographs.iter().map(Photograph::uses).collect();
        let readings = choose(&photographs, &mut uses);
        ensure!(
            !readings.is_empty(),
            "no pixel of the ball is lit and not saturated: check --circle and the lights"
        );
        let csv = to_csv(&photographs, &readings, block).context("cannot write the table")?;
        let shown = overview(&photographs, &uses, &readings).to_png()?;
        write_files(
            &[(self.out.clone(), csv), (picture.clone(), shown)],
            self.force,
        )?;
        let rows = photographs.iter().zip(&uses).enumerate();
        let rows = rows.map(|(index, (photograph, uses))| {
            let count =
                |wanted: &PixelUse| uses.iter().flatten().filter(|one| *one == wanted).count();
            let pixels = PixelUse::value_variants().iter();
            let pixels: Value = pixels
                .map(|wanted| (wanted.name(), count(wanted)))
                .collect();
            let is_outlier = |index: &usize| uses[*index] == Some(PixelUse::Outlier);
            let outliers: Vec<usize> = (0..uses.len()).filter(is_outlier).collect();
            let outlier = outliers.get(outliers.len() / 2);
            let outlier = outlier.map(|index| place(photograph, *index, block));
            json!({
                "picture": photograph.name,
                "light_degrees": photograph.light.direction[2].acos().to_degrees(),
                "readings": readings.iter().filter(|one| one.photograph == index).count(),
                "pixels": pixels,
                "outlier": outlier,
            })
        });
        let rows: Vec<Value> = rows.collect();
        let ball = photographs[0].ball;
        let [x, y] = original(ball.center, block);
        let radius = ball.radius * block as f64;
        let report = json!({
            "file": file_as_json(&self.out),
            "picture": file_as_json(&picture),
            "circle": { "x": x, "y": y, "radius": radius },
            "albedo": self.albedo,
            "photographs": rows,
        });
        let table = Table::of_records("photographs", &rows)?.to_markdown();
        emit(self.json, &report, || {
            let scale = self.albedo.map_or(String::new(), |albedo| {
                format!("The values are relative: their albedo is {albedo}.\n")
            });
            format!(
                "{table}\nThe ball is at column {x:.1}, row {y:.1}, with a radius of {radius:.1} pixels: look at {}.\n{scale}",
                picture.display()
            )
        })
    }
}

/// Returns the place in the original picture of one in a picture of means over blocks.
fn original(place: [f64; 2], block: usize) -> [f64; 2] {
    place.map(|side| (side + 0.5) * block as f64 - 0.5)
}

/// Returns the name of a pixel's place.
fn place(photograph: &Photograph, index: usize, block: usize) -> String {
    let [x, y] = original(photograph.picture.place(index), block);
    format!("{}, column {x:.0}, row {y:.0}", photograph.name)
}

fn to_csv(
    photographs: &[Photograph],
    readings: &[PhotoReading],
    block: usize,
) -> anyhow::Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record("theta_i,phi_i,theta_o,phi_o,r,g,b,noise,place".split(','))?;
    for reading in readings {
        let angles = polar(reading.angles).map(f64::to_degrees);
        let numbers = angles.iter().chain(&reading.brdf).chain([&reading.noise]);
        let numbers = numbers.map(|number| (*number as f32).to_string());
        let place = place(&photographs[reading.photograph], reading.index, block);
        csv.write_record(numbers.chain([place]))?;
    }
    csv.into_inner().map_err(|error| error.into_error().into())
}
