//! Parts of a list.

/// Splits off consecutive parts of these lengths. None if the list is too short.
#[inline(always)]
pub fn split<S, const N: usize>(list: &mut [S], lengths: [usize; N]) -> Option<[&mut [S]; N]> {
    let mut rest = Some(list);
    let parts = lengths.map(|length| {
        let (part, after) = rest.take()?.split_at_mut_checked(length)?;
        rest = Some(after);
        Some(part)
    });
    rest.map(|_| parts.map(Option::unwrap_or_default))
}
