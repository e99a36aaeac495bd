//! The inverse of a covariance.

use nalgebra::{Cholesky, DMatrix};

/// The order from which on a matrix is inverted by blocks, whose products are several times faster than a factorization.
const BLOCK: usize = 96;

/// Returns the inverse of a symmetric positive definite matrix. None if it is not positive definite.
///
/// A large matrix has blocks A, B, B', D. With S = D - B' A^-1 B and W = A^-1 B, its inverse has the blocks
/// A^-1 + W S^-1 W', -W S^-1 and S^-1.
pub(super) fn inverse(matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let order = matrix.nrows();
    if order <= BLOCK {
        return Some(Cholesky::new(matrix)?.inverse());
    }
    let half = order / 2;
    let rest = order - half;
    let off_diagonal = matrix.view((0, half), (half, rest)).into_owned();
    let first = inverse(matrix.view((0, 0), (half, half)).into_owned())?;
    let weighted = &first * &off_diagonal;
    let mut schur = matrix.view((half, half), (rest, rest)).into_owned();
    drop(matrix);
    schur.gemm(-1.0, &off_diagonal.transpose(), &weighted, 1.0);
    drop(off_diagonal);
    let second = inverse(schur)?;
    let outer = &weighted * &second;
    let mut inverse = DMatrix::zeros(order, order);
    let mut top_left = inverse.view_mut((0, 0), (half, half));
    top_left.copy_from(&first);
    top_left.gemm(1.0, &outer, &weighted.transpose(), 1.0);
    inverse
        .view_mut((half, half), (rest, rest))
        .copy_from(&second);
    inverse
        .view_mut((0, half), (half, rest))
        .copy_from(&-&outer);
    inverse
        .view_mut((half, 0), (rest, half))
        .copy_from(&-outer.transpose());
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_the_inverse_of_the_whole() {
        let order = 2 * BLOCK + 37;
        let entry = |i: usize, j: usize| 0.9_f64.powi(i.abs_diff(j) as i32);
        let matrix = DMatrix::from_fn(order, order, entry);
        let inverse = inverse(matrix.clone()).expect("positive definite");
        let error = (&matrix * inverse - DMatrix::identity(order, order)).amax();
        assert!(error < 1e-12, "{error}");
        assert!(super::inverse(-matrix).is_none());
    }
}
