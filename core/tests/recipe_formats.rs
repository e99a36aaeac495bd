//! Recipes of formats 1 and 2, as they were released: they are read to the same numbers for ever.

mod forged;

use forged::sealed;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Field, Floats, Kind, Recipe, RecipeError, VERSION};

const FIRST: &[u8] = include_bytes!("recipes/neural-format-1.recipe");
const SECOND: &[u8] = include_bytes!("recipes/phong-format-2.recipe");
const SECOND_LINEAR: &[u8] = include_bytes!("recipes/linear-format-2.recipe");

/// Reads a body by hand: what these tests know of the old formats they know from here.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn body(recipe: &'a [u8]) -> Self {
        Self(&recipe[14..])
    }

    fn varint(&mut self) -> u64 {
        let length = 1 + self.0.iter().position(|byte| *byte < 0x80).unwrap();
        let (digits, rest) = self.0.split_at(length);
        self.0 = rest;
        let digits = digits.iter().rev();
        digits.fold(0, |number, digit| number << 7 | u64::from(digit & 0x7F))
    }

    fn bytes(&mut self) -> &'a [u8] {
        let length = self.varint() as usize;
        let (bytes, rest) = self.0.split_at(length);
        self.0 = rest;
        bytes
    }

    fn floats(&mut self) -> Vec<f32> {
        let words = self.bytes().chunks_exact(4);
        words
            .map(|word| f32::from_le_bytes(word.try_into().unwrap()))
            .collect()
    }

    fn text(&mut self) -> &'a str {
        std::str::from_utf8(self.bytes()).unwrap()
    }

    /// The loss to expect and the provenance, which both formats end in.
    fn ends_as(mut self, recipe: &Recipe<'_>) {
        let (loss, rest) = self.0.split_first_chunk().unwrap();
        self.0 = rest;
        assert_eq!(recipe.expected_loss(), Some(f32::from_le_bytes(*loss)));
        let statements = recipe.statements().unwrap();
        let expectation = statements.expectation.unwrap();
        assert_eq!((expectation.materials, expectation.on), (0, ""));
        assert_eq!(expectation.standard_error, None);
        let provenance = statements.provenance.unwrap();
        assert_eq!(provenance.trainer, self.text());
        assert_eq!(provenance.data, self.text());
        assert_eq!(u64::from(provenance.materials), self.varint());
        assert_eq!(provenance.schedule, self.text());
        assert_eq!(provenance.seed, self.varint());
        assert_eq!(provenance.options, "");
        assert!(self.0.is_empty());
    }
}

fn pattern(recipe: &Recipe<'_>) -> Vec<f32> {
    let angles = recipe.pattern();
    angles
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .collect()
}

fn same(found: Floats<'_>, expected: Vec<f32>) {
    assert!(found.iter().eq(expected));
}

#[test]
fn format_1_is_read() {
    assert_eq!(FIRST[4..6], 1_u16.to_le_bytes());
    let recipe = Recipe::parse(FIRST).unwrap();
    let mut by_hand = Reader::body(FIRST);
    assert_eq!((recipe.model(), by_hand.varint()), (ModelKind::Neural, 1));
    let descent = recipe.descent().unwrap();
    assert_eq!(u64::from(descent.inner_steps()), by_hand.varint());
    assert_eq!(pattern(&recipe), by_hand.floats());
    same(descent.initial(), by_hand.floats());
    same(descent.step_sizes(), by_hand.floats());
    assert_eq!((recipe.samples(), descent.initial().len()), (8, 675));
    by_hand.ends_as(&recipe);
}

#[test]
fn format_2_is_read() {
    assert_eq!(SECOND[4..6], 2_u16.to_le_bytes());
    let recipe = Recipe::parse(SECOND).unwrap();
    let mut by_hand = Reader::body(SECOND);
    assert_eq!(pattern(&recipe), by_hand.floats());
    let descent = recipe.descent().unwrap();
    assert_eq!((recipe.model(), by_hand.varint()), (ModelKind::Phong, 0));
    assert_eq!((descent.model(), by_hand.varint()), (ModelKind::Phong, 0));
    assert_eq!(u64::from(descent.inner_steps()), by_hand.varint());
    same(descent.initial(), by_hand.floats());
    same(descent.step_sizes(), by_hand.floats());
    assert_eq!((recipe.samples(), descent.initial().len()), (8, 7));
    by_hand.ends_as(&recipe);
}

#[test]
fn format_2_of_the_model_linear_is_read() {
    assert_eq!(SECOND_LINEAR[4..6], 2_u16.to_le_bytes());
    let recipe = Recipe::parse(SECOND_LINEAR).unwrap();
    let mut by_hand = Reader::body(SECOND_LINEAR);
    assert_eq!(pattern(&recipe), by_hand.floats());
    assert_eq!((recipe.model(), by_hand.varint()), (ModelKind::Linear, 1));
    let ridge = recipe.ridge().unwrap();
    assert_eq!((ridge.components() as u64, by_hand.varint()), (5, 5));
    same(ridge.basis(), by_hand.floats());
    same(ridge.mean(), by_hand.floats());
    same(ridge.median(), by_hand.floats());
    same(ridge.weight(), by_hand.floats());
    same(ridge.precision(), by_hand.floats());
    let checksum = ridge.basis_checksum().unwrap_or_default();
    assert_eq!(u64::from(checksum), by_hand.varint());
    by_hand.ends_as(&recipe);
}

#[test]
fn old_formats_say_nothing_that_they_cannot_hold() {
    for bytes in [FIRST, SECOND, SECOND_LINEAR] {
        let recipe = Recipe::parse(bytes).unwrap();
        let statements = recipe.statements().unwrap();
        assert_eq!((statements.limits, statements.noise), (None, None));
        assert_eq!(statements.materials.count(), 0);
        assert_eq!(recipe.sections().count(), 0);
    }
}

#[test]
fn a_copy_has_the_newest_format_and_says_the_same() {
    for bytes in [FIRST, SECOND, SECOND_LINEAR] {
        let old = Recipe::parse(bytes).unwrap();
        let mut buffer = vec![0; bytes.len() + 32];
        let copy = old.copy_without(&[], &mut buffer).unwrap();
        assert_eq!(copy[4..6], VERSION.to_le_bytes());
        let new = Recipe::parse(copy).unwrap();
        assert_eq!((new.model(), pattern(&new)), (old.model(), pattern(&old)));
        let (new_said, old_said) = (new.statements().unwrap(), old.statements().unwrap());
        assert_eq!(new_said.expectation, old_said.expectation);
        assert_eq!(new_said.provenance, old_said.provenance);
        if let Some((new, old)) = new.descent().zip(old.descent()) {
            assert_eq!(new.inner_steps(), old.inner_steps());
            assert_eq!(new.initial(), old.initial());
            assert_eq!(new.step_sizes(), old.step_sizes());
        }
        if let Some((new, old)) = new.ridge().zip(old.ridge()) {
            assert_eq!(new.basis(), old.basis());
            assert_eq!((new.mean(), new.median()), (old.mean(), old.median()));
            assert_eq!(new.weight(), old.weight());
            assert_eq!(new.precision(), old.precision());
            assert_eq!(new.basis_checksum(), old.basis_checksum());
        }
        assert_eq!(new.descent().is_some(), old.descent().is_some());

        let kinds = [Kind::EXPECTATION, Kind::PROVENANCE];
        let mut buffer = vec![0; bytes.len() + 32];
        let bare = old.copy_without(&kinds, &mut buffer).unwrap();
        let bare = Recipe::parse(bare).unwrap();
        let said = bare.statements().unwrap();
        assert_eq!((said.expectation, said.provenance), (None, None));
    }
}

/// The bounds of a ridge problem are of numbers, not of formats.
#[test]
fn bounds_hold_for_old_formats_too() {
    let mut body = SECOND_LINEAR[14..].to_vec();
    let basis = Recipe::parse(SECOND_LINEAR).unwrap().ridge().unwrap();
    let first = basis.basis().words()[0];
    let at = body.windows(4).position(|word| word == first).unwrap();
    body[at..at + 4].copy_from_slice(&1e30_f32.to_le_bytes());
    let error = Recipe::parse(&sealed(2, &body)).unwrap_err();
    assert_eq!(error, RecipeError::Range(Field::Basis));
}

#[test]
fn an_old_body_with_something_behind_it_is_malformed() {
    for (version, bytes) in [(1, FIRST), (2, SECOND)] {
        let body = [&bytes[14..], &[0]].concat();
        let bytes = sealed(version, &body);
        let error = Recipe::parse(&bytes).unwrap().statements().unwrap_err();
        assert_eq!(error, RecipeError::Malformed);
    }
}

#[test]
fn a_format_of_the_future_is_refused_by_name() {
    let error = Recipe::parse(&sealed(VERSION + 1, &[])).unwrap_err();
    assert_eq!(error, RecipeError::Version(VERSION + 1));
    let error = Recipe::parse(&sealed(0, &[])).unwrap_err();
    assert_eq!(error, RecipeError::Version(0));
}
