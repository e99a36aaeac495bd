//! The writer of recipes.

use postcard::ser_flavors::Size;
use serde::Serialize;

use super::error::RecipeError;
use super::format::HEADER_BYTES;
use super::header;
use super::kind::Kind;
use super::parts::{PackedMethod, PackedTarget, RecipeParts};

/// A recipe under construction. Sections must be added in ascending order of their kinds.
pub(super) struct Writer<'b> {
    buffer: &'b mut [u8],
    /// Number of bytes in use, including the header.
    used: usize,
}

impl<'b> Writer<'b> {
    /// Creates a writer that leaves room for the header.
    pub(super) fn new(buffer: &'b mut [u8]) -> Self {
        Self {
            buffer,
            used: HEADER_BYTES,
        }
    }

    /// Writes the sections of all parts.
    pub(super) fn parts(&mut self, parts: &RecipeParts<'_>) -> Result<(), RecipeError> {
        self.section(Kind::PATTERN, &parts.pattern)?;
        match &parts.method {
            PackedMethod::Descent(descent) => self.section(Kind::DESCENT, descent)?,
            PackedMethod::Ridge(ridge) => self.section(Kind::RIDGE, ridge)?,
            PackedMethod::Completed(completion, correction, target) => {
                if let PackedTarget::Descent(descent, _) = target {
                    self.section(Kind::DESCENT, descent)?;
                }
                self.section(Kind::COMPLETION, completion)?;
                match target {
                    PackedTarget::Linear => {}
                    PackedTarget::Descent(_, init_net) => self.section(Kind::START, init_net)?,
                    PackedTarget::GaussNewton(steps, init_net) => {
                        self.section(Kind::START, init_net)?;
                        self.section(Kind::GAUSS_NEWTON, steps)?;
                    }
                }
                if let Some(correction) = correction {
                    self.section(Kind::CORRECTION, correction)?;
                }
            }
        }
        if let Some(loss) = &parts.expected_loss {
            self.section(Kind::EXPECTATION, loss)?;
        }
        if let Some(prediction) = &parts.prediction {
            self.section(Kind::PREDICTION, prediction)?;
        }
        if let Some(uncertainty) = &parts.uncertainty {
            self.section(Kind::UNCERTAINTY, uncertainty)?;
        }
        if parts.is_in_path_order {
            self.copy(Kind::PATH_ORDER, &[])?;
        }
        if let Some(partial) = &parts.partial {
            self.section(Kind::PARTIAL, partial)?;
        }
        if !parts.metadata.is_empty() {
            self.copy(Kind::METADATA, parts.metadata)?;
        }
        Ok(())
    }

    /// Writes a section from its postcard bytes.
    pub(super) fn copy(&mut self, kind: Kind, bytes: &[u8]) -> Result<(), RecipeError> {
        self.push(&(kind, bytes))
    }

    /// Writes the header, and returns the recipe.
    pub(super) fn finish(self) -> Result<&'b [u8], RecipeError> {
        let bytes = self
            .buffer
            .get_mut(..self.used)
            .ok_or(RecipeError::BufferTooSmall)?;
        header::write(bytes)?;
        Ok(bytes)
    }

    fn section<T: Serialize>(&mut self, kind: Kind, value: &T) -> Result<(), RecipeError> {
        // The length precedes the value.
        let length: usize = postcard::serialize_with_flavor(value, Size::default())
            .map_err(|_| RecipeError::Section(kind))?;
        self.push(&(kind, length))?;
        self.push(value)
    }

    fn push<T: Serialize>(&mut self, value: &T) -> Result<(), RecipeError> {
        let too_small = RecipeError::BufferTooSmall;
        let free = self.buffer.get_mut(self.used..).ok_or(too_small)?;
        let written = postcard::to_slice(value, free)
            .map_err(|_| too_small)?
            .len();
        self.used = self.used.saturating_add(written);
        Ok(())
    }
}
