//! A budget for the time of a scan, as a constraint of training.
//!
//! The arms visit the samples in the recipe's own order. The objective is the loss plus a weight times the seconds of
//! motion. The weight rises while a scan takes longer than the budget, and falls while it takes less time. From time to
//! time the samples are put into the fastest order.

use glimpse_core::geometry::Angles;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_fitting::route::{Order, Route, TimedMachine, arms_at, arms_in_degrees, move_seconds};
use glimpse_kernels::Dual;
use glimpse_materials::lists::add_scaled;
use glimpse_materials::setting::Name;

use super::pattern::Reach;

/// A budget that no pattern keeps.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScanBudgetError {
    /// The samples take as long as the whole scan without any motion.
    #[error(
        "{}: a scan of {samples} samples takes {settling} s without motion, and the budget is {seconds} s; allow more \
         seconds, fewer samples, or less time at each",
        Name("scan_seconds")
    )]
    NoMotion {
        /// The number of samples.
        samples: usize,
        /// The time at the samples, in seconds.
        settling: f64,
        /// The budget, in seconds.
        seconds: f64,
    },
    /// The arms cannot move as fast.
    #[error(
        "{}: the fastest pattern that was found takes {reached:.1} s, and the budget is {seconds} s; allow more seconds \
         or fewer samples",
        Name("scan_seconds")
    )]
    TooFast {
        /// The time of the fastest pattern, in seconds.
        reached: f64,
        /// The budget, in seconds.
        seconds: f64,
    },
}

/// The time of a path through all samples in their order, and its gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct PathTime {
    /// Seconds of motion.
    pub seconds: f64,
    /// The derivatives with respect to the angles of each sample, in seconds per radian. A move takes as long as its
    /// slowest axis, so the derivative is that of this axis.
    pub by_angles: Vec<[f32; 3]>,
}

/// The motion of a scan within a budget.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    machine: TimedMachine,
    samples: usize,
    /// The budget for motion, in seconds.
    seconds: f64,
}

/// The weight of a second of motion before the first step.
pub const INITIAL_WEIGHT: f32 = 1e-4;
/// The change of the weight's logarithm in a step, at twice the budget.
const WEIGHT_RATE: f64 = 0.01;
/// The additional logarithm of the weight at twice the budget. It damps oscillations.
const DAMPING: f64 = 4.0;
/// The range of the weight.
const WEIGHTS: [f32; 2] = [1e-7, 10.0];
/// The share of the budget that training aims at. The last steps overshoot by less than the rest.
const AIM: f64 = 0.99;
/// The slope of the factor of validation losses beyond the budget.
const SELECTION_SLOPE: f32 = 20.0;
/// The number of steps between two searches for a faster order.
pub const REORDER_INTERVAL: usize = 50;
/// The smallest gain of a new order, in seconds.
const MIN_GAIN: f64 = 1e-3;
/// The share of the budget that a finished pattern keeps within, so that rounding does not exceed it.
const SHORTENED: f64 = 1.0 - 1e-5;
/// The largest number of steps that shorten a finished pattern.
const SHORTENING_STEPS: usize = 20_000;
/// The largest number of such steps after a step of training.
const PROJECTION_STEPS: usize = 100;
/// The length of such a step, radians.
const SHORTENING: f32 = 5e-4;

impl Motion {
    /// Creates the motion of a valid machine to `samples` samples, in `seconds` from [`TimedMachine::START`] to the last
    /// reading.
    #[must_use]
    pub fn new(seconds: f64, machine: TimedMachine, samples: usize) -> Self {
        Self {
            machine,
            samples,
            seconds: seconds - machine.settle * samples as f64,
        }
    }

    /// Returns the motion of a scan, if its time has a budget.
    #[must_use]
    pub fn of(options: &TrainingOptions) -> Option<Self> {
        let (seconds, machine) = (options.scan_seconds?, options.machine());
        Some(Self::new(seconds, machine, options.samples))
    }

    /// Checks that the time is sufficient for motion to a pattern near the start.
    ///
    /// # Errors
    /// All errors of [`ScanBudgetError`].
    pub fn validate(&self) -> Result<(), ScanBudgetError> {
        if self.seconds.is_nan() || self.seconds <= 0.0 {
            return Err(ScanBudgetError::NoMotion {
                samples: self.samples,
                settling: self.settling(),
                seconds: self.seconds + self.settling(),
            });
        }
        // All samples near the start, as close to each other as the limits permit.
        let nearest = self.reach().logits(Angles::default());
        self.shorten(&mut nearest.repeat(self.samples))
    }

    fn reach(&self) -> Reach<'static> {
        Reach {
            limits: self.machine.limits,
            fixed: &[],
        }
    }

    /// Returns the time at the samples, in seconds.
    fn settling(&self) -> f64 {
        self.machine.settle * self.samples as f64
    }

    /// Returns the time of the path through these samples in their order, and its gradient.
    #[must_use]
    pub fn path(&self, angles: &[Angles<f32>]) -> PathTime {
        let mut time = PathTime {
            seconds: 0.0,
            by_angles: vec![[0.0; 3]; angles.len()],
        };
        let turn = self.machine.turn_seconds();
        let start = self.machine.axis_seconds(&TimedMachine::START);
        let mut from = start.map(Dual::from_value);
        for (index, angles) in angles.iter().enumerate() {
            let variables = Dual::<f64, 3>::variables(angles.map(f64::from));
            let to = self.machine.axis_seconds(&arms_at(variables));
            let widened = |duals: [Dual<f64, 3>; 3], first| duals.map(|dual| widen(dual, first));
            let seconds = move_seconds(turn, &widened(from, 0), &widened(to, 3));
            time.seconds += seconds.value;
            let (by_samples, _) = seconds.tangent.as_chunks::<3>();
            for (sample, by_angles) in (0..=index).rev().zip(by_samples.iter().rev()) {
                for (sum, by_angle) in time.by_angles[sample].iter_mut().zip(by_angles) {
                    *sum += *by_angle as f32;
                }
            }
            from = to;
        }
        time
    }

    /// Returns the gradient of the weighted time of a path with respect to the pattern's logits. `allowance` is the present
    /// budget, as a multiple of the given one. Updates `weight`, that of a second, for the next step.
    #[must_use]
    pub fn weighted_gradient(&self, logits: &[f32], allowance: f64, weight: &mut f32) -> Vec<f32> {
        let pattern = self.reach().pattern(logits);
        let path = self.path(&pattern.angles);
        let excess = (path.seconds / (allowance * AIM * self.seconds) - 1.0).clamp(-1.0, 1.0);
        let damped = *weight * (DAMPING * excess).exp() as f32;
        let [min, max] = WEIGHTS;
        *weight = (*weight * (WEIGHT_RATE * excess).exp() as f32).clamp(min, max);
        let by_angles = path.by_angles.iter().enumerate();
        by_angles
            .flat_map(|(index, by_angles)| {
                pattern.by_logits(index, by_angles.map(|by_angle| damped * by_angle))
            })
            .collect()
    }

    /// Returns the factor of a validation loss. It exceeds 1 for patterns beyond the budget, by a fifth for each percent.
    #[must_use]
    pub fn selection_factor(&self, logits: &[f32]) -> f32 {
        let angles = self.reach().reachable_angles(logits);
        let excess = self.path(&angles).seconds / self.seconds - 1.0;
        1.0 + SELECTION_SLOPE * excess.max(0.0) as f32
    }

    /// Returns a faster order of the samples, as indices; None if none was found. `thorough` selects a longer search.
    #[must_use]
    pub fn faster_order(&self, logits: &[f32], thorough: bool) -> Option<Vec<usize>> {
        let angles = self.reach().reachable_angles(logits);
        let stops: Vec<_> = angles.iter().copied().map(arms_in_degrees).collect();
        let route = if thorough {
            Route::new(&self.machine, &stops, Order::Travel, 0)
        } else {
            Route::quick(&self.machine, &stops, Order::Travel)
        };
        let order: Vec<usize> = route.visits.iter().map(|visit| visit.index).collect();
        let sorted: Vec<Angles<f32>> = order.iter().map(|index| angles[*index]).collect();
        let gain = self.path(&angles).seconds - self.path(&sorted).seconds;
        (gain > MIN_GAIN).then_some(order)
    }

    /// Moves the samples of a finished pattern until its path is within the budget. A pattern within the budget is
    /// unchanged.
    ///
    /// # Errors
    /// [`ScanBudgetError::TooFast`] if no such pattern is found.
    pub fn shorten(&self, logits: &mut [f32]) -> Result<(), ScanBudgetError> {
        self.shorten_within(SHORTENING_STEPS, logits)
    }

    /// Shortens a pattern after a step, if the budget is the given one by then. The completion then learns for a pattern within
    /// the budget: it is sensitive to the directions of samples that are close to each other.
    pub fn project(&self, logits: &mut [f32], allowance: f64) {
        if allowance <= 1.0 {
            // The finished pattern is shortened further, or refused.
            let _ = self.shorten_within(PROJECTION_STEPS, logits);
        }
    }

    fn shorten_within(&self, steps: usize, logits: &mut [f32]) -> Result<(), ScanBudgetError> {
        let reach = self.reach();
        for _ in 0..steps {
            let angles = reach.reachable_angles(logits);
            let path = self.path(&angles);
            if path.seconds <= SHORTENED * self.seconds {
                return Ok(());
            }
            let samples = logits.as_chunks_mut::<3>().0.iter_mut();
            for ((logits, angles), slopes) in samples.zip(angles).zip(&path.by_angles) {
                let norm = slopes.iter().map(|slope| slope * slope).sum::<f32>().sqrt();
                if norm > 0.0 {
                    let step = SHORTENING / norm;
                    let mut shorter = angles.to_array();
                    add_scaled(&mut shorter, -step, slopes);
                    *logits = reach.logits(Angles::from_array(shorter));
                }
            }
        }
        let angles = reach.reachable_angles(logits);
        Err(ScanBudgetError::TooFast {
            reached: self.path(&angles).seconds + self.settling(),
            seconds: self.seconds + self.settling(),
        })
    }
}

/// Returns a number whose three derivatives begin at entry `first` of six.
fn widen(dual: Dual<f64, 3>, first: usize) -> Dual<f64, 6> {
    let mut wide = Dual::from_value(dual.value);
    wide.tangent[first..first + 3].copy_from_slice(&dual.tangent);
    wide
}
