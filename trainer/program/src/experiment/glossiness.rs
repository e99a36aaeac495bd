//! The order of materials by glossiness.

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;

use super::case::Subset;

/// Returns the glossiness of a material: the maximum divided by the median of the BRDF times the cosine, over uniform
/// valid directions.
fn glossiness(material: &dyn Material, seed: u64) -> f32 {
    const DIRECTION_COUNT: usize = 4_096;
    let angles = uniform_valid(DIRECTION_COUNT, seed);
    let mut values: Vec<f32> = angles
        .into_iter()
        .map(|angles| {
            let at = HalfDifference::from_angles(angles);
            material.at_angles(angles).iter().sum::<f32>() * at.cos_theta_i()
        })
        .collect();
    values.sort_by(f32::total_cmp);
    let [median, max] = [DIRECTION_COUNT / 2, DIRECTION_COUNT - 1].map(|index| values[index]);
    max / median.max(1e-6)
}

/// Returns the indices of materials, from the most diffuse to the most glossy.
pub(super) fn by_glossiness(materials: &[Box<dyn Material>], seed: u64) -> Vec<usize> {
    let glossiness: Vec<f32> = materials
        .iter()
        .map(|material| glossiness(&**material, seed))
        .collect();
    let mut order: Vec<usize> = (0..glossiness.len()).collect();
    order.sort_by(|a, b| glossiness[*a].total_cmp(&glossiness[*b]));
    order
}

/// Returns the names of all materials, of the more diffuse half, or of the glossier half.
pub(super) fn split_by_glossiness(
    materials: &[Box<dyn Material>],
    seed: u64,
    subset: Subset,
) -> Vec<String> {
    let order = by_glossiness(materials, seed);
    let (diffuse, glossy) = order.split_at(order.len() / 2);
    let indices = match subset {
        Subset::All => &order,
        Subset::Diffuse => diffuse,
        Subset::Glossy => glossy,
    };
    let names = indices.iter().map(|index| materials[*index].name());
    names.map(str::to_owned).collect()
}
