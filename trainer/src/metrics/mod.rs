//! The paper's four metrics: Loss in BRDF space, and DSSIM, L2 and PSNR of a rendered sphere.

pub mod image;
pub mod loss;

pub use image::{CompareError, PictureErrors};
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

    /// The mean of each metric (PSNR averaged in dB); None of nothing.
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

    #[test]
    fn a_mean_is_taken_metric_by_metric() {
        let one = Scores::new(
            0.1,
            PictureErrors {
                dssim: 0.2,
                l2: 0.3,
                psnr: 30.0,
            },
        );
        let two = Scores::new(
            0.3,
            PictureErrors {
                dssim: 0.6,
                l2: 0.5,
                psnr: 20.0,
            },
        );
        let mean = Scores::mean([one, two]).unwrap();
        for (value, expected) in [
            (mean.loss, 0.2),
            (mean.dssim, 0.4),
            (mean.l2, 0.4),
            (mean.psnr, 25.0),
        ] {
            assert!((value - expected).abs() < 1e-12);
        }
        assert_eq!(Scores::mean([]), None);
    }
}
