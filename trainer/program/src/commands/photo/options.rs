//! Options of photographs: their files, the lights, the ball, and the scale.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_fitting::photo::{
    Ball, Camera, Light, LinearPicture, Photograph, WhiteShape, chrome_light,
};

use super::super::numbers::{finite, number, reflectances};
use crate::picture;

/// The longest side of the pictures that are worked with, in pixels: larger ones are averaged over blocks.
const MAX_SIDE: usize = 512;

/// Options of photographs.
#[derive(Args)]
pub(super) struct PhotographArgs {
    /// Linear pictures of one ball by one camera
    #[arg(required = true, value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    /// CSV file of lights: picture, x, y, z and, if known, r, g, b
    #[arg(long, value_name = "LIGHTS.csv", required_unless_present = "chrome")]
    lights: Option<PathBuf>,
    /// Pictures of a chrome ball in the place of the ball, one for each light in the order of the
    /// pictures: its highlight says where the lamp is
    #[arg(long, value_name = "PICTURE", num_args = 1.., conflicts_with = "lights", requires = "chrome_circle")]
    chrome: Vec<PathBuf>,
    /// Outline of the chrome ball: column and row of its middle, and radius, in pixels
    #[arg(long, value_name = "X,Y,RADIUS", requires = "chrome", value_parser = circle)]
    chrome_circle: Option<Ball>,
    /// Outline of the ball: column and row of its middle, from 0 at the top left, and radius, in pixels
    /// [default: the circle of the bright rim]
    #[arg(long, value_name = "X,Y,RADIUS", conflicts_with = "mask", value_parser = circle)]
    circle: Option<Ball>,
    /// PNG file that is white where the ball is; its circle is the outline, and pixels where it is black
    /// are not used
    #[arg(long, value_name = "FILE.png")]
    mask: Option<PathBuf>,
    /// Full angle of the pictures' width in degrees, 1 to 120, if the camera is near; pictures must not be cropped
    /// [default: the camera is far away]
    #[arg(long, value_name = "DEGREES", value_parser = number(1.0..=120.0_f64))]
    field_of_view: Option<f64>,
    /// Picture of the same exposure with the lamp off, which is subtracted: black level and room light
    #[arg(long, value_name = "PICTURE")]
    dark: Option<PathBuf>,
    /// Smallest pixel of a saturated sensor, as a share of full scale [default: 0.99, or none with pixels above 1]
    #[arg(long, value_name = "LEVEL", value_parser = finite)]
    saturation: Option<f32>,
    /// Pictures of a white reference in the place of the ball: one for all lights, or one for each
    #[arg(long, value_name = "PICTURE", num_args = 1..)]
    pub(super) white: Vec<PathBuf>,
    /// With --white: shape of the reference [default: ball]
    #[arg(long, value_enum, requires = "white")]
    white_shape: Option<WhiteShape>,
    /// With --white: its reflectance, above 0 and at most 2 [default: 0.99]
    #[arg(long, value_name = "R[,R,R]", requires = "white", value_parser = reflectances)]
    white_reflectance: Option<[f32; 3]>,
}

/// Parses the outline of a ball.
fn circle(text: &str) -> Result<Ball, String> {
    let numbers = text
        .split(',')
        .map(|number| finite(number.trim()).map(f64::from));
    match numbers.collect::<Result<Vec<_>, _>>().unwrap_or_default()[..] {
        [x, y, radius] if radius > 1.0 => Ok(Ball::distant([x, y, radius])),
        _ => Err("give column, row and radius, separated by commas".to_owned()),
    }
}

impl PhotographArgs {
    /// Returns the input files.
    pub(super) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let single = [&self.lights, &self.mask, &self.dark];
        let lists = self.pictures.iter().chain(&self.chrome).chain(&self.white);
        lists.chain(single.into_iter().flatten())
    }

    /// Returns true if the scale of all photographs is known.
    pub(super) fn has_scale(&self, photographs: &[Photograph]) -> bool {
        let mut lights = photographs.iter().map(|one| one.light.intensity);
        !self.white.is_empty() || lights.all(|intensity| intensity.is_some())
    }

    /// Reads the photographs. Returns them with means over blocks of pixels, and the width of a block.
    pub(super) fn read(&self) -> anyhow::Result<(Vec<Photograph>, usize)> {
        let mut size = None;
        let mut check_size = |path: &Path, picture: &LinearPicture| {
            let own = [picture.width, picture.height];
            ensure!(
                own == *size.get_or_insert(own),
                "{}: it has another size than {}, but all are of one camera",
                path.display(),
                self.pictures[0].display()
            );
            Ok(())
        };
        let mut read = |paths: &[PathBuf]| {
            let pictures = paths.iter().map(|path| {
                let mut picture = picture::read(path)?;
                check_size(path, &picture)?;
                picture.mark_saturated(self.saturation);
                Ok(picture.shrunk(MAX_SIDE))
            });
            pictures.collect::<anyhow::Result<Vec<_>>>()
        };
        let (mut pictures, mut whites) = (read(&self.pictures)?, read(&self.white)?);
        let (dark, chrome) = (read(self.dark.as_slice())?, read(&self.chrome)?);
        for (count, option) in [(whites.len(), "--white"), (chrome.len(), "--chrome")] {
            ensure!(
                count == 0 || count == pictures.len() || count == 1 && option == "--white",
                "{option}: give one picture for each photograph, in the same order"
            );
        }
        for picture in pictures.iter_mut().chain(&mut whites) {
            dark.iter().for_each(|dark| picture.subtract(dark));
        }
        let mask = self.mask.as_deref().map(|path| {
            let mask = picture::read_mask(path)?;
            check_size(path, &mask)?;
            anyhow::Ok(mask.shrunk(MAX_SIDE))
        });
        let mask = mask.transpose()?;
        let [width, height] = size.context("no picture")?;
        let block = LinearPicture::block([width, height], MAX_SIDE);
        let shrunk = |circle: Ball| {
            let [x, y] = circle.center.map(|side| (side + 0.5) / block as f64 - 0.5);
            Ball::distant([x, y, circle.radius / block as f64])
        };
        let find = |pictures: &[LinearPicture], what: &str| {
            let circle = self.circle.map(shrunk).or_else(|| Ball::find(pictures));
            circle.with_context(|| format!("no circle is found in {what}: give --circle"))
        };
        let outline = mask.as_ref().map_or(&pictures[..], std::slice::from_ref);
        let mut ball = find(outline, "the pictures or the mask")?;
        let camera = |angle| Camera::new(angle, width / block, height / block);
        ball.camera = self.field_of_view.map(camera);
        for (picture, mask) in pictures.iter_mut().zip(mask.iter().cycle()) {
            picture.mask(mask);
        }
        let name = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        let names: Vec<String> = self.pictures.iter().map(name).collect();
        let lights: Vec<Light> = match (&self.lights, self.chrome_circle.map(shrunk)) {
            (Some(table), _) => {
                let lights = Light::read_table(table)?;
                let light = |name: &String| {
                    let light = lights.get(name).copied();
                    let missing = || {
                        format!(
                            "{}: no row has the picture {name}: add its light",
                            table.display()
                        )
                    };
                    light.with_context(missing)
                };
                names.iter().map(light).collect::<anyhow::Result<_>>()?
            }
            (None, circle) => {
                let mut chrome_ball = circle.context("--chrome-circle is missing")?;
                chrome_ball.camera = ball.camera;
                let lights = chrome.iter().zip(&self.chrome).map(|(picture, path)| {
                    let direction = chrome_light(picture, &chrome_ball);
                    let direction = direction.with_context(|| path.display().to_string())?;
                    Light::new(direction, None).context("the light is behind the ball")
                });
                lights.collect::<anyhow::Result<_>>()?
            }
        };
        let is_ball = !whites.is_empty() && self.white_shape != Some(WhiteShape::Tile);
        let white_ball = is_ball.then(|| find(&whites, "--white")).transpose()?;
        let reflectance = self.white_reflectance.unwrap_or([0.99; 3]);
        let mut photographs = Vec::new();
        for (index, (picture, light)) in pictures.into_iter().zip(lights).enumerate() {
            let mut photograph = Photograph {
                name: names[index].clone(),
                picture,
                light,
                ball,
            };
            if let Some(white) = whites.get(index).or(whites.first()) {
                photograph.divide_by_white(white, white_ball.as_ref(), reflectance);
            }
            photographs.push(photograph);
        }
        Ok((photographs, block))
    }
}
