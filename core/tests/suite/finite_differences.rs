//! Slopes against central differences in f64.

/// Compares each slope with a central difference of fourth order, of steps of 1e-3. The largest error, relative
/// to the largest slope, is `bound`.
pub(crate) fn assert_derivatives(
    what: &str,
    slopes: &[f64],
    at: &[f64],
    bound: f64,
    function: impl Fn(Vec<f64>) -> f64,
) {
    let scale = slopes.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    // Rounding may move a difference by 1e-13.
    let is_resolved = scale * bound >= 1e-12 || slopes.is_empty();
    assert!(is_resolved, "{what} has no slope: {scale:e}");
    assert_eq!(slopes.len(), at.len(), "{what}");
    let step = 1e-3;
    for (index, slope) in slopes.iter().enumerate() {
        let mut difference = 0.0;
        for (place, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
            let mut moved = at.to_vec();
            moved[index] += place * step;
            difference += weight * function(moved);
        }
        difference /= 12.0 * step;
        let error = (slope - difference).abs() / scale;
        assert!(
            error < bound,
            "{what} {index}: the slope is {slope:e}, the difference {difference:e}"
        );
    }
}
