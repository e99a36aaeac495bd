//! The sections of a recipe: for each a structure that postcard decodes, and one table of its fields.
//!
//! From the table come the checks of a recipe, the names in its errors, the lists in `docs/recipe.md`, and the test
//! that damages every field.

mod counts;

pub use counts::{Count, Counts, MAX_COMPONENTS, MAX_PRECISION, MAX_SAMPLES, MIN_PRECISION};

use crate::error::{Error, ErrorCode};
use crate::model::ModelKind;
use crate::numeric::{Floats, PackedRows};

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
    /// The factors of a list's length.
    pub length: &'static [Count],
    /// True if a list may be empty instead.
    pub optional: bool,
    /// The range of each number.
    pub range: (f32, f32),
    /// The name of the type. Firmware omits it.
    #[cfg(feature = "training")]
    pub encoding: &'static str,
    /// The documentation, a list of lines. Firmware omits it.
    #[cfg(feature = "training")]
    pub text: &'static [&'static str],
}

impl Field {
    /// Checks the length and all numbers of the field. Not inlined, because it is called for many fields.
    #[inline(never)]
    pub(crate) fn check(&self, numbers: Numbers<'_>, counts: &Counts) -> Result<(), Error> {
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
            return Err(Error::in_field(ErrorCode::RecipeCount, self.name));
        }
        let numbers = match numbers {
            Numbers::Any | Numbers::Bytes(_) => return Ok(()),
            Numbers::One(number) => return self.check_number(number),
            Numbers::List(list) => list,
            Numbers::Rows(rows) => rows.floats(),
        };
        numbers
            .iter()
            .try_for_each(|number| self.check_number(number))
    }

    #[inline(always)]
    fn check_number(&self, number: f32) -> Result<(), Error> {
        let (min, max) = self.range;
        if (min..=max).contains(&number) {
            return Ok(());
        }
        if number.is_finite() {
            return Err(Error::in_field(ErrorCode::RecipeRange, self.name));
        }
        Err(Error::in_field(ErrorCode::RecipeNonFinite, self.name))
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
                length: &[$($(crate::section::Count::$count),+)?],
                optional: false $(|| $optional)?,
                range: crate::section::range(&[$($min, $max)?]),
                #[cfg(feature = "training")]
                encoding: <$field_type as crate::section::FieldType>::NAME,
                #[cfg(feature = "training")]
                text: &[$($text),+],
            }),+];

            // Not inlined, so that its stack is released.
            #[inline(never)]
            fn check(
                &self,
                counts: &crate::section::Counts,
            ) -> Result<(), crate::error::Error> {
                let mut fields = Self::FIELDS.iter();
                let mut check = |numbers| fields.next().map_or(Ok(()), |field| field.check(numbers, counts));
                $(check(crate::section::FieldType::numbers(self.$field))?;)+
                Ok(())
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
