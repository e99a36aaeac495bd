//! Simulated arms, and a flash with power cuts.

use std::ops::Range;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use glimpse_arms::axis::Motion;
use glimpse_arms::goniometer::{ArmError, Goniometer};
use glimpse_arms::simulated::{DirectionPin, SimulatedScanner, StepPin, Switch};
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::Recipes;

pub(crate) const SECTOR_BYTES: usize = 512;

/// Size of the buffer for a recipe.
pub(crate) const BUFFER_BYTES: usize = 2 * SECTOR_BYTES;

const fn sectors(range: Range<u32>) -> Range<u32> {
    range.start * SECTOR_BYTES as u32..range.end * SECTOR_BYTES as u32
}

pub(crate) fn mount_readings(flash: &mut Flash) -> Readings {
    Readings::mount(flash, [sectors(0..1), sectors(1..2)]).unwrap()
}

pub(crate) fn mount_recipes(flash: &mut Flash) -> Recipes {
    let mut buffer = [0; BUFFER_BYTES];
    Recipes::mount(flash, [sectors(2..4), sectors(4..6)], &mut buffer).unwrap()
}

/// Error: the power was cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Effect of a power cut on a write or an erase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CutEffect {
    /// Nothing was changed.
    Nothing,
    /// Only the first half was changed.
    FirstHalf,
    /// Only the second half was changed.
    SecondHalf,
    /// A random subset of the bits was changed; the value is the seed.
    Bits(u64),
}

pub(crate) const CUT_EFFECTS: [CutEffect; 8] = [
    CutEffect::Nothing,
    CutEffect::FirstHalf,
    CutEffect::SecondHalf,
    CutEffect::Bits(1),
    CutEffect::Bits(2),
    CutEffect::Bits(3),
    CutEffect::Bits(4),
    CutEffect::Bits(5),
];

/// A flash in memory with words of `WORD` bytes. A write clears bits, an erase sets them.
#[derive(Clone, Debug)]
pub(crate) struct Flash<const WORD: usize = 4> {
    pub(crate) bytes: Vec<u8>,
    /// Number of writes and erases before a power cut, and its effect. None: no power cut.
    pub(crate) cut: Option<(u32, CutEffect)>,
    pub(crate) changes: u32,
}

impl<const WORD: usize> Flash<WORD> {
    pub(crate) fn new(sectors: usize) -> Self {
        Self {
            bytes: vec![0xFF; sectors * SECTOR_BYTES],
            cut: None,
            changes: 0,
        }
    }

    /// Changes bytes, unless the power is cut.
    fn change(&mut self, from: usize, after: Vec<u8>) -> Result<(), PowerCut> {
        let place = &mut self.bytes[from..from + after.len()];
        let half = after.len() / 2;
        match &mut self.cut {
            None => place.copy_from_slice(&after),
            Some((0, _)) => return Err(PowerCut),
            Some((1, effect)) => {
                match *effect {
                    CutEffect::Nothing => {}
                    CutEffect::FirstHalf => place[..half].copy_from_slice(&after[..half]),
                    CutEffect::SecondHalf => place[half..].copy_from_slice(&after[half..]),
                    CutEffect::Bits(seed) => {
                        let mut state = seed * 0x9E37_79B9 + u64::from(self.changes);
                        for (before, after) in place.iter_mut().zip(after) {
                            state = state
                                .wrapping_mul(6_364_136_223_846_793_005)
                                .wrapping_add(1_442_695_040_888_963_407);
                            let mask = (state >> 56) as u8;
                            *before = *before & !mask | after & mask;
                        }
                    }
                }
                self.cut = Some((0, *effect));
                return Err(PowerCut);
            }
            Some((left, _)) => {
                place.copy_from_slice(&after);
                *left -= 1;
            }
        }
        self.changes += 1;
        Ok(())
    }
}

impl<const WORD: usize> ErrorType for Flash<WORD> {
    type Error = PowerCut;
}

impl<const WORD: usize> ReadNorFlash for Flash<WORD> {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        if matches!(self.cut, Some((0, _))) {
            return Err(PowerCut);
        }
        let offset = offset as usize;
        assert!(offset.is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WORD: usize> NorFlash for Flash<WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        assert!(
            (from as usize).is_multiple_of(SECTOR_BYTES)
                && (to as usize).is_multiple_of(SECTOR_BYTES)
        );
        for sector in (from as usize..to as usize).step_by(SECTOR_BYTES) {
            self.change(sector, vec![0xFF; SECTOR_BYTES])?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        let offset = offset as usize;
        assert!(offset.is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        let place = &self.bytes[offset..offset + bytes.len()];
        let is_erased = place.iter().all(|byte| *byte == 0xFF);
        assert!(
            is_erased,
            "words with error correction can be written only once"
        );
        let after = place.iter().zip(bytes).map(|(a, b)| a & b).collect();
        self.change(offset, after)
    }
}

/// Homing order of the arms.
pub(crate) const HOMING_ORDER: [usize; 4] = [2, 0, 1, 3];

pub(crate) type Arms<'w> = Goniometer<StepPin<'w>, DirectionPin<'w>, Switch<'w>, 4>;

/// Polls until all arms have arrived, and returns the time in us.
pub(crate) fn settle(arms: &mut Arms, round: u32) -> Result<u32, ArmError> {
    for rounds in 0..60_000_000 / round {
        if arms.poll(round)? == Motion::Arrived {
            return Ok(rounds * round);
        }
    }
    panic!("the arms never arrive");
}

pub(crate) fn go_to(arms: &mut Arms, angles: [f32; 4]) {
    arms.go_to(angles).unwrap();
    settle(arms, 10).unwrap();
}

pub(crate) fn go_home(arms: &mut Arms) {
    arms.go_home(HOMING_ORDER).unwrap();
    settle(arms, 10).unwrap();
}

/// Returns the homed arms of a simulated scanner.
pub(crate) fn homed(simulated: &SimulatedScanner) -> Arms<'_> {
    let mut arms = simulated.goniometer();
    go_home(&mut arms);
    arms
}
