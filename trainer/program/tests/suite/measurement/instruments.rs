//! Tables of the displays of instruments, and readings in CIELAB.

use std::f64::consts::PI;

use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    NamedRecipe, ReadingQuantity, ReadingRows, Readings, TableArgs,
};
use glimpse_materials::{Illuminant, Lab, Observer, Viewing};

use super::rows;

const ALBEDO: [f64; 3] = [0.30, 0.12, 0.05];
/// The luminance of [`ALBEDO`].
const GRAY: f64 = 0.153_214;
/// The displays of a matte material. Its gloss is that of a perfect white, 1.2028, 2.4901 and 0.03274, times its luminance: the
/// receptor's solid angle times cos(theta) / (pi R), with the reflectance R of black glass.
const MATTE: &str = "Device,theta_i,theta_o,r,g,b,value,spread_i (deg),spread_o|Gloss 20,,,,,,0.184286,,|gloss60,,,,,,0.381518,,|\
    GLOSS_85,,,,,,0.0050162,,|sci,,,30,12,5,,,|SCE,,,30,12,5,,,|45:00,,,30,12,5,,,|0/45,,,30,12,5,,,|,45,60,30,12,5,,3,12|\
    multi-angle,45,0,30,12,5,,,|,45,-30,30,12,5,,,|sci,,,,,,15.3214,,|gloss-60,,,,,,,,|";

fn table(text: &str) -> ReadingRows {
    rows(&text.replace('|', "\n"), &TableArgs::default()).expect("the file is read")
}

fn readings(rows: ReadingRows) -> Readings {
    let quantity = ReadingQuantity::of_values(None, None, &rows).expect("a quantity");
    Readings::new(&NamedRecipe::any(ModelKind::Linear), rows, quantity).expect("valid readings")
}

/// Asserts that BRDFs are those of albedos, within 0.5 %.
fn assert_near(brdf: &[f32], albedo: [f64; 3]) {
    let mut pairs = brdf.iter().zip(albedo);
    let is_near = pairs.all(|(brdf, albedo)| (f64::from(*brdf) * PI / albedo - 1.0).abs() < 0.005);
    assert!(is_near, "{brdf:?} {albedo:?}");
}

#[test]
fn displays_of_a_matte_material_are_its_albedo() {
    let readings = readings(table(MATTE));
    let apertures = readings.recipe.apertures.iter().flatten();
    let gray = apertures.map(|aperture| aperture.is_gray);
    assert!(gray.eq((0..8).map(|index| index < 3)));
    assert_eq!(readings.samples[7].optics.spread, [3.0, 12.0]);
    for (index, sample) in readings.samples.iter().enumerate() {
        let expected = match index {
            0..3 => [GRAY; 3],
            // The mean of two rows.
            3 => ALBEDO.map(|albedo| 0.5 * (albedo + GRAY)),
            _ => ALBEDO,
        };
        assert_near(&sample.brdf.mean().expect("a reading"), expected);
    }
    let text = "instrument,450nm,550nm,650nm,value|sci,10,20,30,|gloss-60,,,,2.4901|";
    let samples = self::readings(table(text)).samples;
    assert_near(&samples[0].bands, [0.1, 0.2, 0.3]);
    assert_near(&samples[1].bands, [1.0; 3]);
}

#[test]
fn cielab_is_read_by_illuminant_and_observer() {
    let illuminant = Illuminant::D50;
    let observer = Observer::Cie1931;
    let print = Viewing {
        illuminant,
        observer,
    };
    // CIELAB of the albedo, adapted by Bradford: as colorimeters show it, and in print.
    for (lab, viewing) in [
        ("46.082,17.396,27.827", None),
        ("46.419,18.906,28.268", Some(print)),
    ] {
        let mut rows = table(&format!(
            "device,theta_i,theta_o,L,a,b,value|,45,0,{lab},|gloss-60,,,,,,2.4901|"
        ));
        rows.cielab = viewing.or(rows.cielab);
        let samples = readings(rows).samples;
        assert_near(&samples[0].brdf.mean().expect("a reading"), ALBEDO);
        assert_near(&samples[1].brdf.mean().expect("a reading"), [1.0; 3]);
    }
    // Published values of the red of sRGB.
    let [l, a, b] = [54.29, 80.81, 69.89];
    let red = print.rgb_of_lab(Lab { l, a, b });
    assert!((red[0] - 1.0).abs().max(red[1].abs()).max(red[2].abs()) < 0.003);
}
