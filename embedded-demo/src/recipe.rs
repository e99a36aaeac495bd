//! What is scanned by: `RECIPE`, its `Model` and `CAPACITY`. `build.rs` names the recipe's file,
//! and writes these from it.

include!(concat!(env!("OUT_DIR"), "/recipe.rs"));
