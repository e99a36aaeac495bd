//! The paper's published values, printed next to ours.

use glimpse_core::model::ModelKind;

use super::case::Approach;

/// Loss, DSSIM, L2 and PSNR.
pub(super) type PaperMetrics = [f64; 4];

const fn published(loss: f64, dssim: f64, l2: f64, psnr: f64) -> Option<PaperMetrics> {
    Some([loss, dssim, l2, psnr])
}

/// Number of MERL materials in the paper's test set.
pub(super) const MATERIALS: usize = 20;

/// Returns means over MERL's 20 test materials at n = 8 (table "SameSampleCount").
pub(super) fn same_samples(model: ModelKind, approach: Approach) -> Option<PaperMetrics> {
    use Approach::{Meta, Njr15, Paper, Random};
    use ModelKind::{CookTorrance, Linear, Neural, Phong};
    match (model, approach) {
        (Phong, Random) => published(0.085, 0.103, 0.093, 12.54),
        (Phong, Meta) => published(0.084, 0.068, 0.026, 18.82),
        (Phong, Paper) => published(0.044, 0.034, 0.006, 24.51),
        (CookTorrance, Random) => published(0.098, 0.123, 0.124, 10.75),
        (CookTorrance, Meta) => published(0.044, 0.039, 0.007, 24.21),
        (CookTorrance, Paper) => published(0.039, 0.029, 0.003, 27.09),
        (Linear, Random) => published(0.028, 0.029, 0.007, 23.49),
        (Linear, Njr15) => published(0.016, 0.012, 0.002, 28.45),
        (Linear, Paper) => published(0.011, 0.009, 0.001, 33.70),
        (Neural, Random) => published(0.065, 0.105, 0.067, 13.38),
        (Neural, Meta) => published(0.059, 0.125, 0.052, 15.23),
        (Neural, Paper) => published(0.035, 0.033, 0.005, 27.50),
        _ => None,
    }
}

/// Returns the number of samples that a method needs to match the quality of its own method at n = 8, divided by 8, for Loss,
/// DSSIM, L2 and PSNR (table "SameQuality"; 1e5 is the paper's "10^5").
pub(super) fn same_quality(model: ModelKind, approach: Approach) -> Option<[f64; 4]> {
    match (model, approach) {
        (_, Approach::Random) => Some([1e5; 4]),
        (ModelKind::Phong, Approach::Meta) => Some([48.0, 37.5, 24.0, 8.0]),
        (ModelKind::CookTorrance, Approach::Meta) => Some([8.0, 64.0, 64.0, 64.0]),
        (ModelKind::Linear, Approach::Njr15) => Some([8.0, 3.0, 3.0, 4.0]),
        (ModelKind::Neural, Approach::Meta) => Some([4.0, 6.0, 8.0, 6.5]),
        _ => None,
    }
}

/// Returns means over the eight materials of Nielsen et al. for Linear at n = 2 (table "Nielsen").
pub(super) fn nielsen(approach: Approach) -> Option<PaperMetrics> {
    match approach {
        Approach::Njr15 => published(0.023, 0.128, 0.003, 26.28),
        Approach::Paper => published(0.018, 0.009, 0.002, 30.02),
        _ => None,
    }
}

/// Returns means over the isotropic part of the RGL database at n = 8 (table "RGLeval").
pub(super) fn rgl(model: ModelKind, approach: Approach) -> Option<PaperMetrics> {
    use Approach::{Meta, Njr15, Paper};
    use ModelKind::{CookTorrance, Linear, Neural, Phong};
    match (model, approach) {
        (Phong, Meta) => published(0.095, 0.070, 0.025, 17.980),
        (Phong, Paper) => published(0.044, 0.040, 0.009, 22.686),
        (CookTorrance, Meta) => published(0.068, 0.059, 0.026, 17.824),
        (CookTorrance, Paper) => published(0.067, 0.051, 0.009, 21.563),
        (Linear, Njr15) => published(0.050, 0.068, 0.025, 21.897),
        (Linear, Paper) => published(0.030, 0.041, 0.016, 23.849),
        (Neural, Meta) => published(0.074, 0.168, 0.110, 12.228),
        (Neural, Paper) => published(0.044, 0.062, 0.011, 21.889),
        _ => None,
    }
}

/// Returns the increase of the loss in percent with 2 and 4 of 8 learned samples replaced by random ones (table
/// "robustness").
pub(super) fn robustness(model: ModelKind) -> [f64; 2] {
    match model {
        ModelKind::Phong => [8.3, 12.6],
        ModelKind::CookTorrance => [6.9, 10.5],
        ModelKind::Linear => [13.9, 21.4],
        ModelKind::Neural => [7.3, 14.2],
        _ => [f64::NAN; 2], // not in the paper
    }
}

/// Returns the loss after 20 steps and 10,000 more on 512 random samples each ("Convergence").
pub(super) fn convergence(approach: Approach) -> Option<f64> {
    match approach {
        Approach::Random => Some(0.0117),
        Approach::Meta => Some(0.0067),
        Approach::Paper => Some(0.0065),
        _ => None,
    }
}

/// Returns the decrease of the loss in percent after both stages are repeated ("Convergence").
pub(super) fn repeated_stages(model: ModelKind) -> Option<f64> {
    match model {
        ModelKind::Phong => Some(0.9),
        ModelKind::Neural => Some(2.86),
        _ => None,
    }
}
