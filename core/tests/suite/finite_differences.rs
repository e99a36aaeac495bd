//! Comparison of derivatives with central differences in f64.

/// Compares each derivative with a central difference of fourth order, with steps of 1e-3. `bound` is the largest error
/// relative to the largest derivative.
pub(crate) fn assert_derivatives(
    name: &str,
    derivatives: &[f64],
    at: &[f64],
    bound: f64,
    function: impl Fn(Vec<f64>) -> f64,
) {
    let scale = derivatives.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    // Rounding may change a difference by 1e-13.
    let is_resolved = scale * bound >= 1e-12 || derivatives.is_empty();
    assert!(is_resolved, "{name} has no derivative: {scale:e}");
    assert_eq!(derivatives.len(), at.len(), "{name}");
    let step = 1e-3;
    for (index, derivative) in derivatives.iter().enumerate() {
        let mut difference = 0.0;
        for (offset, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
            let mut moved = at.to_vec();
            moved[index] += offset * step;
            difference += weight * function(moved);
        }
        difference /= 12.0 * step;
        let error = (derivative - difference).abs() / scale;
        assert!(
            error < bound,
            "{name} {index}: the derivative is {derivative:e}, the difference {difference:e}"
        );
    }
}
