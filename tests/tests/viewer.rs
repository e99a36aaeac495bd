//! The module in pages of `trainer render view` computes the same numbers as core on the host. `GLIMPSE_BUILT_WASM` is
//! the path of another module to check instead; `tests/run targets` sets it to the module that it built.

use std::collections::BTreeSet;
use std::{env, fs};

use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::{Arms, Directions, HalfDifference};
use glimpse_core::gonio::Reading;
use glimpse_core::model::linear::Basis;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_fitting::linear::{CHANNEL_COEFFICIENTS, material_basis};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, Procedural};
use glimpse_tests::recipes;
use glimpse_viewer::WASM;
use wasmi::{Engine, Instance, Linker, Memory, Module, Store, WasmParams, WasmResults};

/// Largest allowed difference of results, relative to the largest result.
const TOLERANCE: f32 = 1e-5;

const RECIPE: u32 = 0;
const TABLE: u32 = 2;
const REFERENCE: u32 = 3;
const NUMBERS: u32 = 4;

/// An instance of the module.
struct Core {
    store: Store<()>,
    instance: Instance,
}

impl Core {
    fn new(wasm: &[u8]) -> Self {
        let engine = Engine::default();
        let module = Module::new(&engine, wasm).expect("a module");
        assert_eq!(module.imports().len(), 0, "the module has imports");
        let mut store = Store::new(&engine, ());
        let instance = Linker::new(&engine)
            .instantiate_and_start(&mut store, &module)
            .expect("the module starts");
        Self { store, instance }
    }

    fn call<P: WasmParams, R: WasmResults>(&mut self, name: &str, arguments: P) -> R {
        let function = self.instance.get_typed_func::<P, R>(&self.store, name);
        let function = function.expect("the module exports the function");
        function.call(&mut self.store, arguments).expect("no panic")
    }

    /// Calls a function that returns 0, or 1 on a failure.
    fn run(&mut self, name: &str) {
        let failure: u32 = self.call(name, ());
        assert_eq!(failure, 0, "{name}: {}", self.message());
    }

    fn memory(&self) -> Memory {
        let memory = self.instance.get_memory(&self.store, "memory");
        memory.expect("the module exports its memory")
    }

    fn put(&mut self, slot: u32, bytes: &[u8]) {
        let address: u32 = self.call("allocate", (slot, bytes.len() as u32));
        assert_ne!(address, 0, "out of memory");
        self.memory()
            .write(&mut self.store, address as usize, bytes)
            .expect("the slot is in memory");
    }

    fn put_numbers(&mut self, slot: u32, numbers: &[f32]) {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.put(slot, &bytes);
    }

    fn numbers(&mut self, count: usize) -> Vec<f32> {
        let address: u32 = self.call("allocate", (NUMBERS, 4 * count as u32));
        let bytes = &self.memory().data(&self.store)[address as usize..][..4 * count];
        let (numbers, _) = bytes.as_chunks();
        numbers.iter().map(|x| f32::from_le_bytes(*x)).collect()
    }

    fn message(&mut self) -> String {
        let [address, count] =
            ["message_address", "message_bytes"].map(|name| self.call::<(), u32>(name, ()));
        let bytes = &self.memory().data(&self.store)[address as usize..][..count as usize];
        String::from_utf8(bytes.to_vec()).expect("the message is UTF-8")
    }
}

/// Returns the built module if there is one, or else the committed one.
fn module() -> Vec<u8> {
    env::var_os("GLIMPSE_BUILT_WASM").map_or_else(
        || WASM.to_vec(),
        |built| fs::read(built).expect("the module was built"),
    )
}

/// Checks numbers with the tolerance. `name` names them in errors.
fn assert_close(actual: &[f32], expected: &[f32], name: &str) {
    assert_eq!(actual.len(), expected.len(), "{name}");
    let largest = expected
        .iter()
        .fold(0.0_f32, |largest, x| largest.max(x.abs()));
    for (actual, expected) in actual.iter().zip(expected) {
        let error = (actual - expected).abs();
        assert!(
            error <= TOLERANCE * largest,
            "{name}: {actual}, but {expected} on the host"
        );
    }
}

#[test]
fn fits_and_pictures_match_core_on_host() {
    let material = &Procedural::set(4, 77)[3];
    let wasm = module();
    for (name, bytes) in recipes() {
        let recipe = Recipe::parse(bytes).expect("a recipe");
        let mut readings: Vec<Option<[f32; 3]>> = recipe
            .pattern()
            .map(|angles| Some(material.at_angles(angles)))
            .collect();
        if recipe.tolerates_missing() {
            (readings[1], readings[4]) = (None, None);
        }

        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).expect("enough memory");
        for (index, reading) in (0..).zip(&readings) {
            if let Some(brdf) = reading {
                scan.record(index, Reading::new(*brdf))
                    .expect("a valid reading");
            }
        }
        let mut fit = scan.fit().expect("enough readings");
        fit.advance(u32::MAX);
        if let Err(error) = fit.finish() {
            assert!(error.is_implausible(), "{error}");
        }
        let fitted = scan.fitted().expect("the fit is finished");

        let mut core = Core::new(&wasm);
        core.put(RECIPE, bytes);
        core.run("load_recipe");
        assert_eq!(core.call::<(), u32>("samples", ()), readings.len() as u32);
        let numbers = readings.iter().flat_map(|reading| match reading {
            Some([red, green, blue]) => [*red, *green, *blue, 1.0],
            None => [0.0; 4],
        });
        core.put_numbers(NUMBERS, &numbers.collect::<Vec<_>>());
        core.run("fit");

        let expected: Vec<f32> = fitted.values().collect();
        core.numbers(1 << 13);
        let count: u32 = core.call("values", ());
        assert_close(&core.numbers(count as usize), &expected, name);
        let predicted: f32 = core.call("predicted_loss", ());
        let expected = fitted.predicted_loss().unwrap_or(f32::NAN);
        let bound: f32 = core.call("loss_bound", ());
        let expected_bound = fitted.loss_bound().unwrap_or(f32::NAN);
        assert_eq!(bound.to_bits(), expected_bound.to_bits());
        let unlike: u32 = core.call("is_unlike_training", ());
        assert_eq!(unlike == 1, fitted.is_unlike_training() == Some(true));
        assert_eq!(predicted.is_nan(), expected.is_nan(), "{name}");
        if !expected.is_nan() {
            assert_close(&[predicted], &[expected], name);
        }
        let residual: f32 = core.call("residual", ());
        assert_close(&[residual], &[fitted.residual().mean], name);

        let brdf = |directions: &Directions<f32>| fitted.brdf(directions).unwrap_or_default();
        let brdfs = recipe.directions().map(|(_, directions)| brdf(&directions));
        let expected = brdfs.collect::<Vec<_>>().concat();
        core.numbers(expected.len());
        assert_eq!(
            core.call::<(), u32>("brdf_at_samples", ()),
            readings.len() as u32
        );
        assert_close(&core.numbers(expected.len()), &expected, name);

        let lobe = |step: u8| {
            let theta_o = ((f32::from(step) + 0.5) / 45.0 - 1.0) * std::f32::consts::FRAC_PI_2;
            brdf(&Arms::from_array([-0.7, 0.0, theta_o, 0.0]).directions())
        };
        let expected = (0..90).map(lobe).collect::<Vec<_>>().concat();
        core.numbers(expected.len());
        assert_eq!(core.call::<_, u32>("lobe", (0.7_f32, 90_u32)), 90);
        let actual = core.numbers(expected.len());
        // Angles are rounded differently, which matters in a steep lobe.
        for (actual, expected) in actual.iter().zip(&expected) {
            assert!(
                (actual - expected).abs() <= 1e-3 * expected.abs().max(1e-3),
                "{name}: {actual}, but {expected} on the host"
            );
        }
    }
}

#[test]
fn table_is_evaluated_and_rendered() {
    let material = &Procedural::set(4, 77)[1];
    let table = material_basis(material);
    let basis = Basis::parse(&table).expect("a basis");
    let directions = uniform_valid(500, 3);
    let mut reference = Vec::new();
    let mut expected = 0.0;
    for angles in &directions {
        let brdf = material.at_angles(*angles);
        let at = HalfDifference::from_angles(*angles);
        let tabulated = basis
            .brdf(CHANNEL_COEFFICIENTS, &at)
            .expect("directions above the horizon");
        let error = cosine_weighted_log_error(brdf, tabulated, at.cos_theta_i(), 1.0);
        expected += f64::from(error.error.value()) / 1_500.0;
        reference.extend(angles.to_array());
        reference.extend(brdf);
    }
    let mut core = Core::new(&module());
    assert!(
        core.call::<(), f64>("loss", ()).is_nan(),
        "a loss without a table"
    );
    core.put(TABLE, &table);
    core.run("load_table");
    core.put_numbers(REFERENCE, &reference);
    let loss: f64 = core.call("loss", ());
    assert!((loss / expected - 1.0).abs() < 1e-3, "{loss} {expected}");
    // The sensor is below the horizon, where the table has no BRDF.
    reference.extend([1.0, 1.0, std::f32::consts::PI, 0.5, 0.5, 0.5]);
    core.put_numbers(REFERENCE, &reference);
    assert!(core.call::<(), f64>("loss", ()).is_nan());

    // The light and the camera are above the center of 33 x 33 pixels; then the light is behind the sphere.
    core.numbers(3 * 33 * 33);
    let shade = |core: &mut Core, z: f32| -> [f32; 3] {
        let light = (33_u32, 0_u32, 33_u32, 0.0_f32, 0.0_f32, z);
        assert_eq!(core.call::<_, u32>("shade", light), 33 * 33);
        let pixels = core.numbers(3 * 33 * 33);
        [0, 1, 2].map(|channel| pixels[3 * (16 * 33 + 16) + channel])
    };
    let at = HalfDifference::from_angles(Default::default());
    let expected = basis
        .brdf(CHANNEL_COEFFICIENTS, &at)
        .expect("directions above the horizon");
    let expected = expected.map(|f| std::f32::consts::PI * f);
    assert_close(&shade(&mut core, 1.0), &expected, "head on");
    assert_eq!(shade(&mut core, -1.0), [0.0; 3]);
}

#[test]
fn each_failure_has_its_own_message() {
    let mut core = Core::new(&module());
    assert_eq!(core.call::<(), u32>("fit", ()), 1);
    let no_scan = core.message();
    core.put(RECIPE, b"GLMP");
    assert_eq!(core.call::<(), u32>("load_recipe", ()), 1);
    let no_recipe = core.message();
    assert_eq!(core.call::<_, u32>("allocate", (5_u32, 8_u32)), 0);
    assert_eq!(core.call::<_, u32>("allocate", (NUMBERS, u32::MAX)), 0);

    core.put(RECIPE, glimpse_tests::RECIPE);
    core.run("load_recipe");
    let samples: u32 = core.call("samples", ());
    core.put_numbers(NUMBERS, &vec![0.0; 4 * samples as usize]);
    assert_eq!(core.call::<(), u32>("fit", ()), 1);
    let causes = BTreeSet::from([no_scan, no_recipe, core.message()]);
    assert!(causes.len() == 3 && !causes.contains(""), "{causes:?}");
}
