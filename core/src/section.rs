//! The sections of a recipe: for each a structure that postcard decodes, and one table of its fields.
//!
//! From the table come the checks of a recipe, the names in its errors, the tables in `docs/recipe.md`, and the test
//! that damages every field.

use core::ops::RangeInclusive;

use crate::error::{Error, ErrorCode};
use crate::model::ModelKind;
use crate::numeric::{Floats, PackedRows};

/// A count in a recipe, which determines lengths of lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// n, samples of the pattern.
    Samples,
    /// K, components of the ridge stage.
    Components,
    /// m, coefficients that the net computes for each channel.
    Coefficients,
    /// m + h, coefficients and hidden units of the net.
    Rows,
    /// h, hidden units of the net.
    Hidden,
    /// g, units of the start.
    Units,
    /// P, parameters of the model.
    Parameters,
    /// A, active parameters of a Gauss-Newton system.
    Active,
    /// V, virtual readings.
    VirtualReadings,
    /// 1 + m, weights of the predicted loss.
    Weights,
    /// 3, channels or angles.
    Three,
}

impl Count {
    /// The symbol in documents, and the smallest and largest count.
    #[must_use]
    pub const fn bounds(self) -> (&'static str, RangeInclusive<usize>) {
        match self {
            Self::Samples => ("n", 1..=MAX_SAMPLES),
            Self::Components => ("K", 1..=MAX_COMPONENTS),
            Self::Coefficients => ("m", 1..=96),
            Self::Rows => ("(m + h)", 1..=96),
            Self::Hidden => ("h", 0..=95),
            Self::Units => ("g", 1..=32),
            Self::Parameters => ("P", 1..=usize::MAX),
            Self::Active => ("A", 1..=usize::MAX),
            Self::VirtualReadings => ("V", 1..=1024),
            Self::Weights => ("(1 + m)", 1..=usize::MAX),
            Self::Three => ("3", 3..=3),
        }
    }
}

/// The largest number of samples.
pub const MAX_SAMPLES: usize = 4096;
/// The smallest precision of a coefficient or parameter.
pub const MIN_PRECISION: f32 = 1e-6;
/// The largest precision.
pub const MAX_PRECISION: f32 = 1e8;
/// The largest number of components.
pub const MAX_COMPONENTS: usize = 1024;

/// The counts of a recipe, in the order of [`Count`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts(pub [usize; 11]);

impl Counts {
    fn get(&self, count: Count) -> usize {
        self.0.get(count as usize).copied().unwrap_or_default()
    }

    pub(crate) fn set(&mut self, count: Count, value: usize) {
        if let Some(entry) = self.0.get_mut(count as usize) {
            *entry = value;
        }
    }
}

/// The numbers of a field.
#[derive(Clone, Copy, Debug)]
pub enum Numbers<'a> {
    /// None, or one that any value of its type fits.
    Any,
    /// A single number.
    One(f32),
    /// A list.
    List(Floats<'a>),
    /// Signed bytes.
    Bytes(&'a [u8]),
    /// Components at directions.
    Rows(PackedRows<'a>),
}

/// The type of a field.
pub trait FieldType: Copy {
    /// The name in documents.
    const NAME: &'static str;

    /// The numbers, for checks.
    fn numbers<'a>(self) -> Numbers<'a>
    where
        Self: 'a;
}

/// Implements [`FieldType`].
macro_rules! field_types {
    ($($type:ty, $name:literal, $value:ident => $numbers:expr;)+) => {$(
        impl FieldType for $type {
            const NAME: &'static str = $name;
            fn numbers<'b>(self) -> Numbers<'b>
            where
                Self: 'b,
            {
                let $value = self;
                $numbers
            }
        }
    )+};
}

field_types! {
    bool, "0 or 1", _value => Numbers::Any;
    u8, "u8", value => Numbers::One(value.into());
    u16, "varint", value => Numbers::One(value.into());
    u32, "varint", _value => Numbers::Any;
    f32, "f32", value => Numbers::One(value);
    Option<f32>, "0, or 1 and f32", value => value.map_or(Numbers::Any, Numbers::One);
    ModelKind, "varint", value => Numbers::One(f32::from(value as u8));
    Floats<'_>, "list", value => Numbers::List(value);
    &[u8], "bytes", value => Numbers::Bytes(value);
    PackedRows<'_>, "rows", value => Numbers::Rows(value);
}

/// The description of a field.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// The names of section and field, as `ridge.center`.
    pub name: &'static str,
    /// The name of the type.
    pub encoding: &'static str,
    /// The documentation, a list of lines.
    pub text: &'static [&'static str],
    /// The factors of a list's length.
    pub length: &'static [Count],
    /// True if a list may be empty instead.
    pub optional: bool,
    /// The range of each number.
    pub range: (f32, f32),
}

impl Field {
    /// Returns an error of this field.
    pub(crate) const fn error(&self, code: ErrorCode) -> Error {
        Error {
            code,
            field: self.name,
            details: [0; 2],
        }
    }

    /// Checks the length and all numbers of the field. Not inlined, because it is called for many fields.
    #[inline(never)]
    fn check(&self, numbers: Numbers<'_>, counts: &Counts) -> Result<(), Error> {
        let mut length = 1_usize;
        let mut is_possible = true;
        for count in self.length {
            let value = counts.get(*count);
            is_possible &= count.bounds().1.contains(&value);
            length = length.saturating_mul(value);
        }
        let fits = match numbers {
            Numbers::Any | Numbers::One(_) => true,
            Numbers::List(list) => list.has_length(length) || self.optional && list.has_length(0),
            Numbers::Bytes(bytes) => bytes.len() == length,
            Numbers::Rows(rows) => {
                let components = self.length.last().map_or(1, |count| counts.get(*count));
                rows.has_length(length, components)
            }
        };
        if !(is_possible && fits) {
            return Err(self.error(ErrorCode::RecipeCount));
        }
        match numbers {
            Numbers::One(number) => self.check_number(number),
            Numbers::List(list) => list.iter().try_for_each(|number| self.check_number(number)),
            Numbers::Rows(rows) => {
                let mut numbers = rows.floats().iter();
                numbers.try_for_each(|number| self.check_number(number))
            }
            Numbers::Any | Numbers::Bytes(_) => Ok(()),
        }
    }

    #[inline(always)]
    fn check_number(&self, number: f32) -> Result<(), Error> {
        let (min, max) = self.range;
        if (min..=max).contains(&number) {
            return Ok(());
        }
        Err(self.error(match number.is_finite() {
            true => ErrorCode::RecipeRange,
            false => ErrorCode::RecipeNonFinite,
        }))
    }
}

/// A section of a recipe.
pub trait Section {
    /// The number of its kind.
    const KIND: u16;
    /// Its name.
    const NAME: &'static str;
    /// Its fields, in order.
    const FIELDS: &'static [Field];

    /// Checks all fields.
    ///
    /// # Errors
    /// The first field with a wrong length or number.
    fn check(&self, counts: &Counts) -> Result<(), Error>;
}

pub(crate) fn check_all<const N: usize>(
    fields: &[Field],
    numbers: [Numbers<'_>; N],
    counts: &Counts,
) -> Result<(), Error> {
    let mut pairs = fields.iter().zip(numbers);
    pairs.try_for_each(|(field, numbers)| field.check(numbers, counts))
}

/// Defines a section: its structure, and the table of its fields.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        $type:ident<$life:lifetime> = $kind:literal, $section:literal {$(
            $(#[doc = $text:literal])+
            $field:ident: $field_type:ty
            $(, [$($count:ident),+])? $(, optional $optional:literal)? $(, in $min:expr => $max:expr)?;
        )+}
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
        #[serde(bound(deserialize = "'de: 'a"))]
        pub struct $type<$life> {$(
            $(#[doc = $text])+
            pub $field: $field_type,
        )+}

        impl<$life> crate::section::Section for $type<$life> {
            const KIND: u16 = $kind;
            const NAME: &'static str = $section;
            const FIELDS: &'static [crate::section::Field] = &[$(crate::section::Field {
                name: concat!($section, ".", stringify!($field)),
                encoding: <$field_type as crate::section::FieldType>::NAME,
                text: &[$($text),+],
                length: &[$($(crate::section::Count::$count),+)?],
                optional: false $(|| $optional)?,
                range: crate::section::range(&[$($min, $max)?]),
            }),+];

            fn check(
                &self,
                counts: &crate::section::Counts,
            ) -> Result<(), crate::error::Error> {
                use crate::section::FieldType;
                crate::section::check_all(Self::FIELDS, [$(self.$field.numbers()),+], counts)
            }
        }
    };
}
pub(crate) use section;

/// The range of a field's numbers; without bounds, all finite numbers.
pub(crate) const fn range(bounds: &[f32]) -> (f32, f32) {
    match bounds {
        [min, max] => (*min, *max),
        _ => (f32::MIN, f32::MAX),
    }
}
