//! Another recipe is offered, fetched in parts, and installed.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::{BYTES_PER_FRAME, Failure, RecipeBytes, Refusal, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Recipe, RecipeError};

use super::bench::{
    AnyDriver, Bench, default_reply, is_failed, is_finished, is_store, new_driver, phong_driver,
};
use crate::recipes::parsed;
use crate::scanning::{Any, encoded_recipe, full_scan, recipe_for, synthetic_reading};

/// A reply with the part of a recipe from `offset` on.
fn recipe_part(recipe: &[u8], offset: u32) -> Reply {
    let bytes = recipe.iter().skip(offset as usize).take(BYTES_PER_FRAME);
    let bytes = RecipeBytes::take_from(bytes.copied());
    Reply::RecipePart { offset, bytes }
}

/// The content of the flash after these actions.
pub(crate) fn stored_bytes(actions: &[Action]) -> Vec<u8> {
    let mut flash = Vec::new();
    for action in actions {
        if let Action::Store { offset, bytes } = action {
            flash.truncate(*offset as usize);
            assert_eq!(flash.len(), *offset as usize);
            flash.extend_from_slice(bytes.as_slice());
        }
    }
    flash
}

/// The configuration of a device that can store a recipe of `recipe_bytes` bytes.
fn config(host: Host, recipe_bytes: usize) -> Config {
    let mut config = Config::new(host);
    config.recipe_bytes = recipe_bytes as u32;
    config
}

/// A device with a Phong recipe and a host that measures.
fn device() -> AnyDriver {
    phong_driver(config(Host::Measures, 8_192))
}

/// A host that offers a recipe. `wrong` replaces its reply to some requests for a part.
fn offering_host_with<'h>(
    recipe: &'h [u8],
    checksum: u32,
    mut wrong: impl FnMut(u32) -> Option<Reply> + 'h,
) -> Bench<'h> {
    Bench::new(move |request| match request {
        Request::Update => Some(Reply::Recipe {
            bytes: recipe.len() as u32,
            checksum,
        }),
        Request::RecipePart { offset } => {
            Some(wrong(*offset).unwrap_or_else(|| recipe_part(recipe, *offset)))
        }
        _ => Some(default_reply(request)),
    })
}

/// A host that offers a recipe.
pub(crate) fn offering_host(recipe: &[u8], checksum: u32) -> Bench<'_> {
    offering_host_with(recipe, checksum, |_| None)
}

pub(crate) fn is_installed(action: &Action) -> bool {
    matches!(action, Action::Install { .. })
}

fn is_part(request: &Request) -> bool {
    matches!(request, Request::RecipePart { .. })
}

/// Runs a scan with the Phong recipe to its end, and checks that nothing is stored.
fn run_phong_scan(bench: &mut Bench<'_>, driver: &mut AnyDriver) {
    bench.take_actions();
    bench.run(driver, is_finished);
    let expected = full_scan::<Any>(recipe_for(ModelKind::Phong), synthetic_reading);
    assert_eq!(bench.results().0, expected.bits());
    assert!(!bench.take_actions().iter().any(is_store));
}

/// Covers the offer, the transfer, and a scan with the new recipe, also for a device without a recipe.
#[test]
fn installs_offered_recipe() {
    for host in [Host::Measures, Host::Listens] {
        for (has_recipe, model) in [
            (true, ModelKind::Neural),
            (true, ModelKind::Linear),
            (false, ModelKind::Phong),
        ] {
            let offered = encoded_recipe(model);
            let recipe = parsed(offered.clone());
            let checksum = recipe.checksum();
            let mut driver = if has_recipe {
                phong_driver(config(host, 8_192))
            } else {
                let failure = Failure::Recipe(RecipeError::Magic);
                AnyDriver::without_scan(failure, config(host, 8_192))
            };
            let mut bench = offering_host(&offered, checksum);
            let (_, installed) = bench.run(&mut driver, is_installed);
            let bytes = offered.len() as u32;
            assert_eq!(installed, Action::Install { bytes, checksum });
            let actions = bench.take_actions();
            assert_eq!(stored_bytes(&actions), offered);
            // Each part is fetched once, and the only other request of the scan is its hello.
            let parts = offered.len().div_ceil(BYTES_PER_FRAME);
            assert_eq!(actions.len(), parts + 1);
            assert_eq!(bench.requests.len(), 2 + parts);
            let first = &bench.requests[..2];
            assert!(matches!(first, [Request::Hello { .. }, Request::Update]));

            // The host still offers the recipe to the device that has installed it.
            let mut driver = new_driver::<Any>(recipe, config(host, 8_192));
            let mut bench = offering_host(&offered, checksum);
            bench.run(&mut driver, is_finished);
            assert_eq!(
                bench.results().0,
                full_scan::<Any>(recipe, synthetic_reading).bits()
            );
            assert_eq!(bench.count(is_part), 0);
        }
    }
}

/// Nothing is fetched without a request, an offer, a new checksum, and enough storage.
#[test]
fn fetches_only_new_recipes_that_fit() {
    let present = encoded_recipe(ModelKind::Phong);
    let other = encoded_recipe(ModelKind::Neural);
    let checksum_of = |recipe: &[u8]| Recipe::parse(recipe).unwrap().checksum();
    for (room, offered, checksum) in [
        (0, &other[..], checksum_of(&other)),
        (other.len() - 1, &other[..], checksum_of(&other)),
        (8_192, &present[..], checksum_of(&present)),
        (8_192, &[], 1),
    ] {
        let mut driver = phong_driver(config(Host::Measures, room));
        let mut bench = offering_host(offered, checksum);
        bench.run(&mut driver, is_finished);
        let requested = bench.count(|request| *request == Request::Update);
        assert_eq!(requested, usize::from(room > 0));
        assert_eq!(bench.count(is_part), 0);
    }
    // A host that replies with `Accepted` offers nothing.
    let mut bench = Bench::cooperative();
    bench.run(&mut device(), is_finished);
    assert!(bench.requests.contains(&Request::Update));
    // The storage is exactly as large as the recipe.
    let mut bench = offering_host(&other, checksum_of(&other));
    bench.run(
        &mut phong_driver(config(Host::Measures, other.len())),
        is_installed,
    );
    // Without a host, nothing is offered.
    let mut bench = offering_host(&other, checksum_of(&other));
    bench.run(&mut phong_driver(config(Host::Absent, 8_192)), is_finished);
    assert!(bench.frames.is_empty());
}

/// A part that is empty, too short, or longer than the rest ends the update with a failure. The update is not repeated,
/// and the device continues with its own recipe.
#[test]
fn rejects_part_of_wrong_length() {
    let offered = encoded_recipe(ModelKind::Neural);
    let whole_parts = offered.len() / BYTES_PER_FRAME * BYTES_PER_FRAME;
    for (at, length) in [
        (0, 0),
        (120, 0),
        (60, BYTES_PER_FRAME - 1),
        (whole_parts, BYTES_PER_FRAME),
    ] {
        let mut driver = device();
        let mut bench = offering_host_with(&offered, 77, |offset| {
            (offset as usize == at).then(|| Reply::RecipePart {
                offset,
                bytes: RecipeBytes::take_from(std::iter::repeat_n(5, length)),
            })
        });
        let (_, failed) = bench.run(&mut driver, is_failed);
        let failure = Failure::Refused(Refusal::Recipe);
        assert_eq!(failed, Action::Failed(failure));
        assert_eq!(stored_bytes(&bench.take_actions()), offered[..at]);
        run_phong_scan(&mut bench, &mut driver);
        assert!(bench.requests.contains(&Request::Failed(failure.into())));
    }
}

/// A recipe that one driver could not use or store is not fetched by the next driver.
#[test]
fn declined_recipe_is_not_fetched() {
    let offered = encoded_recipe(ModelKind::Neural);
    let mut driver = device();
    offering_host(&offered, 77).run(&mut driver, is_store);
    assert_eq!(driver.declined(), None);
    driver.fail(Failure::Machine);
    assert_eq!(driver.declined(), Some(77));

    let mut driver = device();
    driver.decline(77);
    run_phong_scan(&mut offering_host(&offered, 77), &mut driver);
}

/// A part with another offset does not answer the request.
#[test]
fn drops_part_with_wrong_offset() {
    let offered = encoded_recipe(ModelKind::Neural);
    let mut driver = device();
    let mut is_wrong = true;
    let mut bench = offering_host_with(&offered, 77, |offset| {
        let is_wrong = offset == 180 && std::mem::take(&mut is_wrong);
        is_wrong.then(|| recipe_part(&offered, 240))
    });
    let failed = bench.run(&mut driver, is_failed);
    assert_eq!(failed, (2_000, Action::Failed(Failure::NoReply)));
    assert_eq!(stored_bytes(&bench.take_actions()), offered[..180]);
    // All parts are fetched again: another host may be there now.
    bench.run(&mut driver, is_installed);
    assert_eq!(stored_bytes(&bench.take_actions()), offered);
}

/// A complete recipe that the firmware cannot use is reported, and not fetched again. The device continues with its own
/// recipe.
#[test]
fn unusable_recipe_is_not_fetched_again() {
    let mut offered = encoded_recipe(ModelKind::Neural);
    let checksum = parsed(offered.clone()).checksum();
    offered[100] ^= 1;
    let failure = Failure::Recipe(Recipe::parse(&offered).err().unwrap());
    let mut driver = device();
    let mut bench = offering_host(&offered, checksum);
    bench.run(&mut driver, is_installed);
    driver.fail(failure);
    assert_eq!(bench.step(&mut driver), Action::Failed(failure));
    bench.requests.clear();
    run_phong_scan(&mut bench, &mut driver);
    assert_eq!(bench.requests[0], Request::Failed(failure.into()));
    let next = &bench.requests[1..3];
    assert!(matches!(next, [Request::Hello { .. }, Request::Update]));
}

/// A firmware that ignores the action continues with its own recipe.
#[test]
fn ignored_install_changes_nothing() {
    let offered = encoded_recipe(ModelKind::Neural);
    let mut driver = device();
    let mut bench = offering_host(&offered, parsed(offered.clone()).checksum());
    bench.run(&mut driver, is_installed);
    run_phong_scan(&mut bench, &mut driver);
}
