//! Detection of numbers that are cut off at one largest value, as those of a saturated sensor.

use std::collections::BTreeSet;

use glimpse_core::geometry::Angles;

/// The least evidence of clipping: the decimal logarithm of the odds against equal numbers by chance.
const MIN_EVIDENCE: f64 = 3.0;

/// Finds the rows with a number that is cut off, given their directions and numbers.
///
/// Numbers at the largest value of a column are cut off if the gap below it is many times the resolution
/// of the numbers: one more number is that close by chance in about one of gap / resolution cases. Numbers of a matte
/// material that are equal by rounding have neighbors within a few times the resolution, and interpolated or gray ones have
/// equal numbers at the second largest value, too.
#[must_use]
pub fn clipped_rows(rows: &[(Angles<f32>, &[f32])]) -> Vec<bool> {
    // Reciprocal and mirrored directions may have equal numbers without a cause.
    let place = |angles: &Angles<f32>| {
        [angles.theta_h, angles.theta_d].map(|angle| (100.0 * angle.to_degrees()).round() as i64)
    };
    let cells = rows.iter().flat_map(|(angles, numbers)| {
        let cells = numbers.iter().enumerate();
        cells.map(move |(column, number)| (*number, column, place(angles)))
    });
    let mut cells: Vec<_> = cells.filter(|(number, ..)| *number > 0.0).collect();
    cells.sort_by(|one, other| other.0.total_cmp(&one.0));
    let differences = cells.windows(2).map(|pair| pair[0].0 - pair[1].0);
    let differences = differences.filter(|difference| *difference > 0.0);
    let resolution = differences.fold(f32::INFINITY, f32::min);
    // The largest number of a column, if it is cut off.
    let limit = |column: usize| {
        let cells = || cells.iter().filter(|cell| cell.1 == column);
        let largest = cells().next()?.0;
        let second = cells().find(|cell| cell.0 < largest)?.0;
        let count = |number: f32| {
            let equal = cells().filter(|cell| cell.0 == number);
            let places: BTreeSet<_> = equal.map(|cell| cell.2).collect();
            places.len()
        };
        let odds = f64::from((largest - second) / resolution);
        let evidence = (count(largest) as f64 - 1.0) * odds.log10();
        (evidence >= MIN_EVIDENCE && count(second) == 1).then_some(largest)
    };
    let columns = rows.iter().map(|(_, numbers)| numbers.len()).max();
    let limits: Vec<_> = (0..columns.unwrap_or(0)).map(limit).collect();
    let is_clipped = |(number, limit): (&f32, &Option<f32>)| Some(*number) == *limit;
    let clipped = rows
        .iter()
        .map(|(_, numbers)| numbers.iter().zip(&limits).any(is_clipped));
    clipped.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number of clipped rows of a lobe in two channels, whose numbers were changed.
    fn clipped(change: impl Fn(f32) -> f32) -> usize {
        let numbers: Vec<[f32; 2]> = (0..33_u8)
            .map(|step| (f32::from(step) - 15.3) / 4.0)
            .map(|x| [0.1, 0.23].map(|diffuse| change(diffuse + 0.7 / (1.0 + x * x))))
            .collect();
        let rows = numbers.iter().enumerate().map(|(step, row)| {
            let at = Angles::from_array([0.0, 0.03 * step as f32, 0.0]);
            (at, &row[..])
        });
        let is_clipped = clipped_rows(&rows.collect::<Vec<_>>());
        is_clipped.into_iter().filter(|one| *one).count()
    }

    #[test]
    fn numbers_at_a_limit_are_clipped_but_rounded_ones_are_not() {
        assert_eq!(clipped(|number| number), 0);
        assert_eq!(clipped(|number| number.min(0.6)), 8);
        assert_eq!(clipped(|number| (4095.0 * number).round().min(2457.0)), 8);
        for digits in [10.0, 100.0, 1000.0] {
            assert_eq!(clipped(|number| (number * digits).round() / digits), 0);
        }
    }
}
