//! A self-test of a scanner's conversion of counts to the BRDF, with a tile of known reflectance.
//!
//! A scan's residual cannot detect a wrong convention: a model explains the BRDF times the cosine as well as the BRDF,
//! or better. A matt white or gray tile detects it. Its BRDF is reflectance / pi at all angles, so its readings must
//! not depend on the angles.

use core::f32::consts::PI;

use super::{Quantity, Repeated};
use crate::error::{Decimal, Error, ErrorCode};
use crate::geometry::Directions;
use crate::numeric::math;

/// The largest deviation of a factor from its nominal value, as a logarithm: e^0.05, 5 %.
const FACTOR_TOLERANCE: f32 = 0.05;
/// The largest spread of the readings about the best quantity, as a standard deviation: 8 %.
const MAX_SPREAD: f32 = 0.08;
/// The smallest spread of the readings about each other quantity.
const MIN_OTHER_SPREAD: f32 = 0.06;
/// The smallest ratio of that spread to the spread about the best quantity.
const MIN_SPREAD_RATIO: f32 = 3.0;

/// The result of the self-test.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TileResult {
    /// The readings are this quantity, within 5 %. A scan needs [`Quantity::Brdf`]; [`Quantity::to_brdf`] converts the
    /// others.
    Is(Quantity),
    /// The readings are this quantity (never the reflectance factor) times a constant in each channel. Lamp, exposure,
    /// distance or the white's reflectance differ from the assumed ones.
    Scaled {
        /// The quantity that the readings are proportional to.
        quantity: Quantity,
        /// The divisor that converts the readings to the quantity.
        factor: [f32; 3],
    },
}

impl core::fmt::Display for TileResult {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Is(Quantity::Brdf) => f.write_str("the readings are the BRDF"),
            Self::Is(quantity) => write!(
                f,
                "the readings are the {quantity} and not the BRDF: convert them with `Quantity::to_brdf`"
            ),
            Self::Scaled {
                quantity,
                factor: [r, g, b],
            } => write!(
                f,
                "the readings are the {quantity} times {}, {} and {}: check lamp, exposure, distance and the white's reflectance",
                Decimal(*r),
                Decimal(*g),
                Decimal(*b)
            ),
        }
    }
}

/// The quantities that are tested. The reflectance factor is the BRDF times a constant.
const CANDIDATES: [Quantity; 3] = [
    Quantity::Brdf,
    Quantity::BrdfTimesCosThetaI,
    Quantity::BrdfTimesCosThetaO,
];

/// Determines the quantity of `readings` of a matt tile whose `reflectance` in each channel is known.
///
/// Without noise, three readings are enough. Eight readings tolerate noise of 3 % (standard deviation). With more
/// noise, the result is inconclusive rather than wrong. In 2,000 simulations of eight readings with noise of 5 %, more
/// than 90 % of the results were correct, and none was wrong.
///
/// Spread theta_i and theta_o **independently** over 0 to 60 degrees. If both angles are equal, the test cannot
/// distinguish the two cosines. If one angle is fixed, it cannot distinguish its cosine from a constant. The result is
/// then [`ErrorCode::TileAmbiguous`]. Avoid mirror directions and grazing angles, where no tile is matt. Omit
/// black and saturated readings, which carry no information.
///
/// ```
/// use glimpse_core::geometry::{Arms, Directions};
/// use glimpse_core::gonio::{Quantity, tile::{TileResult, examine}};
///
/// let at = |theta_i, theta_o| Arms::from_array([theta_i, 0.0, theta_o, 2.0]).directions();
/// // A gray tile of 50 %, and a conversion without the division by cos(theta_i).
/// let read = |at: Directions<f32>| (at, [0.5 / 3.14159 * at.incoming[2]; 3]);
/// let readings = [at(0.1, 0.9), at(0.5, 0.2), at(1.0, 0.5), at(0.8, 1.0)].map(read);
/// assert_eq!(examine(&readings, [0.5; 3])?, TileResult::Is(Quantity::BrdfTimesCosThetaI));
/// # Ok::<(), glimpse_core::error::Error>(())
/// ```
///
/// # Errors
/// The test has no result: [`ErrorCode::WhiteReflectance`] with the channel, [`ErrorCode::TileTooFew`],
/// [`ErrorCode::TileReading`] with the index of the reading, [`ErrorCode::TileSpread`], or [`ErrorCode::TileAmbiguous`].
pub fn examine(
    readings: &[(Directions<f32>, [f32; 3])],
    reflectance: [f32; 3],
) -> Result<TileResult, Error> {
    for (channel, reflectance) in (0..).zip(reflectance) {
        // This form of the condition rejects NaN too.
        if !(reflectance > 0.0 && reflectance <= 2.0) {
            return Err(Error::with(ErrorCode::WhiteReflectance, [channel, 0]));
        }
    }
    let tile_brdf = reflectance.map(|reflectance| reflectance / PI);
    let mut best = (Quantity::Brdf, [0.0; 3], f32::INFINITY);
    let mut second = f32::INFINITY;
    for quantity in CANDIDATES {
        let (mean, spread) = log_ratios(quantity, readings, tile_brdf)?;
        if spread < best.2 {
            second = best.2;
            best = (quantity, mean, spread);
        } else if spread < second {
            second = spread;
        }
    }
    let (quantity, mean, spread) = best;
    let too_noisy = Error::with(ErrorCode::TileSpread, [(100.0 * spread + 0.5) as u32, 0]);
    if spread > MAX_SPREAD {
        return Err(too_noisy);
    }
    if second < MIN_OTHER_SPREAD || second < MIN_SPREAD_RATIO * spread {
        return Err(Error::new(ErrorCode::TileAmbiguous));
    }
    // Noise may explain a deviation of up to five standard errors. The limit is high, because the standard error itself
    // is estimated from few readings.
    let noise = 5.0 * spread / math::sqrt(readings.len() as f32);
    let all_within = |expected: f32, tolerance: f32| {
        mean.iter()
            .all(|logarithm| (logarithm - expected).abs() <= tolerance)
    };
    let ln_pi = math::ln(PI);
    let factors = [(quantity, 0.0), (Quantity::ReflectanceFactor, ln_pi)];
    let nominal_count = if quantity == Quantity::Brdf { 2 } else { 1 };
    for (quantity, expected) in factors.into_iter().take(nominal_count) {
        if all_within(expected, FACTOR_TOLERANCE) {
            return Ok(TileResult::Is(quantity));
        }
        if all_within(expected, FACTOR_TOLERANCE + noise) {
            return Err(too_noisy);
        }
    }
    Ok(TileResult::Scaled {
        quantity,
        factor: mean.map(math::exp),
    })
}

/// Returns the logarithms of the readings relative to `quantity` of a tile with the BRDF `tile_brdf`: their mean in
/// each channel, and their standard deviation over all channels.
fn log_ratios(
    quantity: Quantity,
    readings: &[(Directions<f32>, [f32; 3])],
    tile_brdf: [f32; 3],
) -> Result<([f32; 3], f32), Error> {
    let mut logarithms = Repeated::default();
    for (index, (at, reading)) in readings.iter().enumerate() {
        let invalid = Error::with(ErrorCode::TileReading, [index as u32, 0]);
        let is_positive = reading
            .iter()
            .all(|value| *value > 0.0 && value.is_finite());
        if !is_positive || at.check().is_err() {
            return Err(invalid);
        }
        let expected = quantity.of_brdf(tile_brdf, at).map_err(|_| invalid)?;
        let mut ratios = *reading;
        for (ratio, expected) in ratios.iter_mut().zip(expected) {
            *ratio = math::ln(*ratio / expected);
        }
        logarithms.add(ratios, false).map_err(|_| invalid)?;
    }
    let few = logarithms.count < 3;
    match (logarithms.mean(), logarithms.variance()) {
        (Some(mean), Some([r, g, b])) if !few => Ok((mean, math::sqrt((r + g + b) / 3.0))),
        _ => Err(Error::new(ErrorCode::TileTooFew)),
    }
}
