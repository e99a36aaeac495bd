//! Another recipe is offered, fetched in parts, and installed.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::AnyModel;
use glimpse_core::link::{BYTES_PER_FRAME, Failure, Refusal, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::{Memory, Scan};

use super::bench::{Bench, answer, is_failed, is_finished};
use super::scanning::{SAMPLES, WORDS, material, recipe_of, whole};

type Any = AnyModel<WORDS>;

/// The part of a recipe from there on.
pub(crate) fn part(recipe: &[u8], offset: u32) -> Reply {
    let bytes = recipe.iter().skip(offset as usize).take(BYTES_PER_FRAME);
    let bytes = bytes.copied().collect();
    Reply::RecipePart { offset, bytes }
}

/// What a flash holds after these actions.
pub(crate) fn stored(actions: &[Action]) -> Vec<u8> {
    let mut flash = Vec::new();
    for action in actions {
        if let Action::Store { offset, bytes } = action {
            flash.truncate(*offset as usize);
            assert_eq!(flash.len(), *offset as usize);
            flash.extend_from_slice(bytes);
        }
    }
    flash
}

fn config(host: Host, recipe_bytes: usize) -> Config {
    Config {
        recipe_bytes: recipe_bytes as u32,
        ..Config::new(host)
    }
}

/// A host that offers a recipe.
fn offers<'h>(recipe: &'h [u8], checksum: u32) -> Bench<'h> {
    Bench::new(move |request| match request {
        Request::Update => Some(Reply::Recipe {
            bytes: recipe.len() as u32,
            checksum,
        }),
        Request::RecipePart { offset } => Some(part(recipe, *offset)),
        _ => Some(answer(request)),
    })
}

/// A driver by this recipe, or by none.
fn with_driver(
    recipe: Option<&[u8]>,
    config: Config,
    check: impl FnOnce(&mut Driver<'_, '_, Any, SAMPLES>),
) {
    let mut memory = Memory::<Any, SAMPLES>::new();
    let scan = match recipe {
        Some(bytes) => Ok(Scan::new(Recipe::parse(bytes).unwrap(), &mut memory).unwrap()),
        None => Err(Failure::Recipe(RecipeError::Magic)),
    };
    check(&mut Driver::new(scan, config));
}

fn checksum_of(recipe: &[u8]) -> u32 {
    Recipe::parse(recipe).unwrap().checksum()
}

fn is_installed(action: &Action) -> bool {
    matches!(action, Action::Install { .. })
}

/// From the offer to a scan by the new recipe, in the same memory; a device without a recipe is
/// helped as well.
#[test]
fn an_offered_recipe_is_fetched_stored_and_installed() {
    let present = recipe_of(ModelKind::Phong);
    for host in [Host::Measures, Host::Listens] {
        for (before, model) in [
            (Some(&present[..]), ModelKind::Neural),
            (Some(&present[..]), ModelKind::Linear),
            (None, ModelKind::Phong),
        ] {
            let offered = recipe_of(model);
            let checksum = checksum_of(&offered);
            let mut flash = Vec::new();
            with_driver(before, config(host, 8_192), |driver| {
                let mut bench = offers(&offered, checksum);
                let (_, installed) = bench.run(driver, is_installed);
                let bytes = offered.len() as u32;
                assert_eq!(installed, Action::Install { bytes, checksum });
                let actions = bench.take_actions();
                flash = stored(&actions);
                // Each part once, one for each request, and no more of the scan than its hello.
                let parts = offered.len().div_ceil(BYTES_PER_FRAME);
                assert_eq!(actions.len(), parts + 1);
                assert_eq!(bench.heard.len(), 2 + parts);
                assert!(matches!(
                    bench.heard[..2],
                    [Request::Hello { .. }, Request::Update]
                ));
            });
            assert_eq!(flash, offered);
            with_driver(Some(&flash), config(host, 8_192), |driver| {
                let mut bench = offers(&offered, checksum);
                bench.run(driver, is_finished);
                let recipe = Recipe::parse(&offered).unwrap();
                assert_eq!(bench.told().0, whole::<Any>(recipe, material).bits());
                // The host still offers it: it is the present one.
                assert!(
                    !bench
                        .heard
                        .iter()
                        .any(|r| matches!(r, Request::RecipePart { .. }))
                );
            });
        }
    }
}

/// None is asked for, none is offered, it is the present one, or it finds no room.
#[test]
fn what_is_no_news_is_not_fetched() {
    let present = recipe_of(ModelKind::Phong);
    let other = recipe_of(ModelKind::Neural);
    let none: &[u8] = &[];
    for (room, offered, checksum) in [
        (0, &other[..], checksum_of(&other)),
        (other.len() - 1, &other[..], checksum_of(&other)),
        (8_192, &present[..], checksum_of(&present)),
        (8_192, none, 1),
    ] {
        with_driver(Some(&present), config(Host::Measures, room), |driver| {
            let mut bench = offers(offered, checksum);
            bench.run(driver, is_finished);
            let asked = |r: &&Request| matches!(r, Request::Update);
            let expected = usize::from(room > 0);
            assert_eq!(bench.heard.iter().filter(asked).count(), expected);
            assert!(
                !bench
                    .heard
                    .iter()
                    .any(|r| matches!(r, Request::RecipePart { .. }))
            );
        });
    }
    with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
        let mut bench = Bench::willing();
        bench.run(driver, is_finished);
        assert!(bench.heard.contains(&Request::Update));
    });
    // As much as there is room for.
    with_driver(
        Some(&present),
        config(Host::Measures, other.len()),
        |driver| {
            offers(&other, checksum_of(&other)).run(driver, is_installed);
        },
    );
    // Nobody is there who could offer one.
    with_driver(Some(&present), config(Host::Absent, 8_192), |driver| {
        let mut bench = offers(&other, checksum_of(&other));
        bench.run(driver, is_finished);
        assert!(bench.frames.is_empty());
    });
}

/// A part that is empty, shorter than a frame has room for, or longer than what is left ends the update by name; it is not begun again
/// and again, and the device goes on by the recipe that it has.
#[test]
fn a_wrong_part_is_refused() {
    let present = recipe_of(ModelKind::Phong);
    let offered = recipe_of(ModelKind::Neural);
    let whole_parts = offered.len() / BYTES_PER_FRAME * BYTES_PER_FRAME;
    for (at, length) in [
        (0, 0),
        (120, 0),
        (60, BYTES_PER_FRAME - 1),
        (whole_parts, BYTES_PER_FRAME),
    ] {
        with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
            let mut bench = Bench::new(|request| match request {
                Request::Update => Some(Reply::Recipe {
                    bytes: offered.len() as u32,
                    checksum: 77,
                }),
                Request::RecipePart { offset } if *offset as usize == at => {
                    let (offset, bytes) = (*offset, std::iter::repeat_n(5, length).collect());
                    Some(Reply::RecipePart { offset, bytes })
                }
                Request::RecipePart { offset } => Some(part(&offered, *offset)),
                _ => Some(answer(request)),
            });
            bench.run(driver, is_failed);
            let actions = bench.take_actions();
            let failure = Failure::Refused(Refusal::Recipe);
            assert_eq!(actions.last(), Some(&Action::Failed(failure)));
            assert_eq!(stored(&actions), offered[..at]);
            bench.run(driver, is_finished);
            let actions = bench.take_actions();
            assert!(!actions.iter().any(|a| matches!(a, Action::Store { .. })));
            assert!(bench.heard.contains(&Request::Failed(failure)));
        });
    }
}

/// What one driver could not use, or not store, the next one does not fetch.
#[test]
fn a_recipe_that_was_declined_is_not_fetched() {
    let present = recipe_of(ModelKind::Phong);
    let offered = recipe_of(ModelKind::Neural);
    with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
        let mut bench = offers(&offered, 77);
        bench.run(driver, |action| matches!(action, Action::Store { .. }));
        assert_eq!(driver.declined(), None);
        driver.fail(Failure::Machine);
        assert_eq!(driver.declined(), Some(77));
    });
    with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
        driver.decline(77);
        let mut bench = offers(&offered, 77);
        bench.run(driver, is_finished);
        let actions = bench.take_actions();
        assert!(!actions.iter().any(|a| matches!(a, Action::Store { .. })));
    });
}

/// A part from elsewhere is no reply to the request: as if none had come.
#[test]
fn a_part_from_another_place_is_dropped() {
    let present = recipe_of(ModelKind::Phong);
    let offered = recipe_of(ModelKind::Neural);
    with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
        let mut wrong = true;
        let mut bench = Bench::new(|request| match request {
            Request::Update => Some(Reply::Recipe {
                bytes: offered.len() as u32,
                checksum: 77,
            }),
            Request::RecipePart { offset: 180 } if std::mem::take(&mut wrong) => {
                Some(part(&offered, 240))
            }
            Request::RecipePart { offset } => Some(part(&offered, *offset)),
            _ => Some(answer(request)),
        });
        let (at, failed) = bench.run(driver, is_failed);
        assert_eq!((at, failed), (2_000, Action::Failed(Failure::NoReply)));
        assert_eq!(stored(&bench.take_actions()), offered[..180]);
        // All of it is fetched anew: the host may have been another in between.
        bench.run(driver, is_installed);
        assert_eq!(stored(&bench.take_actions()), offered);
    });
}

/// A whole recipe that the firmware cannot use is told of, and not fetched again: the device goes on
/// by the one that it has.
#[test]
fn a_recipe_that_does_not_serve_is_not_fetched_again() {
    let present = recipe_of(ModelKind::Phong);
    let mut offered = recipe_of(ModelKind::Neural);
    let checksum = checksum_of(&offered);
    offered[100] ^= 1;
    let error = Recipe::parse(&offered).err().unwrap();
    with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
        let mut bench = offers(&offered, checksum);
        bench.run(driver, is_installed);
        let failure = Failure::Recipe(error);
        driver.fail(failure);
        assert_eq!(bench.turn(driver), Action::Failed(failure));
        bench.take_actions();
        bench.heard.clear();
        bench.run(driver, is_finished);
        assert_eq!(bench.heard[0], Request::Failed(failure));
        assert!(matches!(
            bench.heard[1..3],
            [Request::Hello { .. }, Request::Update]
        ));
        let recipe = Recipe::parse(&present).unwrap();
        assert_eq!(bench.told().0, whole::<Any>(recipe, material).bits());
        let actions = bench.take_actions();
        assert!(!actions.iter().any(|a| matches!(a, Action::Store { .. })));
    });
}

/// A firmware that does not heed it goes on by the recipe that it has.
#[test]
fn an_install_that_is_not_heeded_changes_nothing() {
    let present = recipe_of(ModelKind::Phong);
    let offered = recipe_of(ModelKind::Neural);
    with_driver(Some(&present), config(Host::Measures, 8_192), |driver| {
        let mut bench = offers(&offered, checksum_of(&offered));
        bench.run(driver, is_installed);
        bench.run(driver, is_finished);
        let recipe = Recipe::parse(&present).unwrap();
        assert_eq!(bench.told().0, whole::<Any>(recipe, material).bits());
    });
}
