//! Prints the extreme values from which the limits of core's plausibility check are derived. All materials of the given
//! sources are scanned with each bundled recipe. Arguments are sources as for `--data`.
//!
//! ```sh
//! cargo run --release -p glimpse-tests --example plausibility -- "$NBRDF" "$RGL" procedural:100:5
//! ```

use std::error::Error;
use std::fs;
use std::path::Path;

use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::gonio::Reading;
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_materials::{Material, Source};

/// Number of polar angles at which the integral of an albedo evaluates the BRDF. The light is at the normal.
const NODES: u16 = 1_000;

/// A figure and its most extreme value, with the material and recipe that have it.
struct Extreme {
    name: &'static str,
    /// 1 for the largest value, -1 for the smallest.
    sign: f32,
    value_and_case: Option<(f32, String)>,
}

impl Extreme {
    fn add(&mut self, value: f32, case: &str) {
        let exceeds = |(extreme, _): &(f32, String)| value * self.sign > extreme * self.sign;
        if self.value_and_case.as_ref().is_none_or(exceeds) {
            self.value_and_case = Some((value, case.to_owned()));
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut materials = Vec::new();
    for source in std::env::args().skip(1) {
        materials.extend(Source(source).load()?);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trainer/recipes");
    let basis = fs::read(folder.join("linear.basis24"))?;
    let mut extremes = [
        (
            "smallest ratio of the darkest to the brightest channel",
            -1.0,
        ),
        (
            "largest ratio of residual to expected loss, for residuals above 0.25",
            1.0,
        ),
        ("largest albedo", 1.0),
        ("largest minimum reading, 1/sr", 1.0),
    ]
    .map(|(name, sign)| Extreme {
        name,
        sign,
        value_and_case: None,
    });
    let mut counts = [0_u32; 2];
    for path in recipes(&folder)? {
        let bytes = fs::read(&path)?;
        let recipe = Recipe::parse(&bytes)?;
        for material in &materials {
            let case = format!("{} with {}", material.name(), path.display());
            let implausible = scan(&recipe, &basis, &**material, &case, &mut extremes)?;
            counts[usize::from(implausible)] += 1;
        }
    }
    println!("{} plausible, {} implausible", counts[0], counts[1]);
    for extreme in extremes {
        let (value, case) = extreme
            .value_and_case
            .ok_or("no material was scanned: pass at least one source")?;
        println!("{}: {value:.5}, {case}", extreme.name);
    }
    Ok(())
}

/// Returns the recipes in a folder and its subfolders.
fn recipes(folder: &Path) -> std::io::Result<Vec<std::path::PathBuf>> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            paths.extend(recipes(&path)?);
        } else if path
            .extension()
            .is_some_and(|extension| extension == "recipe")
        {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// Scans a material, adds its figures, and returns true if the fit is implausible.
fn scan(
    recipe: &Recipe<'_>,
    basis: &[u8],
    material: &dyn Material,
    case: &str,
    [channel, residual, albedo, minimum]: &mut [Extreme; 4],
) -> Result<bool, Box<dyn Error>> {
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(*recipe, &mut memory)?;
    let basis = Basis::parse(basis)?;
    if recipe.basis_checksum() == Some(basis.whole_checksum()) {
        scan = scan.with_basis(basis)?;
    }
    let (mut sums, mut min_reading) = ([0.0_f32; 3], [f32::MAX; 3]);
    for (index, angles) in (0..).zip(recipe.pattern()) {
        let brdf = material.brdf(angles);
        scan.record(index, Reading::new(brdf))?;
        for ((sum, min), value) in sums.iter_mut().zip(&mut min_reading).zip(brdf) {
            (*sum, *min) = (*sum + value, min.min(value));
        }
    }
    let mut fit = scan.fit()?;
    while !fit.advance(u32::MAX).is_complete() {}
    let implausible = match fit.finish() {
        Ok(_) => false,
        Err(error) if error.is_implausible() => true,
        Err(error) => return Err(error.into()),
    };
    let fitted = scan.fitted().ok_or("the fit has no result")?;
    if recipe.samples() >= 4 {
        let brightest = sums.into_iter().fold(0.0, f32::max);
        let darkest = sums.into_iter().fold(f32::MAX, f32::min);
        channel.add(darkest / brightest, case);
        minimum.add(min_reading.into_iter().fold(0.0, f32::max), case);
    }
    let mean = fitted.residual().mean;
    let expected = fitted.predicted_loss().or(recipe.expected_loss());
    if let Some(expected) = expected.filter(|_| mean > 0.25) {
        residual.add(mean / expected, case);
    }
    let mut sum = [0.0_f32; 3];
    for node in 0..NODES {
        let theta_o = core::f32::consts::FRAC_PI_2 * (f32::from(node) + 0.5) / f32::from(NODES);
        let (hx, hz) = (0.5 * theta_o).sin_cos();
        let at = HalfDifference {
            hx,
            hz,
            dx: -hx, // the light is at the normal
            dy: 0.0,
            dz: hz,
        };
        let weight = core::f32::consts::PI * (2.0 * theta_o).sin() * core::f32::consts::FRAC_PI_2
            / f32::from(NODES);
        for (sum, f) in sum
            .iter_mut()
            .zip(fitted.brdf(&at.directions()).unwrap_or_default())
        {
            *sum += weight * f;
        }
    }
    albedo.add(sum.into_iter().fold(0.0, f32::max), case);
    Ok(implausible)
}
