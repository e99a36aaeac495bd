//! Options of a driver.

use crate::gonio::Machine;
use crate::scan::EvidenceLimits;

/// The role of the host, at the other end of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Host {
    /// A host moves the arms and reads the sensor, as the device requests.
    Measures,
    /// The device moves the arms; a host receives progress and result. The device scans alone if none answers.
    Listens,
    /// The device moves the arms, without a host.
    Absent,
}

/// Options of a driver. [`Config::new`] sets defaults; assign fields to change them.
///
/// ```
/// use glimpse_core::driver::{Config, Host};
///
/// let mut config = Config::new(Host::Measures);
/// config.sequence_seed = 17; // a boot counter
/// config.steps_per_poll = 4;
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Config {
    /// The role of the host.
    pub host: Host,
    /// The machine that measures: its reach, and the axes that it lacks. The driver skips samples out of reach if the
    /// recipe tolerates missing readings. Otherwise the scan fails before any move. None: every sample is within reach.
    pub machine: Option<Machine>,
    /// The seed of the [sequence numbers](crate::link::DeviceEnd::new). It must differ from the seeds of all earlier
    /// drivers of this device: a boot counter, a random number, or the value of a free-running timer. Unused with
    /// [`Host::Absent`].
    pub sequence_seed: u32,
    /// Units of work of the fit in one [`Driver::poll`](super::Driver::poll). 0 counts as 1.
    pub steps_per_poll: u32,
    /// Interval of retransmissions of a request without a reply, in ms.
    pub retransmit_interval_ms: u32,
    /// Timeout of a reply, in ms. After it, the scan fails if the host measures
    /// ([`ErrorCode::NoReply`](crate::error::ErrorCode::NoReply)), and continues alone if it listens. A `Hello` to a host that measures has no timeout.
    pub reply_timeout_ms: u32,
    /// Timeout of a reading by the host, in ms. It includes the motion of the arms.
    pub measure_timeout_ms: u32,
    /// Number of invalid readings of a sample after which the driver skips it, or fails if the recipe needs every
    /// reading. 0 counts as 1.
    pub attempts: u8,
    /// The limits of room light, drift and saturation. With [`EvidenceLimits::NONE`], only the samples are read.
    pub limits: EvidenceLimits,
    /// The loss, above 0, at which a scan stops before all samples are read. After each reading, also after restored
    /// ones, the driver fits the readings that it has. If the [bound of the loss](crate::scan::Fitted::loss_bound) is
    /// at most the target, the driver skips the pending samples, and this fit is the result. If the fit fails or is
    /// implausible, the scan continues.
    ///
    /// Each of these fits takes as many steps as a fit of all readings. The host receives no progress of them. The
    /// bound holds only for the first samples in the recipe's order, so the driver reads all samples if one was skipped,
    /// out of reach, saturated, or read out of order.
    ///
    /// None, 0, a negative number or NaN: the scan reads all samples. The target has no effect if the recipe does not
    /// [bound the loss](crate::recipe::Recipe::bounds_partial_loss) of such fits.
    pub target_loss: Option<f32>,
}

impl Config {
    /// Returns options without a machine, seed 0, 8 steps per poll, retransmissions after 0.1 s, timeouts of 2 s and of
    /// 60 s for readings, three attempts, the default limits, and no target loss.
    #[must_use]
    pub const fn new(host: Host) -> Self {
        Self {
            host,
            machine: None,
            sequence_seed: 0,
            steps_per_poll: 8,
            retransmit_interval_ms: 100,
            reply_timeout_ms: 2_000,
            measure_timeout_ms: 60_000,
            attempts: 3,
            limits: EvidenceLimits::DEFAULT,
            target_loss: None,
        }
    }
}
