//! The paper's published values, shown next to ours.

use glimpse_core::model::ModelKind::{self, CookTorrance, Linear, Neural, Phong};

use super::case::Approach::{self, Baseline, Paper, Random};
use super::case::Variation::{self, Refined, Replaced, Twice};
use super::case::{Case, SAMPLES};

/// Values of a case: Loss, DSSIM, L2 and PSNR, and the increase of the loss by a variation in percent; NaN if the paper does
/// not state one.
pub(super) type Published = (Case, [f64; 4], f64);

const fn of(approach: Approach, model: ModelKind, metrics: [f64; 4]) -> Published {
    (Case::new(approach, model, SAMPLES), metrics, f64::NAN)
}

const fn linear_n2(approach: Approach, metrics: [f64; 4]) -> Published {
    (Case::new(approach, Linear, 2), metrics, f64::NAN)
}

const fn increase(model: ModelKind, variation: Variation, percent: f64) -> Published {
    let case = Case::new(Paper, model, SAMPLES);
    (case.with(variation), [f64::NAN; 4], percent)
}

const fn refined(approach: Approach, loss: f64) -> Published {
    let case = Case::new(approach, Neural, 0).with(Refined);
    (case, [loss, f64::NAN, f64::NAN, f64::NAN], f64::NAN)
}

/// Means over MERL's 20 test materials at n = 8 (table "SameSampleCount").
pub(super) const SAME_SAMPLES: &[Published] = &[
    of(Random, Phong, [0.085, 0.103, 0.093, 12.54]),
    of(Baseline, Phong, [0.084, 0.068, 0.026, 18.82]),
    of(Paper, Phong, [0.044, 0.034, 0.006, 24.51]),
    of(Random, CookTorrance, [0.098, 0.123, 0.124, 10.75]),
    of(Baseline, CookTorrance, [0.044, 0.039, 0.007, 24.21]),
    of(Paper, CookTorrance, [0.039, 0.029, 0.003, 27.09]),
    of(Random, Linear, [0.028, 0.029, 0.007, 23.49]),
    of(Baseline, Linear, [0.016, 0.012, 0.002, 28.45]),
    of(Paper, Linear, [0.011, 0.009, 0.001, 33.70]),
    of(Random, Neural, [0.065, 0.105, 0.067, 13.38]),
    of(Baseline, Neural, [0.059, 0.125, 0.052, 15.23]),
    of(Paper, Neural, [0.035, 0.033, 0.005, 27.50]),
];

/// The number of samples that a method needs to match the quality of the paper's at n = 8, divided by 8 (table
/// "SameQuality"; 1e5 is the paper's "10^5").
pub(super) const SAME_QUALITY: &[Published] = &[
    of(Random, Phong, [1e5; 4]),
    of(Baseline, Phong, [48.0, 37.5, 24.0, 8.0]),
    of(Random, CookTorrance, [1e5; 4]),
    of(Baseline, CookTorrance, [8.0, 64.0, 64.0, 64.0]),
    of(Random, Linear, [1e5; 4]),
    of(Baseline, Linear, [8.0, 3.0, 3.0, 4.0]),
    of(Random, Neural, [1e5; 4]),
    of(Baseline, Neural, [4.0, 6.0, 8.0, 6.5]),
];

/// Means over the eight materials of Nielsen et al. at n = 2 (table "Nielsen"), and over the isotropic part of the RGL
/// database at n = 8 (table "RGLeval").
pub(super) const ADDITIONAL: &[Published] = &[
    linear_n2(Baseline, [0.023, 0.128, 0.003, 26.28]),
    linear_n2(Paper, [0.018, 0.009, 0.002, 30.02]),
    of(Baseline, Phong, [0.095, 0.070, 0.025, 17.980]),
    of(Paper, Phong, [0.044, 0.040, 0.009, 22.686]),
    of(Baseline, CookTorrance, [0.068, 0.059, 0.026, 17.824]),
    of(Paper, CookTorrance, [0.067, 0.051, 0.009, 21.563]),
    of(Baseline, Linear, [0.050, 0.068, 0.025, 21.897]),
    of(Paper, Linear, [0.030, 0.041, 0.016, 23.849]),
    of(Baseline, Neural, [0.074, 0.168, 0.110, 12.228]),
    of(Paper, Neural, [0.044, 0.062, 0.011, 21.889]),
];

/// Learned samples replaced by random ones (table "robustness").
pub(super) const ROBUSTNESS: &[Published] = &[
    increase(Phong, Replaced(2, 0), 8.3),
    increase(Phong, Replaced(4, 0), 12.6),
    increase(CookTorrance, Replaced(2, 0), 6.9),
    increase(CookTorrance, Replaced(4, 0), 10.5),
    increase(Linear, Replaced(2, 0), 13.9),
    increase(Linear, Replaced(4, 0), 21.4),
    increase(Neural, Replaced(2, 0), 7.3),
    increase(Neural, Replaced(4, 0), 14.2),
];

/// Both stages repeated ("Convergence").
pub(super) const REPEATED_STAGES: &[Published] =
    &[increase(Phong, Twice, -0.9), increase(Neural, Twice, -2.86)];

/// 20 steps, and 10,000 more on 512 random samples each ("Convergence").
pub(super) const CONVERGENCE: &[Published] = &[
    refined(Random, 0.0117),
    refined(Baseline, 0.0067),
    refined(Paper, 0.0065),
];
