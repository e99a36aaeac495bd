//! The memory of a scan, computed from recipes at compile time.

use super::format::{HEADER_BYTES, MAGIC, MAX_COMPONENTS};
use super::kind::Kind;
use crate::fit::coefficient_net::LISTS;
use crate::fit::{correction_words, descent_words, linear_words, refined_words};
use crate::model::{Active, ModelKind, SLOT_WORDS};

/// Number of bytes of a sample of the pattern: three angles.
const ANGLES_BYTES: usize = 12;

/// Returns the memory that a scan needs with any of these recipes, in words of 4 bytes.
///
/// Firmware calls it at compile time, for the length of an array.
///
/// ```
/// use glimpse_core::recipe::memory_words;
///
/// static RECIPE: &[u8] = include_bytes!("../../examples/recipes/phong-n8.recipe");
/// const WORDS: usize = memory_words(&[RECIPE]);
/// let memory = [0.0_f32; WORDS];
/// assert_eq!(size_of_val(&memory), 380);
/// ```
///
/// If one of them is not a recipe, the result is `usize::MAX`, and memory of that size does not compile:
///
/// ```compile_fail
/// use glimpse_core::recipe::memory_words;
///
/// let memory = [0.0_f32; memory_words(&[b"not a recipe"])];
/// ```
#[must_use]
pub const fn memory_words(recipes: &[&[u8]]) -> usize {
    largest(recipes).words
}

/// Returns the largest number of samples, n, of these recipes.
///
/// Firmware calls it at compile time, for the capacity of [saved readings](crate::scan::Saved):
/// `Saved<{ max_samples(&RECIPES) }>`. If one of them is not a recipe, the result is `usize::MAX`, as with
/// [`memory_words`].
#[must_use]
pub const fn max_samples(recipes: &[&[u8]]) -> usize {
    largest(recipes).samples
}

#[derive(Clone, Copy)]
struct Size {
    samples: usize,
    words: usize,
}

const fn largest(recipes: &[&[u8]]) -> Size {
    let (mut samples, mut words) = (0, 0);
    let mut recipes = recipes;
    while let [recipe, rest @ ..] = recipes {
        let size = match recipe_size(recipe) {
            Some(size) => size,
            None => Size {
                samples: usize::MAX,
                words: usize::MAX,
            },
        };
        samples = max(samples, size.samples);
        words = max(words, size.words);
        recipes = rest;
    }
    Size { samples, words }
}

const fn max(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

/// Counts in the sections of a recipe that determine its size.
#[derive(Clone, Copy)]
struct Counts {
    samples: usize,
    /// Components of a ridge solve.
    components: Option<usize>,
    /// Parameters of a descent.
    parameters: Option<usize>,
    /// Parameters of Gauss-Newton steps, and the active ones.
    steps: Option<(usize, Active)>,
    /// Words of a completion without its init net.
    completion: usize,
    /// Units of the init net.
    units: usize,
    has_correction: bool,
}

/// Unwraps an option, or returns None.
macro_rules! some {
    ($option:expr) => {
        match $option {
            Some(value) => value,
            None => return None,
        }
    };
}

const fn recipe_size(recipe: &[u8]) -> Option<Size> {
    let (header, body) = some!(recipe.split_at_checked(HEADER_BYTES));
    let magic = some!(header.first_chunk());
    if u32::from_le_bytes(*magic) != u32::from_le_bytes(MAGIC) {
        return None;
    }
    let mut counts = Counts {
        samples: 0,
        components: None,
        parameters: None,
        steps: None,
        completion: 0,
        units: 0,
        has_correction: false,
    };
    let mut rest = body;
    while !rest.is_empty() {
        let (kind, after) = some!(number(rest));
        let (bytes, after) = some!(list(after));
        rest = after;
        counts = match some!(kind_of(kind)) {
            Kind::PATTERN => {
                let (angles, _) = some!(list(bytes));
                let samples = angles.len() / ANGLES_BYTES;
                Counts { samples, ..counts }
            }
            Kind::DESCENT => some!(descent(bytes, counts)),
            Kind::RIDGE => {
                let (components, _) = some!(number(bytes));
                if components > MAX_COMPONENTS {
                    return None;
                }
                let components = Some(components);
                Counts {
                    components,
                    ..counts
                }
            }
            Kind::COMPLETION => some!(coefficient_net(bytes, counts)),
            Kind::START => some!(init_net(bytes, counts)),
            Kind::CORRECTION => some!(correction(bytes, counts)),
            Kind::GAUSS_NEWTON => some!(gauss_newton(bytes, counts)),
            _ => counts,
        };
    }
    let completion = counts.completion.saturating_add(counts.units);
    let work = match (counts.steps, counts.parameters, counts.components) {
        (Some((parameters, active)), _, _) => refined_words(parameters, active, completion),
        (None, Some(parameters), _) => descent_words(parameters, completion, counts.has_correction),
        (None, None, Some(components)) => linear_words(counts.samples, components),
        (None, None, None) => completion,
    };
    let samples = counts.samples;
    let words = samples.saturating_mul(SLOT_WORDS).saturating_add(work);
    Some(Size { samples, words })
}

const fn kind_of(number: usize) -> Option<Kind> {
    if number > u16::MAX as usize {
        return None;
    }
    Some(Kind::new(number as u16))
}

/// Reads model, inner steps and initial parameters.
const fn descent(bytes: &[u8], counts: Counts) -> Option<Counts> {
    let (_model, rest) = some!(number(bytes));
    let (_inner_steps, rest) = some!(number(rest));
    let (initial, _) = some!(list(rest));
    let parameters = Some(initial.len() / 4);
    Some(Counts {
        parameters,
        ..counts
    })
}

/// Reads components, missing policy, center, scale, readings and scales of rows.
const fn coefficient_net(bytes: &[u8], counts: Counts) -> Option<Counts> {
    let (_components, rest) = some!(number(bytes));
    let (_missing, rest) = some!(rest.split_first());
    let (_center, rest) = some!(list(rest));
    let (_scale, rest) = some!(rest.split_at_checked(4));
    let (_readings, rest) = some!(list(rest));
    let (scales, _) = some!(list(rest));
    let words = LISTS.saturating_mul(scales.len() / 4);
    let completion = counts.completion.saturating_add(words);
    Some(Counts {
        completion,
        ..counts
    })
}

/// Reads model, steps and initial parameters.
const fn gauss_newton(bytes: &[u8], counts: Counts) -> Option<Counts> {
    let (model, rest) = some!(number(bytes));
    let (_steps, rest) = some!(number(rest));
    let (initial, _) = some!(list(rest));
    let active = some!(some!(ModelKind::from_number(model)).active());
    let steps = Some((initial.len() / 4, active));
    Some(Counts { steps, ..counts })
}

/// Reads rows and the scales of components.
const fn correction(bytes: &[u8], counts: Counts) -> Option<Counts> {
    let (_rows, rest) = some!(list(bytes));
    let (scales, _) = some!(list(rest));
    let components = scales.len() / 4;
    if components > MAX_COMPONENTS {
        return None;
    }
    let words = correction_words(components);
    let completion = counts.completion.saturating_add(words);
    Some(Counts {
        completion,
        has_correction: true,
        ..counts
    })
}

/// Reads hidden weights and scales of their rows.
const fn init_net(bytes: &[u8], counts: Counts) -> Option<Counts> {
    let (_hidden, rest) = some!(list(bytes));
    let (scales, _) = some!(list(rest));
    let units = scales.len() / 4;
    Some(Counts { units, ..counts })
}

/// Returns a number in postcard's encoding (a varint), and the bytes after it.
const fn number(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let mut value = 0_usize;
    let mut shift = 0_u32;
    let mut rest = bytes;
    while let [byte, after @ ..] = rest {
        rest = after;
        let low = (*byte & 0x7f) as usize;
        let shifted = some!(low.checked_shl(shift));
        value |= shifted;
        if *byte < 0x80 {
            return Some((value, rest));
        }
        shift = shift.saturating_add(7);
    }
    None
}

/// Returns a list of bytes in postcard's encoding, and the bytes after it.
const fn list(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = some!(number(bytes));
    rest.split_at_checked(length)
}
