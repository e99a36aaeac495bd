//! Fits with one reading ten times too large: the residual, and the exclusion of the reading.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_fitting::measurement::{NamedRecipe, OutlierReport};
use glimpse_kernels::scan::{scan, scan_with_missing};
use glimpse_materials::loss::{loss_directions, mean_log_error};
use glimpse_materials::{Brdf, FittedBrdf, Procedural};
use glimpse_training::linear::PosteriorReading;

const NEURAL: &[u8] = include_bytes!("../../../recipes/paper/neural-n8.recipe");
const LINEAR: &[u8] = include_bytes!("../../../recipes/paper/linear-n8.recipe");

/// Fits readings and returns the residual.
fn fit(recipe: &Recipe<'_>, readings: &[[f32; 3]]) -> Residual {
    let mut readings = readings.iter();
    let outcome = scan(recipe, &mut |_| *readings.next().unwrap()).unwrap();
    outcome.residual
}

/// Multiplies each reading of 100 unseen materials in turn by 10. Returns how many of these 800 outliers raise the
/// residual, double it, and are its worst sample.
fn tally(recipe: &[u8]) -> [usize; 3] {
    let recipe = Recipe::parse(recipe).unwrap();
    let mut tally = [0; 3];
    for index in 0..100 {
        let material = Procedural::new(index, 0xFEED);
        let directions: Vec<_> = recipe.pattern().map(HalfDifference::from_angles).collect();
        let mut readings = vec![[0.0; 3]; directions.len()];
        material.evaluate(&directions, &mut readings);
        let correct_residual = fit(&recipe, &readings);
        for outlier in 0..readings.len() {
            let mut readings = readings.clone();
            readings[outlier] = readings[outlier].map(|value| 10.0 * value);
            let residual = fit(&recipe, &readings);
            tally[0] += usize::from(residual.mean > correct_residual.mean);
            tally[1] += usize::from(residual.mean > 2.0 * correct_residual.mean);
            tally[2] += usize::from(usize::from(residual.worst_index) == outlier);
        }
    }
    tally
}

/// The residual rises with most outliers. Linear's ridge solve follows outliers more than Neural's descent does.
#[test]
fn outliers_raise_residual() {
    // Measured with Neural: 797 of 800 raise it, 679 double it, 747 are its worst sample. Linear: 738, 437 and 507.
    for (recipe, bounds) in [(NEURAL, [790, 670, 740]), (LINEAR, [730, 430, 500])] {
        let tally = tally(recipe);
        println!("{tally:?}");
        assert!(
            (0..3).all(|index| tally[index] > bounds[index]),
            "{tally:?}"
        );
    }
}

const MASKED: [&[u8]; 3] = [
    include_bytes!("../../../recipes/masked/neural-n16.recipe"),
    include_bytes!("../../../recipes/masked/phong-n16.recipe"),
    include_bytes!("../../../recipes/masked/cook-torrance-n16.recipe"),
];

/// With nothing wrong, the exclusion costs at most 5 % of the loss. With a reading ten times too large, the loss is at
/// most 15 % above that of excluding exactly this reading.
#[test]
fn exclusion_of_one_reading_pays() {
    let at = loss_directions();
    for bytes in MASKED {
        let recipe = Recipe::parse(bytes).unwrap();
        let linear = NamedRecipe::bundled(ModelKind::Linear).unwrap();
        let prior = linear.at(&[], &[]).unwrap().prior;
        let find_outliers = |readings: &[Option<[f32; 3]>]| {
            let readings = recipe.pattern().zip(readings);
            let readings =
                readings.map(|(angles, brdf)| Some(PosteriorReading::new(angles, (*brdf)?)));
            OutlierReport::new(&prior, &readings.collect::<Vec<_>>())
        };
        let [mut all, mut default, mut exact, mut excluded] = [0.0; 4];
        let mut correct = [0.0; 2];
        for index in 0..25 {
            let material = Procedural::new(index, 0xFEED);
            let mut values = vec![[0.0; 3]; at.len()];
            material.evaluate(&at, &mut values);
            let loss = |readings: &[Option<[f32; 3]>], without: Option<usize>| {
                let outcome = scan_with_missing(&recipe, &mut |sample, _| {
                    let sample = usize::from(sample);
                    readings[sample].filter(|_| Some(sample) != without)
                });
                let fitted = FittedBrdf::new(recipe.model(), outcome.unwrap().values, None);
                mean_log_error(&fitted.unwrap(), &at, &values)
            };
            let readings: Vec<Option<[f32; 3]>> = recipe
                .pattern()
                .map(|angles| Some(material.at_angles(angles)))
                .collect();
            let report = find_outliers(&readings);
            correct[0] += loss(&readings, None);
            correct[1] += loss(&readings, report.excluded);
            for wrong in 0..readings.len() {
                let mut readings = readings.clone();
                readings[wrong] = readings[wrong].map(|rgb| rgb.map(|value| 10.0 * value));
                let report = find_outliers(&readings);
                all += loss(&readings, None);
                default += loss(&readings, report.excluded);
                exact += loss(&readings, Some(wrong));
                excluded += f64::from(u8::from(report.excluded == Some(wrong)));
            }
        }
        println!(
            "{}: correct readings {:.3} of the loss with all; one wrong {:.3} of that without it, {:.3} with all; \
             excluded {excluded} of 400",
            recipe.model(),
            correct[1] / correct[0],
            default / exact,
            all / exact
        );
        assert!(correct[1] <= 1.05 * correct[0]);
        assert!(default <= 1.15 * exact);
    }
}
