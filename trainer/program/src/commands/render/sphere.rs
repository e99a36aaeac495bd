//! `trainer render sphere`

use std::path::{Path, PathBuf};

use anyhow::ensure;
use clap::Args;
use glimpse_evaluation::evaluation::SPHERE_SIZE;
use glimpse_evaluation::render::{Image, distant_ball, photograph, render_sphere};
use glimpse_fitting::photo::Light;
use glimpse_materials::Source;
use serde_json::json;

use super::super::numbers::number;
use super::super::{emit, load, load_single};
use crate::output::{
    check_out, create_out_folder, file_as_json, file_type, refuse_input, refuse_source, write_file,
    write_files,
};
use crate::progress::StepProgress;
use crate::report::Table;

/// Maximum width and height of a sphere, in pixels.
const MAX_SIZE: usize = 4_096;
/// Maximum number of pixels of all spheres or photographs.
const MAX_PIXELS: usize = 1 << 26;
/// The fraction of the full scale that the brightest pixel has, if the table has no intensities.
const BRIGHTEST: f32 = 0.9;
/// The smallest value of this pixel at an intensity of 1.
const MIN_BRIGHTEST: f32 = 1e-6;
/// The number of positions along each side of a pixel whose average it is.
const SUBPIXELS: usize = 4;

/// Render materials as spheres.
///
/// The output is a PNG file with the spheres row by row, or a NumPy array of the same pixels as linear
/// radiance (without exposure and tone mapping). The light is an open-air studio. `trainer evaluate
/// --out` and `trainer compare` write pages of spheres with errors.
///
/// With --lights, the output is a folder of photographs of a ball of one material, for `trainer
/// photo`: a distant camera, and one distant lamp for each picture. The table LIGHTS.csv has the
/// columns picture (a file name, *.png), x, y, z (toward the lamp: x right, y up, z toward the
/// camera), and maybe r, g, b (intensity: a pixel divided by it is the BRDF times cos(theta_i)).
/// Without intensities, the brightest pixel is at 90 % of the full scale. The pictures are linear and
/// have 16 bits. The folder gets a table with all intensities, lights.csv.
///
/// Example: trainer render sphere MERL-test/ --columns 5 --out spheres.png
///          trainer render sphere gold-paint.binary --out gold.npy
///          trainer render sphere gold-paint.binary --lights lamps.csv --size 256 --out set
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Sphere {
    /// Materials (see SOURCES in `trainer --help`)
    source: Source,
    /// Picture to write: *.png or *.npy; with --lights, the folder
    #[arg(long, short, value_name = "FILE", default_value = "sphere.png")]
    out: PathBuf,
    /// Width and height of each sphere in pixels, 1 to 4096
    #[arg(long, value_name = "PIXELS", default_value_t = SPHERE_SIZE, value_parser = number(1..=MAX_SIZE))]
    size: usize,
    /// Materials in a row, 1 to 4096
    #[arg(long, value_name = "COUNT", default_value_t = 8, value_parser = number(1..=MAX_SIZE))]
    columns: usize,
    /// Lamps of photographs
    #[arg(long, value_name = "LIGHTS.csv", conflicts_with = "columns")]
    lights: Option<PathBuf>,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
    /// Print JSON: file, sizes in pixels, and each sphere's row and column; with --lights: folder, and the
    /// ball's circle (x, y, radius in pixels)
    #[arg(long)]
    json: bool,
}

impl Sphere {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        if let Some(lights) = &self.lights {
            return self.photograph(lights);
        }
        let file_type = file_type(&self.out, &["png", "npy"])?;
        refuse_source(&self.out, &self.source)?;
        let materials = load(&self.source)?;
        let count = materials.len();
        ensure!(
            count * self.size * self.size <= MAX_PIXELS,
            "{count} spheres of --size {} are too large for one picture: give fewer materials or \
             a smaller --size",
            self.size
        );
        check_out(&self.out)?;
        let steps = StepProgress::new("rendering", count);
        let spheres = materials.iter().map(|material| {
            let sphere = render_sphere(&**material, self.size);
            steps.increment();
            sphere
        });
        let sheet = Image::grid(&spheres.collect::<Vec<_>>(), self.columns, 4);
        drop(steps);
        let bytes = match file_type {
            "png" => sheet.tone_map().to_png()?,
            _ => sheet.to_npy(),
        };
        write_file(&self.out, &bytes, self.force)?;
        let spheres = materials.iter().enumerate().map(|(index, material)| {
            let [row, column] = [index / self.columns + 1, index % self.columns + 1];
            json!({ "material": material.name(), "row": row, "column": column })
        });
        let report = json!({
            "file": file_as_json(&self.out),
            "width": sheet.width,
            "height": sheet.height,
            "sphere_pixels": self.size,
            "spheres": spheres.collect::<Vec<_>>(),
        });
        let table = Table::of_records("spheres", &report["spheres"])?;
        emit(self.json, &report, || table.to_markdown())
    }

    /// Writes photographs under the lights of a file.
    fn photograph(&self, path: &Path) -> anyhow::Result<()> {
        let own = self.out.join("lights.csv");
        refuse_input(&own, path)?;
        let lights = Light::read_table(path)?;
        ensure!(
            file_type(&self.out, &["png", "npy"]).is_err()
                && lights.keys().all(|name| name.ends_with(".png"))
                && lights.len() * self.size * self.size <= MAX_PIXELS,
            "--lights {}: give a folder as --out, pictures *.png, and not too many for --size",
            path.display()
        );
        let material = load_single(&self.source)?;
        let ball = distant_ball(self.size);
        let render =
            |light: &Light| photograph(&*material, &ball, light, [self.size; 2], SUBPIXELS);
        let mut table = "picture,x,y,z,r,g,b\n".to_owned();
        let mut files = Vec::new();
        for (name, mut light) in lights {
            let intensity = light.intensity.unwrap_or_else(|| {
                let image = render(&light);
                let values = image.pixels.as_flattened().iter().copied();
                // A black ball may have any intensity.
                [f64::from(BRIGHTEST / values.fold(MIN_BRIGHTEST, f32::max)); 3]
            });
            light.intensity = Some(intensity);
            let ([x, y, z], [r, g, b]) = (light.direction, intensity.map(|channel| channel as f32));
            table += &format!("{name},{x:.6},{y:.6},{z:.6},{r},{g},{b}\n");
            files.push((self.out.join(name), render(&light).to_linear_png()?));
        }
        files.push((own, table.into_bytes()));
        create_out_folder(&self.out)?;
        write_files(&files, self.force)?;
        let ([x, y], radius) = (ball.center, (100.0 * ball.radius).round() / 100.0);
        let report = json!({ "folder": self.out, "circle": [x, y, radius] });
        emit(self.json, &report, || format!("circle {x},{y},{radius}\n"))
    }
}
