//! Export of a recipe's pattern as CSV, for other programs.

use glimpse_core::recipe::Recipe;

/// Returns CSV with the header `index,theta_h,theta_d,phi_d` and one row per sample: the index from 0, and the
/// Rusinkiewicz angles in degrees. The angles have enough digits to restore the exact 32-bit floats in radians.
/// `trainer query` and `trainer fit` read these columns.
#[must_use]
pub fn to_csv(recipe: &Recipe<'_>) -> String {
    let rows = recipe.pattern().enumerate().map(|(index, angles)| {
        let [theta_h, theta_d, phi_d] = [angles.theta_h, angles.theta_d, angles.phi_d]
            .map(|radians| f64::from(radians).to_degrees());
        format!("{index},{theta_h},{theta_d},{phi_d}\n")
    });
    std::iter::once("index,theta_h,theta_d,phi_d\n".to_owned())
        .chain(rows)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_round_trip_exactly() {
        let bytes = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");
        let recipe = Recipe::parse(bytes).expect("the recipe is valid");
        let csv = to_csv(&recipe);
        let mut rows = csv.lines().skip(1);
        for (index, angles) in recipe.pattern().enumerate() {
            let row: Vec<f64> = rows
                .next()
                .expect("a row for each sample")
                .split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect();
            assert_eq!(row[0], index as f64);
            let radians = [row[1], row[2], row[3]].map(|degrees| degrees.to_radians() as f32);
            assert_eq!(radians, [angles.theta_h, angles.theta_d, angles.phi_d]);
        }
        assert_eq!(rows.next(), None);
    }
}
