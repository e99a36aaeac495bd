//! Metrics of a fit: the loss in BRDF space, and DSSIM, L2, PSNR and color difference of a rendered sphere.

mod color;
pub(crate) mod image;

pub use color::color_differences;
use color::mean_ciede2000;
use glimpse_materials::lists::add_scaled;
use image::psnr;

use crate::render::{Picture, sphere_disc};

/// The metrics of one material, or their means over several.
///
/// All metrics except the loss compare rendered pictures. [`Evaluator`](crate::evaluation::Evaluator) renders pictures
/// of 128 x 128 pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Metrics {
    /// Mean cosine-weighted logarithmic error, 0 or more; 0 is best. See [`glimpse_materials::loss`].
    pub loss: f64,
    /// Structural dissimilarity of the spheres, in \[0, 1\]; 0 is best. See `image.rs`.
    pub dssim: f64,
    /// Mean squared error of the spheres, in \[0, 1\]; 0 is best.
    pub l2: f64,
    /// Peak signal-to-noise ratio of the spheres in dB, at most 100; higher is better.
    pub psnr: f64,
    /// Mean CIEDE2000 over the sphere's disc, 0 or more; 0 is best. See `color.rs`.
    pub delta_e: f64,
}

impl Metrics {
    /// Combines a loss with the errors of a sphere from [`render_sphere`](crate::render::render_sphere). DSSIM, L2 and
    /// PSNR include the whole picture, the color difference only the disc. Both pictures have the same size, at least 7 x 7.
    pub(crate) fn from_spheres(loss: f64, reference: &Picture, sphere: &Picture) -> Self {
        let l2 = image::mean_squared_error(reference, sphere);
        let disc = sphere_disc(sphere.width, sphere.height);
        Self {
            loss,
            dssim: (1.0 - image::ssim(reference, sphere)) / 2.0,
            l2,
            psnr: psnr(l2),
            delta_e: mean_ciede2000(reference, sphere, disc),
        }
    }

    /// Averages each metric over several scans of the same material; None for an empty list. The PSNR is that of the mean
    /// L2, because a mean of decibels would give too much weight to a single good scan.
    #[must_use]
    pub fn mean_of_repetitions(metrics: impl IntoIterator<Item = Self>) -> Option<Self> {
        Self::mean(metrics).map(|mean| Self {
            psnr: psnr(mean.l2),
            ..mean
        })
    }

    /// Averages each metric over several materials, including PSNR in dB; None for an empty list.
    #[must_use]
    pub fn mean(metrics: impl IntoIterator<Item = Self>) -> Option<Self> {
        let mut sums = [0.0; METRICS.len()];
        let mut count = 0.0;
        for metrics in metrics {
            add_scaled(&mut sums, 1.0, &metrics.values());
            count += 1.0;
        }
        (count > 0.0).then(|| Self::from_values(sums.map(|sum| sum / count)))
    }

    /// Creates metrics from values in the order of [`METRICS`].
    fn from_values([loss, dssim, l2, psnr, delta_e]: [f64; METRICS.len()]) -> Self {
        Self {
            loss,
            dssim,
            l2,
            psnr,
            delta_e,
        }
    }

    /// Returns the values in the order of [`METRICS`].
    #[must_use]
    pub fn values(&self) -> [f64; METRICS.len()] {
        [self.loss, self.dssim, self.l2, self.psnr, self.delta_e]
    }
}

/// A metric as a column of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricColumn {
    /// Title with the unit.
    pub title: &'static str,
    /// Digits after the decimal point.
    pub decimals: usize,
    /// True if a higher value is better.
    pub higher_is_better: bool,
}

impl MetricColumn {
    const fn lower_is_better(title: &'static str, decimals: usize) -> Self {
        Self {
            title,
            decimals,
            higher_is_better: false,
        }
    }
}

/// All metrics in the order of tables: the paper's four, and color difference.
pub const METRICS: [MetricColumn; 5] = [
    MetricColumn::lower_is_better("Loss", 4),
    MetricColumn::lower_is_better("DSSIM", 4),
    MetricColumn::lower_is_better("L2", 5),
    MetricColumn {
        title: "PSNR (dB)",
        decimals: 2,
        higher_is_better: true,
    },
    MetricColumn::lower_is_better("Delta E", 2),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn two_metrics() -> [Metrics; 2] {
        [[0.1, 0.2, 0.001, 30.0, 1.0], [0.3, 0.6, 0.1, 10.0, 4.0]].map(Metrics::from_values)
    }

    fn assert_close(metrics: Metrics, expected: [f64; 5]) {
        for (value, expected) in metrics.values().into_iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{metrics:?}");
        }
    }

    #[test]
    fn psnr_of_repetitions_is_psnr_of_mean_l2() {
        let mean = Metrics::mean(two_metrics()).unwrap();
        assert_close(mean, [0.2, 0.4, 0.0505, 20.0, 2.5]);
        let decibels = -10.0 * 0.0505_f64.log10();
        let repeated = Metrics::mean_of_repetitions(two_metrics()).unwrap();
        assert_close(repeated, [0.2, 0.4, 0.0505, decibels, 2.5]);
        let [single, _] = two_metrics();
        let repeated = Metrics::mean_of_repetitions([single]).unwrap();
        assert_close(repeated, single.values());
        assert_eq!(Metrics::mean([]), None);
        assert_eq!(Metrics::mean_of_repetitions([]), None);
    }
}
