//! A recipe's pattern as CSV, for whoever has a program of their own.

use glimpse_core::recipe::Recipe;

/// `index,theta_h,theta_d,phi_d`, a row for each sample: its number, from 0, and Rusinkiewicz angles in
/// degrees, with digits enough to get the same 32-bit floats back in radians. `trainer query` and
/// `trainer fit` read such columns.
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
    fn angles_come_back_to_the_bit() {
        let bytes = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");
        let recipe = Recipe::parse(bytes).expect("it is a recipe");
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
