//! The outline of a ball in pictures.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ball::Ball;
use super::picture::LinearPicture;

/// The exponent by which light is compressed, so that the limb is steep where the light is low, too.
const GAMMA: f32 = 1.0 / 2.2;
/// The least light of the surface in all channels, of full scale. Below it, the limb of a mirror may be darker than a level of the
/// sensor.
const MIN_LIGHT: f32 = 0.0012;
/// The compressed light from which on a pixel is not background: the lowest are those of dark materials with a highlight.
const BRIGHT: [f64; 4] = [0.2, 0.1, 0.05, 0.02];
/// The number of circles through three points that are tried at each of them.
const TRIALS: usize = 500;
/// The distance from the circle within which points belong to it, in pixels, from step to step.
const TOLERANCES: [f64; 5] = [2.0, 1.0, 0.7, 0.7, 0.7];
/// The smallest share of the bright part's boundary on the circle, and the smallest number of degrees with a rim.
const MIN_SHARE: f64 = 0.35;
const MIN_ARC: usize = 120;
/// The smallest fall of light per pixel at a bright limb, as a share of the light of the surface.
const SHARP: f64 = 0.15;

/// Returns the larger light of several pictures, compressed: minus that of the background, relative to that of the surface, from
/// 0 to 1.
fn brightest(pictures: &[LinearPicture]) -> Option<LinearPicture> {
    let mut brightest = pictures.first()?.clone();
    brightest.pixels.fill([0.0; 3]);
    for picture in pictures {
        let light = |pixel: &[f32; 3]| pixel.iter().sum::<f32>();
        let lights = picture.pixels.iter().map(light);
        let mut sorted: Vec<f32> = lights.filter(|light| light.is_finite()).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let percentile = |percent: usize| sorted.get(sorted.len() * percent / 100).copied();
        let (dark, light_of_surface) = (percentile(10)?, percentile(98)? - percentile(10)?);
        if light_of_surface < MIN_LIGHT {
            continue;
        }
        for (own, pixel) in brightest.pixels.iter_mut().zip(&picture.pixels) {
            // Highlights count as surface.
            let light = ((light(pixel) - dark) / light_of_surface).clamp(0.0, 1.0);
            *own = own.map(|own| own.max(light.powf(GAMMA)));
        }
    }
    Some(brightest)
}

/// Returns the pixels brighter than a level that have a darker neighbor.
fn boundary(picture: &LinearPicture, level: f64) -> Vec<[f64; 2]> {
    let points = (0..picture.pixels.len()).map(|index| picture.place(index));
    let light = |x: f64, y: f64| picture.at([x, y])[0];
    let on_boundary = points.filter(|&[x, y]| {
        let neighbors = [-1.0, 1.0].map(|step| light(x + step, y).min(light(x, y + step)));
        light(x, y) > level && neighbors[0].min(neighbors[1]) <= level
    });
    on_boundary.collect()
}

/// Returns the points along the radii of a circle where light falls most steeply outward, and how much it falls per pixel.
fn falls(picture: &LinearPicture, circle: &Ball) -> Vec<([f64; 2], f64)> {
    let falls = (0..360).filter_map(|degree| {
        let (sin, cos) = f64::from(degree).to_radians().sin_cos();
        let [x, y] = circle.center;
        let place = |step: f64| {
            let distance = circle.radius + 0.25 * step;
            [x + distance * cos, y + distance * sin]
        };
        let fall = |step: i32| {
            let [inside, outside] =
                [-2.0, 2.0].map(|half| picture.at(place(f64::from(step) + half))[0]);
            (f64::from(step), inside - outside)
        };
        let falls = (-16..=16).map(fall).filter(|(_, fall)| *fall > 0.0);
        let falls: Vec<(f64, f64)> = falls.collect();
        let steeper = |one: &&(f64, f64), other: &&(f64, f64)| one.1.total_cmp(&other.1);
        let (at, steepest) = *falls.iter().max_by(steeper)?;
        let is_near = |step: f64, fall: f64| (step - at).abs() < 6.0 && fall > 0.5 * steepest;
        let near = falls.iter().filter(|(step, fall)| is_near(*step, *fall));
        let weights: f64 = near.clone().map(|(_, fall)| fall).sum();
        let middle = near.map(|(step, fall)| step * fall / weights).sum();
        Some((place(middle), steepest))
    });
    falls.collect()
}

/// Returns the points of [`falls`] that are steep: where light hardly reaches the limb, it is not.
fn rim(picture: &LinearPicture, circle: &Ball) -> Vec<[f64; 2]> {
    let falls = falls(picture, circle);
    let mut steepness: Vec<f64> = falls.iter().map(|(_, fall)| *fall).collect();
    steepness.sort_by(f64::total_cmp);
    let typical = steepness.get(steepness.len() * 7 / 8);
    let least = 0.25 * typical.copied().unwrap_or_default();
    let steep = falls.into_iter().filter(|(_, fall)| *fall > least);
    steep.map(|(point, _)| point).collect()
}

/// Returns the circle with the smallest squares of |p - c|^2 - r^2 at points. It is not finite if they are on a line.
fn through(points: &[[f64; 2]]) -> Ball {
    let mean = |value: &dyn Fn(f64, f64) -> f64| {
        points.iter().map(|[x, y]| value(*x, *y)).sum::<f64>() / points.len() as f64
    };
    let [x, y] = [mean(&|x, _| x), mean(&|_, y| y)];
    let moment = |value: fn(f64, f64) -> f64| mean(&|px, py| value(px - x, py - y));
    let (xx, xy, yy) = (
        moment(|x, _| x * x),
        moment(|x, y| x * y),
        moment(|_, y| y * y),
    );
    let right = 0.5 * moment(|x, y| x * (x * x + y * y));
    let down = 0.5 * moment(|x, y| y * (x * x + y * y));
    let determinant = xx * yy - xy * xy;
    let [right, down] = [yy * right - xy * down, xx * down - xy * right].map(|c| c / determinant);
    let radius = (right * right + down * down + xx + yy).sqrt();
    Ball::distant([x + right, y + down, radius])
}

impl Ball {
    /// Finds the ball that most of the bright part's boundary in pictures of one camera belongs to, in front of a dark background.
    /// None if there is none.
    #[must_use]
    pub fn find(pictures: &[LinearPicture]) -> Option<Self> {
        let picture = brightest(pictures)?;
        let distance = |circle: &Self, [x, y]: [f64; 2]| {
            (x - circle.center[0]).hypot(y - circle.center[1]) - circle.radius
        };
        let near = |circle: &Self, points: &[[f64; 2]], tolerance: f64| -> Vec<[f64; 2]> {
            let is_near = |at: &&[f64; 2]| distance(circle, **at).abs() < tolerance;
            points.iter().filter(is_near).copied().collect()
        };
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut best = (0.0, None);
        for level in BRIGHT {
            let points = boundary(&picture, level);
            for _ in 0..TRIALS * usize::from(points.len() > 3) {
                let circle = through(&[(); 3].map(|()| points[rng.random_range(..points.len())]));
                let share = near(&circle, &points, 1.0).len() as f64 / points.len() as f64;
                let is_possible = circle.radius < (picture.width + picture.height) as f64;
                if is_possible && share > best.0 {
                    best = (share, Some(circle));
                }
            }
        }
        let (share, Some(mut circle)) = best else {
            return None;
        };
        let mut arc = 0;
        for tolerance in TOLERANCES {
            let rim = near(&circle, &rim(&picture, &circle), tolerance);
            arc = rim.len();
            circle = through(&rim);
        }
        // The blur of a bright limb makes the compressed one too large.
        let mut linear = picture;
        let light = linear.pixels.as_flattened_mut().iter_mut();
        light.for_each(|light| *light = light.powf(1.0 / GAMMA));
        let falls = falls(&linear, &circle).into_iter();
        let sharp = falls.filter(|(_, fall)| *fall > SHARP);
        let mut errors: Vec<f64> = sharp.map(|(at, _)| distance(&circle, at)).collect();
        errors.sort_by(f64::total_cmp);
        if errors.len() >= MIN_ARC / 2 {
            circle.radius += errors[errors.len() / 2];
        }
        let is_found = arc >= MIN_ARC && share >= MIN_SHARE;
        is_found.then_some(circle)
    }
}
