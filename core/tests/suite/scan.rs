//! A scan records readings in any order, rejects invalid ones, and ends with finite numbers or an error.

mod counts;
mod fits;
mod memory;
mod plausibility;
mod readings;

/// The trained recipes of the examples: Linear, Neural, Cook-Torrance, Phong.
const SCAN_RECIPES: [&[u8]; 4] = [
    include_bytes!("../../examples/recipes/linear-n8.recipe"),
    include_bytes!("../../examples/recipes/neural-n8.recipe"),
    include_bytes!("../../examples/recipes/cook-torrance-n8.recipe"),
    include_bytes!("../../examples/recipes/phong-n8.recipe"),
];
