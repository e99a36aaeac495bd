//! How a driver behaves.

/// Who is at the other end of the line, and who moves the arms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Host {
    /// A host moves the arms and reads the sensor; the device asks it to.
    Measures,
    /// The device moves the arms; a host hears how far it is, and the result.
    Listens,
    /// The device moves the arms, and nobody is there.
    Absent,
}

/// How a driver behaves. [`Config::new`] has what serves most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Who moves the arms.
    pub host: Host,
    /// Units of the fit in one [`Driver::poll`](super::Driver::poll): between two of them motors,
    /// watchdog and line have their turn.
    pub slice: u32,
    /// A request that has no reply is sent again after so many milliseconds.
    pub repeat: u32,
    /// A host that does not reply for so many milliseconds has fallen silent. (A hello is repeated
    /// for ever.)
    pub patience: u32,
    /// The same while its motors move.
    pub measuring_patience: u32,
    /// How often a reading is taken that cannot be one before the scan is given up.
    pub attempts: u8,
    /// The device can store recipes of at most so many bytes; 0 if it cannot: then it does not ask
    /// for any.
    pub recipe_bytes: u32,
}

impl Config {
    /// Slices of 8 units, repeats after 0.1 s, patience of 2 s, of a minute for readings, three
    /// attempts, no storage for recipes.
    #[must_use]
    pub const fn new(host: Host) -> Self {
        Self {
            host,
            slice: 8,
            repeat: 100,
            patience: 2_000,
            measuring_patience: 60_000,
            attempts: 3,
            recipe_bytes: 0,
        }
    }
}
