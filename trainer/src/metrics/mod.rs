//! The paper's four metrics: Loss in BRDF space, and DSSIM, L2 and PSNR of a rendered sphere.

pub mod image;
pub mod loss;

pub use image::{CompareError, PictureErrors, psnr};
pub use loss::mean_log_error;

/// The four metrics of one material, or their means over several.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Scores {
    /// Mean cosine-weighted logarithmic error; 0 is best. See [`loss`].
    pub loss: f64,
    /// Structural dissimilarity of the spheres, in \[0, 1\]; 0 is best. See [`mod@image`].
    pub dssim: f64,
    /// Mean squared error of the spheres, in \[0, 1\]; 0 is best.
    pub l2: f64,
    /// Peak signal-to-noise ratio of the spheres in dB, at most 100; more is better.
    pub psnr: f64,
}

impl Scores {
    /// The loss and the errors of the sphere together.
    #[must_use]
    pub fn new(loss: f64, sphere: PictureErrors) -> Self {
        let PictureErrors { dssim, l2, psnr } = sphere;
        Self {
            loss,
            dssim,
            l2,
            psnr,
        }
    }

    /// Several scans of the same material: the mean of each metric, and as PSNR that of the mean L2.
    /// (A mean of decibels would praise a method for the luck of one scan.) None of nothing.
    #[must_use]
    pub fn of_repetitions(scores: impl IntoIterator<Item = Self>) -> Option<Self> {
        Self::mean(scores).map(|mean| Self {
            psnr: psnr(mean.l2),
            ..mean
        })
    }

    /// Several materials: the mean of each metric (PSNR averaged in dB); None of nothing.
    #[must_use]
    pub fn mean(scores: impl IntoIterator<Item = Self>) -> Option<Self> {
        let mut sum = Self::default();
        let mut count = 0.0;
        for scores in scores {
            sum.loss += scores.loss;
            sum.dssim += scores.dssim;
            sum.l2 += scores.l2;
            sum.psnr += scores.psnr;
            count += 1.0;
        }
        (count > 0.0).then(|| Self {
            loss: sum.loss / count,
            dssim: sum.dssim / count,
            l2: sum.l2 / count,
            psnr: sum.psnr / count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> [Scores; 2] {
        let one = PictureErrors {
            dssim: 0.2,
            l2: 0.001,
            psnr: 30.0,
        };
        let other = PictureErrors {
            dssim: 0.6,
            l2: 0.1,
            psnr: 10.0,
        };
        [Scores::new(0.1, one), Scores::new(0.3, other)]
    }

    fn assert_are(scores: Scores, expected: [f64; 4]) {
        let Scores {
            loss,
            dssim,
            l2,
            psnr,
        } = scores;
        for (value, expected) in [loss, dssim, l2, psnr].into_iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{scores:?}");
        }
    }

    #[test]
    fn materials_are_averaged_metric_by_metric() {
        assert_are(Scores::mean(two()).unwrap(), [0.2, 0.4, 0.0505, 20.0]);
        assert_eq!(Scores::mean([]), None);
    }

    #[test]
    fn the_psnr_of_repetitions_is_that_of_their_mean_error() {
        let decibels = -10.0 * 0.0505_f64.log10();
        let mean = Scores::of_repetitions(two()).unwrap();
        assert_are(mean, [0.2, 0.4, 0.0505, decibels]);
        let [once, _] = two();
        assert_are(
            Scores::of_repetitions([once]).unwrap(),
            [0.1, 0.2, 0.001, 30.0],
        );
        assert_eq!(Scores::of_repetitions([]), None);
    }
}
