//! From what was measured to a fitted material.

use glimpse_core::recipe::Recipe;
use glimpse_core::scan::LEAST_READING;
use glimpse_kernels::scan::{Found, HostScanError, scan_some};

use super::measured::Measured;
use super::outliers::{Distribution, Opinion, Suspect};

/// What becomes of a sample's reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The fit goes by it.
    Used,
    /// There is none.
    Missing,
    /// The sensor was at its end, and the recipe can do without it.
    Saturated,
    /// It looks wrong, and the recipe can do without it.
    LeftOut,
}

impl Fate {
    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Missing => "missing",
            Self::Saturated => "saturated",
            Self::LeftOut => "left out",
        }
    }
}

/// What a fit of measurements has found.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The values, the residual and what is predicted.
    pub found: Found,
    /// What became of each sample's reading.
    pub fates: Vec<Fate>,
    /// What the others say of each reading; None where there is none that can be looked at.
    pub opinions: Vec<Option<Opinion>>,
    /// Readings that look wrong, the worst first, whether they were left out or not.
    pub suspects: Vec<Suspect>,
    /// False if there are too many samples to look at.
    pub examined: bool,
}

/// Why measurements are not fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitFailure {
    /// Readings are missing that the recipe cannot do without.
    #[error(
        "sample {} not measured, and this recipe needs all {samples}: read {} too, or scan by a \
         recipe that can do without, as `trainer train --missing 0.5` makes them",
        list(missing), if missing.len() == 1 { "it" } else { "them" }
    )]
    Missing {
        /// The samples that are missing.
        missing: Vec<usize>,
        /// How many samples the recipe has.
        samples: usize,
    },
    /// The readings cannot be fitted.
    #[error(transparent)]
    Scan(#[from] HostScanError),
}

fn list(missing: &[usize]) -> String {
    let names: Vec<String> = missing.iter().map(usize::to_string).collect();
    match missing.len() {
        1 => format!("{} was", names.join(", ")),
        _ => format!("{} were", names.join(", ")),
    }
}

/// Looks at what was measured, and fits it as a device does. Where the recipe can do without some
/// readings, those that are saturated are left out, and those that look wrong, unless `keep_all`.
///
/// # Errors
/// If readings are missing that the recipe needs, or a device would give up.
pub fn fit(recipe: &Recipe<'_>, measured: &Measured, keep_all: bool) -> Result<Fit, FitFailure> {
    let can_do_without = recipe.learner().takes_missing();
    let missing = measured.missing();
    if !can_do_without && !missing.is_empty() {
        return Err(FitFailure::Missing {
            missing,
            samples: recipe.samples(),
        });
    }
    // What a saturated reading is, is not known.
    let readings: Vec<Option<[f32; 3]>> = measured
        .samples
        .iter()
        .map(|sample| sample.mean().filter(|_| !sample.saturated()))
        .collect();
    let distribution = Distribution::new(recipe);
    let examined = distribution.as_ref().map(|all| all.examine(&readings));
    let is_examined = examined.is_some();
    let (opinions, suspects) = examined.map_or_else(
        || (vec![None; readings.len()], Vec::new()),
        |examined| (examined.opinions, examined.suspects),
    );
    let fate = |(index, sample): (usize, &glimpse_core::gonio::Repeated)| {
        let is_suspect = suspects.iter().any(|suspect| suspect.sample == index);
        match () {
            () if sample.count() == 0 => Fate::Missing,
            () if can_do_without && sample.saturated() => Fate::Saturated,
            () if can_do_without && is_suspect && !keep_all => Fate::LeftOut,
            () => Fate::Used,
        }
    };
    let fates: Vec<Fate> = measured.samples.iter().enumerate().map(fate).collect();
    let found = scan_some(recipe, &mut |index, _| {
        let index = usize::from(index);
        let mean = measured.samples.get(index)?.mean()?;
        // A mean of readings that are no further below 0 than they may be is not either, but for
        // rounding.
        (fates.get(index) == Some(&Fate::Used)).then(|| mean.map(|f| f.max(LEAST_READING)))
    })?;
    Ok(Fit {
        found,
        fates,
        opinions,
        suspects,
        examined: is_examined,
    })
}
