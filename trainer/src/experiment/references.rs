//! The loss of a test set without any measurement.

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::Material;
use glimpse_materials::loss::directions;
use rayon::prelude::*;

/// Returns two mean losses over materials: of black (f = 0), and of the best Lambertian BRDF for each material and
/// channel.
pub(super) fn losses_without_measurement(materials: &[Box<dyn Material>]) -> [f64; 2] {
    let losses: Vec<[f64; 2]> = materials
        .par_iter()
        .map(|material| losses_of(&**material))
        .collect();
    [0, 1].map(|index| {
        let sum: f64 = losses.iter().map(|losses| losses[index]).sum();
        sum / losses.len().max(1) as f64
    })
}

/// Returns the losses of one material, averaged over the channels.
fn losses_of(material: &dyn Material) -> [f64; 2] {
    let at: Vec<HalfDifference<f32>> = directions()
        .into_iter()
        .map(HalfDifference::from_angles)
        .collect();
    let mut values = vec![[0.0; 3]; at.len()];
    material.brdf_batch(&at, &mut values);
    let (mut black, mut best) = (0.0, 0.0);
    for channel in 0..3 {
        let samples = at.iter().zip(&values);
        let samples: Vec<[f64; 2]> = samples
            .map(|(at, value)| [value[channel], at.cos_theta_i()].map(f64::from))
            .collect();
        black += lambertian_loss(&samples, 0.0) / 3.0;
        best += best_lambertian_loss(&samples) / 3.0;
    }
    [black, best]
}

/// Returns the loss of a constant BRDF on pairs of value and cosine.
fn lambertian_loss(samples: &[[f64; 2]], constant: f64) -> f64 {
    let error =
        |[value, cosine]: &[f64; 2]| ((value * cosine).ln_1p() - (constant * cosine).ln_1p()).abs();
    samples.iter().map(error).sum::<f64>() / samples.len().max(1) as f64
}

/// Returns the minimum loss of all constants between 1e-4 and 10, by a logarithmic grid search with three refinements.
fn best_lambertian_loss(samples: &[[f64; 2]]) -> f64 {
    let (mut center, mut reach, mut best) = (-1.5, 2.5, f64::INFINITY);
    for _ in 0..4 {
        let begin = center - reach;
        for step in 0..=40 {
            let exponent = begin + reach * f64::from(step) / 20.0;
            let loss = lambertian_loss(samples, 10f64.powf(exponent));
            if loss < best {
                (best, center) = (loss, exponent);
            }
        }
        reach /= 10.0;
    }
    best
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::Angles;

    use super::*;

    /// A material with a constant BRDF in each channel.
    struct Diffuse([f32; 3]);

    impl Material for Diffuse {
        fn name(&self) -> &str {
            "diffuse"
        }

        fn brdf(&self, _: Angles<f32>) -> [f32; 3] {
            self.0
        }

        fn brdf_with_derivative(&self, _: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
            (self.0, [[0.0; 3]; 3])
        }
    }

    #[test]
    fn best_lambertian_fits_lambertian_material() {
        let [black, best] = losses_of(&Diffuse([0.3, 0.02, 4.0]));
        assert!(best < 1e-4, "{best}");
        let at = directions();
        let count = at.len() as f64;
        let cosines = at
            .into_iter()
            .map(|angles| f64::from(HalfDifference::from_angles(angles).cos_theta_i()));
        let loss = cosines.map(|cosine| {
            let channels = [0.3, 0.02, 4.0].map(|f: f64| (f * cosine).ln_1p());
            channels.iter().sum::<f64>() / 3.0
        });
        let expected = loss.sum::<f64>() / count;
        assert!((black - expected).abs() < 1e-6, "{black} {expected}");
    }

    #[test]
    fn best_lambertian_of_two_values() {
        let samples = [[0.1, 1.0], [0.4, 1.0], [0.1, 1.0], [0.4, 1.0]];
        let expected = (1.4_f64.ln() - 1.1_f64.ln()) / 2.0;
        assert!((best_lambertian_loss(&samples) - expected).abs() < 1e-6);
    }
}
