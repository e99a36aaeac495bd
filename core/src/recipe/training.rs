//! The settings of a recipe's training, for programs. [`Provenance`](super::Provenance) describes the training for
//! people.
//!
//! The order of fields and variants here is the format; see `core/docs/recipe.md`.

use serde::{Deserialize, Serialize, Serializer};

/// The settings of a recipe's training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Training<'a> {
    /// The order in which the parts were trained.
    pub schedule: Schedule,
    /// The length of the training.
    pub effort: Effort,
    /// The parts that were trained.
    pub parts: Parts,
    /// The materials on which the expected loss was measured.
    pub split: ValidationSplit,
    /// The trainer's CRC-64 of all options that affect the result. Recipes with the same digest were trained with the
    /// same options.
    pub digest: u64,
    /// The sources of the materials; empty if unknown.
    pub sources: TrainingSources<'a>,
}

/// Defines an enum of the format with a name for each variant.
macro_rules! named {
    ($(#[$meta:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $text:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[non_exhaustive]
        pub enum $name {
            $($(#[$doc])* $variant,)+
        }

        impl $name {
            /// The name, as in `core/docs/recipe.md`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }
    };
}

named! {
    /// The order in which the parts of a recipe are trained.
    Schedule {
        /// Initial parameters, step sizes and pattern together.
        Joint = "joint",
        /// The paper's two stages: initial parameters and step sizes, then the pattern.
        Paper = "paper",
        /// A learned map from readings to coefficients, and the pattern.
        Prior = "prior",
    }
}

named! {
    /// The length of a training.
    Effort {
        /// Seconds.
        Brief = "brief",
        /// About a minute.
        Quick = "quick",
        /// Minutes.
        Standard = "standard",
        /// About an hour.
        Long = "long",
    }
}

named! {
    /// The parts of a recipe that are trained.
    Parts {
        /// All of them.
        All = "all",
        /// All of them, then initial parameters with step sizes again, and the pattern again.
        AllTwice = "all-twice",
        /// Initial parameters and step sizes.
        WithoutPattern = "without-pattern",
        /// The pattern, with given initial parameters and step sizes.
        PatternOnly = "pattern-only",
    }
}

named! {
    /// The materials on which a recipe's expected loss was measured.
    ValidationSplit {
        /// Materials held out of training.
        HeldOut = "held-out",
        /// The training materials themselves. This loss does not predict that of other materials.
        Training = "training",
        /// The training materials, each with a basis of the other materials.
        LeftOut = "left-out",
        /// The training materials, each with a training that excludes its fold.
        Folds = "folds",
    }
}

named! {
    /// The origin of materials.
    Origin {
        /// The user's files, or materials that a program defines.
        Files = "files",
        /// The trainer's procedural materials.
        BuiltIn = "built-in",
    }
}

/// A source of a recipe's training materials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingSource<'a> {
    /// A name for people, without directories.
    pub label: &'a str,
    /// The origin of its materials.
    pub origin: Origin,
    /// The number of its materials.
    pub materials: u32,
    /// Its share in all training tasks, 0 to 1.
    pub share: f32,
}

/// An iterator over the sources of a recipe's training materials.
#[derive(Clone, Copy, Debug)]
pub struct TrainingSources<'a>(List<'a>);

#[derive(Clone, Copy, Debug)]
enum List<'a> {
    /// A list to write.
    Unpacked(&'a [TrainingSource<'a>]),
    /// A list in a recipe's bytes.
    Packed { left: u32, rest: &'a [u8] },
}

impl<'a> TrainingSources<'a> {
    /// Creates a list to write.
    #[must_use]
    pub const fn new(sources: &'a [TrainingSource<'a>]) -> Self {
        Self(List::Unpacked(sources))
    }

    /// Creates the list from a recipe's bytes. None if it is incomplete or more bytes follow.
    fn from_bytes(bytes: &'a [u8]) -> Option<Self> {
        let (left, rest) = postcard::take_from_bytes(bytes).ok()?;
        let list = Self(List::Packed { left, rest });
        let mut end = list;
        (&mut end).for_each(drop);
        matches!(end.0, List::Packed { left: 0, rest: [] }).then_some(list)
    }
}

impl<'a> Iterator for TrainingSources<'a> {
    type Item = TrainingSource<'a>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.0 {
            List::Unpacked(sources) => {
                let (first, others) = sources.split_first()?;
                *sources = others;
                Some(*first)
            }
            List::Packed { left, rest } => {
                let others = left.checked_sub(1)?;
                let (first, end) = postcard::take_from_bytes(rest).ok()?;
                (*left, *rest) = (others, end);
                Some(first)
            }
        }
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = match &self.0 {
            List::Unpacked(sources) => sources.len(),
            List::Packed { left, .. } => *left as usize,
        };
        (left, Some(left))
    }
}

impl ExactSizeIterator for TrainingSources<'_> {}

impl PartialEq for TrainingSources<'_> {
    fn eq(&self, other: &Self) -> bool {
        Iterator::eq(*self, *other)
    }
}

impl Serialize for TrainingSources<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(*self)
    }
}

impl<'a> Training<'a> {
    /// Decodes a section. None if its bytes do not follow the format.
    pub(super) fn read(bytes: &'a [u8]) -> Option<Self> {
        let ((schedule, effort, parts, split, digest), sources) =
            postcard::take_from_bytes(bytes).ok()?;
        Some(Self {
            schedule,
            effort,
            parts,
            split,
            digest,
            sources: TrainingSources::from_bytes(sources)?,
        })
    }
}
