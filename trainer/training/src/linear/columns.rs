//! Materials as columns: l = ln(brdf w + e) at the nodes of the grid, a column for each channel.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::map;
use glimpse_materials::Material;
use glimpse_materials::basis::Grid;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Columns of one or more materials, three each (red, green, blue), node by node.
pub struct Columns {
    /// l of all columns at each node: `Grid::LEN` rows of `count`.
    values: Vec<f32>,
    count: usize,
    /// Which materials they are of, in order.
    materials: Vec<usize>,
    /// x'y of each pair of columns over the valid nodes, row by row; of what is left of columns when
    /// at each node the mean of all of them is taken away.
    products: Vec<f64>,
}

/// How many materials are tabulated at most. A column takes half a megabyte, and the time for the
/// principal components grows with the third power of their number, while the few that are taken of
/// them hardly change any more.
pub const MOST_TABULATED: usize = 512;

/// Nodes that one thread works on at a time.
const BLOCK: usize = 512;

impl Columns {
    /// Tabulates materials; of more than [`MOST_TABULATED`] as many as that, chosen at random but always
    /// the same.
    ///
    /// The grid has period pi in phi_d, as reciprocity asks; a material that is not quite
    /// reciprocal is averaged over both.
    #[must_use]
    pub fn new(materials: &[Box<dyn Material>]) -> Self {
        let chosen = chosen(materials.len());
        let count = 3 * chosen.len();
        let nodes: Vec<usize> = (0..Grid::LEN).collect();
        let places: Vec<(HalfDifference<f32>, HalfDifference<f32>, f64)> = nodes
            .iter()
            .map(|node| {
                let angles = Grid::angles(*node);
                let at = HalfDifference::from_angles(angles);
                let weight = at.cos_theta_i().max(0.0) * at.cos_theta_o().max(0.0);
                let narrow = |phi_d: f64| {
                    HalfDifference::from_angles(Angles {
                        theta_h: angles.theta_h as f32,
                        theta_d: angles.theta_d as f32,
                        phi_d: phi_d as f32,
                    })
                };
                let opposite = angles.phi_d + std::f64::consts::PI;
                (narrow(angles.phi_d), narrow(opposite), weight)
            })
            .collect();
        let mut values = vec![0.0; Grid::LEN * count];
        values
            .par_chunks_mut(BLOCK * count)
            .zip(places.par_chunks(BLOCK))
            .for_each(|(rows, places)| {
                let (one, other): (Vec<_>, Vec<_>) =
                    places.iter().map(|(one, other, _)| (*one, *other)).unzip();
                let mut brdf = [vec![[0.0; 3]; places.len()], vec![[0.0; 3]; places.len()]];
                for (index, material) in chosen.iter().map(|at| &materials[*at]).enumerate() {
                    material.brdf_batch(&one, &mut brdf[0]);
                    let opposite = usize::from(!material.is_reciprocal());
                    if opposite > 0 {
                        material.brdf_batch(&other, &mut brdf[opposite]);
                    }
                    material.release();
                    let measured = brdf[0].iter().zip(&brdf[opposite]).zip(places);
                    for (row, ((one, other), (_, _, weight))) in
                        rows.chunks_mut(count).zip(measured)
                    {
                        for channel in 0..3 {
                            let mean = 0.5 * (f64::from(one[channel]) + f64::from(other[channel]));
                            // ln((brdf w + e) / e): without a median, and so far from 0 that
                            // single precision serves.
                            row[3 * index + channel] = map(mean, 0.0, *weight) as f32;
                        }
                    }
                }
            });
        let products = products(&values, count);
        Self {
            values,
            count,
            materials: chosen,
            products,
        }
    }

    /// How many columns there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The columns of those materials that a condition holds for, by their places in the list that was
    /// tabulated.
    pub fn of(&self, condition: impl Fn(usize) -> bool) -> Vec<usize> {
        let each = self.materials.iter().enumerate();
        each.filter(|(_, material)| condition(**material))
            .flat_map(|(place, _)| 3 * place..3 * place + 3)
            .collect()
    }

    /// l / ln(e), shifted: all columns at a node.
    #[must_use]
    pub fn at(&self, node: usize) -> &[f32] {
        &self.values[node * self.count..][..self.count]
    }

    /// The sum over the valid nodes of one column times another, the mean of all columns taken away
    /// from both: it is the same for whoever centers columns, and less is lost to rounding.
    #[must_use]
    pub fn product(&self, one: usize, other: usize) -> f64 {
        self.products[one * self.count + other]
    }
}

/// Which of so many materials are tabulated, in order.
fn chosen(materials: usize) -> Vec<usize> {
    if materials <= MOST_TABULATED {
        return (0..materials).collect();
    }
    // Not at equal distances: neither folds nor portions may fall between them.
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut chosen: Vec<usize> = (0..materials).collect();
    chosen.shuffle(&mut random);
    chosen.truncate(MOST_TABULATED);
    chosen.sort_unstable();
    chosen
}

fn products(values: &[f32], count: usize) -> Vec<f64> {
    let valid: Vec<(&[f32], f32)> = values
        .par_chunks(count)
        .enumerate()
        .filter(|(node, _)| Grid::is_valid(*node))
        .map(|(_, row)| (row, row.iter().sum::<f32>() / count as f32))
        .collect();
    // Each thread sums some of the rows of the product, so that the order of a sum is fixed.
    const ROWS: usize = 8;
    let mut products = vec![0.0; count * count];
    products
        .par_chunks_mut(ROWS * count)
        .enumerate()
        .for_each(|(block, sums)| {
            let mut shifted = Vec::new();
            for nodes in valid.chunks(64) {
                shifted.clear();
                for (row, mean) in nodes {
                    shifted.extend(row.iter().map(|value| value - mean));
                }
                for (row, sums) in sums.chunks_mut(count).enumerate() {
                    let mut partial = vec![0.0_f32; count];
                    for node in shifted.chunks(count) {
                        let factor = node[block * ROWS + row];
                        for (sum, value) in partial.iter_mut().zip(node) {
                            *sum += factor * value;
                        }
                    }
                    for (sum, partial) in sums.iter_mut().zip(partial) {
                        *sum += f64::from(partial);
                    }
                }
            }
        });
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_set_is_tabulated_in_part_and_every_fold_has_its_share() {
        assert!(chosen(MOST_TABULATED).into_iter().eq(0..MOST_TABULATED));
        let some = chosen(3_000);
        assert_eq!((some.len(), &some), (MOST_TABULATED, &chosen(3_000)));
        assert!(some.is_sorted_by(|one, next| one < next) && some[MOST_TABULATED - 1] < 3_000);
        for fold in 0..5 {
            let share = some.iter().filter(|index| *index % 5 == fold).count();
            assert!((60..150).contains(&share), "{share} of fold {fold}");
        }
    }
}
