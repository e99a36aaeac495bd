//! Tests of the whole renderer.

use std::f32::consts::{FRAC_1_PI, PI};

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::math;
use glimpse_fitting::photo::Light;
use glimpse_materials::Brdf;

use super::environment::Environment;
use super::quadrature::RINGS;
use super::sphere::{BACKGROUND, DIAMETER, circles, render_in};
use super::studio::STUDIO;
use super::{distant_ball, photograph, render_sphere};
use crate::metrics::image::{mean_squared_error, psnr};

/// A white Lambertian BRDF.
fn lambertian(_: &HalfDifference<f32>) -> [f32; 3] {
    [FRAC_1_PI; 3]
}

/// A microfacet BRDF (GGX with shadowing) over a dark base; nearly a mirror for small alpha.
fn glossy(alpha: f32) -> impl Fn(&HalfDifference<f32>) -> [f32; 3] + Sync {
    move |at| {
        let alpha_squared = alpha * alpha;
        let slope = at.hz * at.hz * (alpha_squared - 1.0) + 1.0;
        let distribution = alpha_squared / (PI * slope * slope);
        let shadowing =
            |cos: f32| cos + math::sqrt(alpha_squared + (1.0 - alpha_squared) * cos * cos);
        let (incoming, outgoing) = (at.cos_theta_i(), at.cos_theta_o());
        let lobe = distribution / (shadowing(incoming) * shadowing(outgoing));
        [0.9 * lobe + 0.02, 0.8 * lobe + 0.01, 0.5 * lobe]
    }
}

#[test]
fn white_sphere_equals_constant_environment() {
    let image = render_in(&Environment::from_fn(|_| [1.0; 3]), &lambertian, 65, RINGS);
    let on_sphere = circles(65)
        .into_iter()
        .filter(|circle| circle.coverage == 1.0);
    for (index, _) in on_sphere.flat_map(|circle| circle.pixels) {
        for channel in image.pixels[index] {
            assert!((channel - 1.0).abs() < 2e-3, "pixel {index}: {channel}");
        }
    }
    assert_eq!(image.pixels[0], BACKGROUND);
}

#[test]
fn mirror_reflects_environment() {
    // The lobe integrates to 1, so a narrow lobe returns the environment itself. Each channel increases along one
    // axis of the picture.
    let environment = Environment::from_fn(|direction| direction.map(|c| 2.0 + c));
    let mirror = |at: &HalfDifference<f32>| [(glossy(0.03)(at)[0] - 0.02) / 0.9; 3];
    let size = 65;
    let image = render_in(&environment, &mirror, size, RINGS);
    let radius = 0.5 * DIAMETER * size as f32;
    for (right, up) in [(0.0, 0.0), (0.3, 0.0), (-0.2, 0.5), (0.4, -0.5)] {
        let pixel = |offset: f32| (0.5 * size as f32 + offset * radius) as usize;
        let (column, row) = (pixel(right), pixel(-up));
        let centered = |index: usize| (index as f32 + 0.5 - 0.5 * size as f32) / radius;
        let (x, y) = (centered(column), -centered(row));
        let z = (1.0 - x * x - y * y).sqrt();
        // The viewer's direction (0, 0, 1), reflected about the normal (x, y, z).
        let mirrored = [2.0 * z * x, 2.0 * z * y, 2.0 * z * z - 1.0];
        let pixel = image.pixels[row * size + column];
        for (channel, expected) in pixel.iter().zip(mirrored.map(|c| 2.0 + c)) {
            assert!(
                (channel - expected).abs() < 0.03,
                "at ({x}, {y}): {channel} instead of {expected}"
            );
        }
    }
}

#[test]
fn studio_rendering_converges_in_rings() {
    let materials: [&dyn Brdf; 4] = [&lambertian, &glossy(0.01), &glossy(0.06), &glossy(0.3)];
    let [coarse, fine] = [RINGS, 2 * RINGS]
        .map(|rings| materials.map(|brdf| render_in(&STUDIO, brdf, 48, rings).tone_map()));
    let distance = |a, b| psnr(mean_squared_error(a, b));
    for (index, (coarse_a, fine_a)) in coarse.iter().zip(&fine).enumerate() {
        let error = distance(coarse_a, fine_a);
        assert!(
            error > 55.0,
            "material {index} is {error} dB from the finer picture"
        );
        for (coarse_b, fine_b) in coarse.iter().zip(&fine).take(index) {
            let change = distance(coarse_a, coarse_b) - distance(fine_a, fine_b);
            assert!(change.abs() < 0.05, "material {index}: {change} dB");
        }
    }
}

#[test]
fn rendering_handles_invalid_brdfs_and_is_deterministic() {
    let invalid = |_: &HalfDifference<f32>| [f32::NAN, f32::INFINITY, -1.0];
    for size in [0, 1, 2, 5] {
        let image = render_sphere(&invalid, size);
        assert_eq!(image.pixels.len(), size * size);
        let _ = image.tone_map();
    }
    let [first, second] = [0; 2].map(|_| render_sphere(&glossy(0.1), 16));
    assert_eq!(first, second);
}

#[test]
fn photograph_of_white_ball_has_known_flux() {
    let ball = distant_ball(64);
    // With 90 degrees between light and camera, the flux of a Lambertian ball is 1 / pi of that at 0 degrees.
    for (direction, share) in [([0.0, 0.0, 1.0], 1.0), ([0.0, 1.0, 0.0], FRAC_1_PI)] {
        let intensity = Some([1.0, 2.0, 4.0]);
        let image = photograph(
            &lambertian,
            &ball,
            &Light {
                direction,
                intensity,
            },
            [64; 2],
            4,
        );
        for (channel, intensity) in [1.0, 2.0, 4.0].into_iter().enumerate() {
            let flux: f32 = image.pixels.iter().map(|pixel| pixel[channel]).sum();
            let expected = intensity * share * (ball.radius * ball.radius) as f32 * 2.0 / 3.0;
            assert!((flux / expected - 1.0).abs() < 2e-3, "{flux} {expected}");
        }
    }
}
