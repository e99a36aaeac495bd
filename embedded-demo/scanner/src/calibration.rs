//! The guided calibration with a white tile.

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::Quantity;
use glimpse_core::gonio::tile::{TileResult, examine};

use crate::device::Device;
use crate::operator::{Event, Operator};
use crate::optics::{Optics, Sensor, White};

/// Polar angles of lamp and sensor, radians, at which the tile is read: independent of each other.
const TILE: [(f32, f32); 6] = [
    (0.1, 0.9),
    (0.5, 0.2),
    (0.9, 0.5),
    (0.7, 1.0),
    (0.2, 0.4),
    (1.0, 0.8),
];
/// The azimuth between lamp and sensor there, radians: away from the mirror's direction, and from the lamp.
const AZIMUTH: f32 = 1.8;

impl<S: OutputPin, H: InputPin, R: Sensor, F: NorFlash, O: Operator, I: Read, T: Write>
    Device<'_, S, H, R, F, O, I, T>
{
    /// Reads dark and white counts, checks the conversion at other angles, and saves the counts. The white tile lies on the
    /// sample's place. If the lamp has no switch, the operator covers it.
    ///
    /// # Errors
    /// Of [`Device::home`] and [`Device::read`]; [`ErrorCode::WhiteSaturated`], [`ErrorCode::WhiteNotBrighter`]; an error of
    /// [`examine`], or [`ErrorCode::TileOther`] if a cosine or the angle of a polar axis is wrong.
    pub(crate) async fn calibrate(&mut self, white: White, has_switch: bool) -> Result<(), Error> {
        let of = TILE.len() as u16 + 2;
        self.home().await?;
        if !has_switch {
            self.ask(Event::Cover).await?;
        }
        let dark = self.read(white.at, false).await?;
        self.show(Event::Reading(1, of, dark)).await;
        if !has_switch {
            self.ask(Event::Uncover).await?;
        }
        let lit = self.read(white.at, true).await?;
        self.show(Event::Reading(2, of, lit)).await;
        if lit.is_saturated {
            return Err(Error::new(ErrorCode::WhiteSaturated));
        }
        let mut optics = Optics::new(white, dark.channels, lit.channels)?;
        let mut readings = [(white.at.directions(), [0.0; 3]); TILE.len()];
        for ((number, to), (theta_i, theta_o)) in (3..).zip(&mut readings).zip(TILE) {
            let arms = Arms::from_array([theta_i, 0.0, theta_o, AZIMUTH]);
            let counts = self.read(arms, true).await?;
            self.show(Event::Reading(number, of, counts)).await;
            *to = (arms.directions(), optics.reading(counts, &arms, true)?.brdf);
        }
        let quantity = match examine(&readings, white.reflectance)? {
            TileResult::Is(Quantity::Brdf) => None,
            TileResult::Is(quantity) | TileResult::Scaled { quantity, .. } => Some(quantity),
            _ => Some(Quantity::Brdf),
        };
        if let Some(quantity) = quantity {
            return Err(Error::with(ErrorCode::TileOther, [quantity as u32, 0]));
        }
        self.home().await?.passed()?;
        self.store.save_white(dark.channels, lit.channels)
    }
}
