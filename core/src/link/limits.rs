//! Sizes of messages.

/// The largest number of values in one [`Request::Values`](super::Request::Values). A line that loses one byte in a
/// hundred delivers about half of all frames of 80 bytes, and an eighth of those of 200 bytes.
pub const VALUES_PER_FRAME: usize = 16;
/// The largest number of bytes in one [`Reply::RecipePart`](super::Reply::RecipePart).
pub const BYTES_PER_FRAME: usize = 60;

/// The values in one [`Request::Values`](super::Request::Values).
pub type Values = heapless::Vec<f32, VALUES_PER_FRAME>;
/// The bytes in one [`Reply::RecipePart`](super::Reply::RecipePart).
pub type RecipeBytes = heapless::Vec<u8, BYTES_PER_FRAME>;
