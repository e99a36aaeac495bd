"""Recipes, plans and fits: the same numbers and errors as the trainer's commands."""

import copy
import csv
import io
import json
import pickle

import glimpse_brdf as glimpse
import numpy as np
import pytest
from conftest import BUNDLED, RECIPES, assert_names, directions, to_degrees, write_csv
from glimpse_brdf import Machine

NEURAL = RECIPES / "neural-n8.recipe"
HEADER = "theta_i,phi_i,theta_o,phi_o,r,g,b"


def test_recipe_matches_inspect_command(trainer, recipe_path):
    recipe = glimpse.Recipe.load(recipe_path)
    expected = json.loads(trainer("inspect", recipe_path, "--json"))
    assert recipe.model == expected["model"] and recipe.samples == len(recipe) == expected["samples"]
    np.testing.assert_allclose(recipe.half_difference_radians, np.reshape(expected["pattern"]["directions"], (-1, 3)), atol=1e-6)
    assert recipe.directions.shape == (recipe.samples, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(recipe.directions, axis=-1), 1)
    converted = glimpse.directions_from_degrees(*recipe.angles_degrees.T)
    np.testing.assert_allclose(converted, recipe.directions, atol=1e-9)
    assert recipe.metadata == expected["metadata"]
    assert recipe.expected_loss == pytest.approx(recipe.metadata["expected_loss"]["estimate"]["loss"])
    assert recipe.checksum in repr(recipe)


def test_copies_of_recipe_are_equal(recipe_path, tmp_path):
    recipe = glimpse.Recipe.load(recipe_path)
    copies = [
        pickle.loads(pickle.dumps(recipe)),
        copy.deepcopy(recipe),
        glimpse.Recipe(recipe.to_bytes(), recipe.basis_bytes()),
    ]
    recipe.save(tmp_path / "copy.recipe")
    copies.append(glimpse.Recipe.load(tmp_path / "copy.recipe"))
    readings = glimpse.load_material("procedural:1:77")(recipe.directions)
    fitted = recipe.fit(readings).parameters
    for other in copies:
        assert other == recipe and hash(other) == hash(recipe)
        np.testing.assert_array_equal(other.fit(readings).parameters, fitted)
    recipe.save(tmp_path / "copy.recipe")
    other_path = next(path for path in RECIPES.glob("*.recipe") if path.read_bytes() != recipe.to_bytes())
    (tmp_path / "other.recipe").write_bytes(other_path.read_bytes())
    with pytest.raises(FileExistsError):
        recipe.save(tmp_path / "other.recipe")
    recipe.save(tmp_path / "other.recipe", overwrite=True)


def test_compact_basis_replaces_complete_basis(tmp_path):
    basis = (BUNDLED / "linear.basis24").read_bytes()
    recipe = glimpse.Recipe((BUNDLED / "completed/linear-n8.recipe").read_bytes(), basis)
    recipe.save(tmp_path / "compact.recipe")
    assert (tmp_path / "compact.basis").read_bytes() == basis
    fitted = recipe.fit(glimpse.load_material("procedural:1:77")(recipe.directions))
    loaded = glimpse.Recipe.load(tmp_path / "compact.recipe")
    readings = glimpse.load_material("procedural:1:77")(loaded.directions)
    np.testing.assert_array_equal(loaded.fit(readings).parameters, fitted.parameters)
    fitted.save(tmp_path / "fitted.json")
    directions = glimpse.directions_from_degrees([30.0], [0.0], [40.0], [180.0])
    np.testing.assert_array_equal(glimpse.load_material(tmp_path / "fitted.json")(directions), fitted(directions))


def test_pickles_are_small_and_copies_equal(trained):
    # Of a bundled recipe, the name and the checksum.
    for row in glimpse.bundled_recipes():
        recipe = glimpse.Recipe.load(row["name"])
        assert (recipe.model, recipe.samples, recipe.checksum) == (row["model"], row["samples"], row["checksum"])
        pickled = pickle.dumps(recipe)
        assert len(pickled) < 200 and pickle.loads(pickled) == recipe
    with pytest.raises(glimpse.GlimpseError):
        pickle.loads(pickled.replace(row["checksum"].encode(), b"01234567"))
    # Others have a compressed basis, of the same bytes.
    recipe = trained["linear"]
    pickled = pickle.dumps(recipe)
    assert len(pickled) < 0.35 * len(recipe.basis_bytes())
    assert pickle.loads(pickled).basis_bytes() == recipe.basis_bytes()
    assert copy.copy(recipe) is recipe and copy.deepcopy([recipe])[0] is recipe

    machine = Machine(speed_degrees_per_second=[20, 10, 5, 3], settle_seconds=0.3, max_theta_i_degrees=89.1)
    plan, proposals = recipe.plan(machine=machine), recipe.next(count=2, machine=machine)
    for duplicate in [lambda value: pickle.loads(pickle.dumps(value)), copy.copy, copy.deepcopy]:
        assert recipe.plan(machine=duplicate(machine)).to_csv() == plan.to_csv()
        assert duplicate(plan).to_csv() == plan.to_csv() and len(duplicate(plan)) == len(plan)
        np.testing.assert_array_equal(duplicate(plan).directions, plan.directions)
        np.testing.assert_array_equal(duplicate(proposals).seconds, proposals.seconds)
        assert duplicate(proposals).loss_scale == proposals.loss_scale


@pytest.mark.parametrize("value", [1.0, True, np.float64(1), np.bool_(True), "x", -1, 10**30])
def test_rejects_what_is_not_an_integer(trained, value):
    recipe, material = trained["neural"], glimpse.load_material("procedural:1:9")
    for name, use in [
        ("samples", lambda: glimpse.train("phong", samples=value)),
        ("seed", lambda: glimpse.train("phong", seed=value)),
        ("threads", lambda: glimpse.train("phong", threads=value)),
        ("bases", lambda: glimpse.train("linear", schedule="paper", bases=value)),
        ("count", lambda: recipe.next(count=value)),
        ("seed", lambda: recipe.plan(seed=value)),
        ("first", lambda: glimpse.evaluate(recipe, material, first=value)),
        ("seeds", lambda: glimpse.evaluate(recipe, material, seeds=value)),
        ("threads", lambda: glimpse.evaluate(recipe, material, threads=value)),
        ("size", lambda: material.render(value)),
        ("seed", lambda: material.save("m.bsdf", seed=value)),
    ]:
        with pytest.raises(glimpse.GlimpseError, match=name):
            use()
    assert len(recipe.next(count=np.int64(2))) == 2
    with pytest.raises(glimpse.GlimpseError):
        glimpse.train("phong", threads=0)


def test_error_for_unknown_recipe_lists_bundled_ones(trainer):
    with pytest.raises(FileNotFoundError) as error:
        glimpse.Recipe.load("nonesuch-n9")
    assert_names(error.value, "nonesuch-n9", *[row["name"] for row in glimpse.bundled_recipes()])
    assert glimpse.bundled_recipes() == json.loads(trainer("recipes", "list", "--json"))


def test_rejects_invalid_recipes(trainer, tmp_path, trained):
    damaged = tmp_path / "damaged.recipe"
    damaged.write_bytes(NEURAL.read_bytes()[:-1])
    with pytest.raises(glimpse.GlimpseError) as error:
        glimpse.Recipe.load(damaged)
    assert str(error.value) == trainer("inspect", damaged, fails=True)
    with pytest.raises(FileNotFoundError, match="none.recipe"):
        glimpse.Recipe.load(tmp_path / "none.recipe")
    with pytest.raises(glimpse.GlimpseError):
        glimpse.Recipe(b"")
    linear, basis = trained["linear"].to_bytes(), trained["linear"].basis_bytes()
    with pytest.raises(glimpse.GlimpseError, match="basis"):
        glimpse.Recipe(linear)
    with pytest.raises(glimpse.GlimpseError, match="basis"):
        glimpse.Recipe(linear, basis[:-1])
    with pytest.raises(glimpse.GlimpseError, match="basis"):
        glimpse.Recipe(NEURAL.read_bytes(), basis)


@pytest.mark.parametrize(
    "options, arguments",
    [
        ({}, []),
        ({"order": "progressive"}, ["--order", "progressive"]),
        (
            {
                "machine": Machine(speed_degrees_per_second=[20, 10, 20, 10], settle_seconds=1.5),
                "full_turns": False,
            },
            ["--speed", "20,10,20,10", "--settle", "1.5", "--no-full-turns"],
        ),
        ({"machine": Machine(max_theta_o_degrees=89)}, ["--max-theta-o", "89"]),
        ({"machine": Machine(speed_degrees_per_second=5)}, ["--speed", "5"]),
    ],
)
def test_plan_matches_command(trainer, tmp_path, options, arguments):
    plan = glimpse.Recipe.load(NEURAL).plan(**options)
    expected = json.loads(trainer("plan", NEURAL, *arguments, "--out", "plan.csv", "--blank", "blank.csv", "--json"))
    assert plan.to_csv() == (tmp_path / "plan.csv").read_text()
    assert plan.to_blank_csv() == (tmp_path / "blank.csv").read_text()
    assert plan.total_seconds == pytest.approx(expected["seconds"], rel=1e-12)
    assert plan.moving_seconds == pytest.approx(expected["moving_seconds"], rel=1e-12)
    assert plan.order == expected["order"] and len(plan) == 8
    rows = expected["visits"]
    assert plan.indices.tolist() == [row["index"] for row in rows]
    np.testing.assert_allclose(plan.seconds, [row["seconds"] for row in rows])
    axes = ["theta_i", "phi_i", "theta_o", "phi_o"]
    np.testing.assert_allclose(plan.angles_degrees, [[row[axis] for axis in axes] for row in rows], atol=1e-4)
    np.testing.assert_allclose(plan.directions, glimpse.directions_from_degrees(*plan.angles_degrees.T), atol=1e-12)


def test_plan_in_one_plane_has_two_axes():
    recipe = glimpse.Recipe.load("linear-any").at(glimpse.directions_from_degrees([30, 10], [0, 0], [20, 40], [0, 180]))
    plan = recipe.plan(machine=Machine(speed_degrees_per_second=[20, 10], settle_seconds=0, in_plane=True))
    angles = {tuple(row) for row in plan.angles_degrees.round(3).tolist()}
    assert angles == {(30, 0, -20, 180), (10, 0, 40, 180)} and plan.total_seconds == pytest.approx(8)
    assert plan.to_csv().startswith("index,theta_i,theta_o,seconds\n")
    with pytest.raises(glimpse.GlimpseError) as error:
        recipe.plan(machine=Machine(in_plane=True), full_turns=False)
    assert_names(error.value, "full_turns", "in_plane")


def test_rejects_invalid_plans(trainer):
    recipe = glimpse.Recipe.load(NEURAL)
    with pytest.raises(glimpse.GlimpseError) as error:
        recipe.plan(machine=Machine(max_theta_o_degrees=20))
    lines = str(error.value).split("\n")
    expected = trainer("plan", NEURAL, "--max-theta-o", "20", fails=True).split("\n")
    assert lines[:-1] == expected[:-1] and "max_theta_o" in lines[-1] and "--" not in lines[-1]
    for options, expected_names in [
        ({"speed_degrees_per_second": -1}, ["theta_i", "-1"]),
        ({"speed_degrees_per_second": [1, 2]}, ["speed_degrees_per_second", "in_plane"]),
        ({"speed_degrees_per_second": [1, 2, 3]}, ["speed_degrees_per_second"]),
        ({"settle_seconds": -1}, ["settle_seconds", "-1"]),
        ({"max_theta_i_degrees": 91}, ["max_theta_i_degrees"]),
        ({"max_theta_i_degrees": float("nan")}, ["max_theta_i_degrees"]),
    ]:
        with pytest.raises(glimpse.GlimpseError) as error:
            recipe.plan(machine=Machine(**options))
        assert_names(error.value, *expected_names)
    with pytest.raises(glimpse.GlimpseError) as error:
        recipe.plan("best")
    assert_names(error.value, "travel", "progressive")


def fit_by_command(trainer, tmp_path, recipe_path, rows):
    """Fits with the trainer. Returns its report, the fitted values, random directions, and the BRDF there."""
    write_csv(tmp_path / "m.csv", HEADER, np.asarray(rows, float).tolist())
    report = json.loads(trainer("fit", recipe_path, "--measurements", "m.csv", "--out", "out", "--json"))[0]
    pairs = directions(50, 9)
    write_csv(tmp_path / "angles.csv", "theta_i,phi_i,theta_o,phi_o", to_degrees(pairs).tolist())
    table = csv.DictReader(io.StringIO(trainer("query", "out/material.json", "--angles", "angles.csv")))
    brdf = np.array([[float(row[c]) for c in "rgb"] for row in table])
    values = json.loads((tmp_path / "out/material.json").read_text())["values"]
    return report, values, pairs, brdf


def test_fit_matches_command(trainer, tmp_path, recipe_path):
    recipe = glimpse.Recipe.load(recipe_path)
    readings = glimpse.load_material("procedural:1:77")(recipe.directions).astype(float)
    if recipe.tolerates_missing:
        readings[1] = np.nan
    rows = np.concatenate([recipe.angles_degrees, readings], 1)
    report, values, pairs, brdf = fit_by_command(trainer, tmp_path, recipe_path, rows)
    fitted = recipe.fit(readings, name="m")
    assert isinstance(fitted, glimpse.Material) and fitted.name == "m" and fitted.model == recipe.model
    np.testing.assert_allclose(fitted.parameters, values, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(fitted(pairs), brdf, rtol=1e-4, atol=1e-6)
    own = fitted.report
    assert own.keys() == report.keys() - {"name", "folder", "formats"}
    assert own["readings"]["used"] == report["readings"]["used"]
    assert own["readings"]["unused"] == report["readings"]["unused"]
    assert own["residual"]["mean"] == pytest.approx(report["residual"]["mean"], rel=1e-6)
    if recipe.tolerates_missing and recipe.model != "phong":
        assert own["expected_loss"] == pytest.approx(report["expected_loss"], rel=1e-6)

    # Readings with directions may be in any order and repeated.
    order = np.random.default_rng(4).permutation(np.repeat(np.arange(len(recipe)), 2))
    shuffled = recipe.fit(readings[order], recipe.directions[order])
    np.testing.assert_allclose(shuffled.parameters, fitted.parameters, rtol=1e-5, atol=1e-6)

    fitted.save(tmp_path / "saved.json")
    loaded = glimpse.load_material(tmp_path / "saved.json")
    np.testing.assert_allclose(loaded(pairs), fitted(pairs), rtol=1e-6)
    assert loaded.name == "m"
    fitted.save(tmp_path / "fitted.bsdf")
    assert glimpse.load_material(tmp_path / "fitted.bsdf")(pairs).shape == (50, 3)


@pytest.mark.parametrize("quantity", ["brdf", "brdf-cos-i", "brdf-cos-o", "reflectance-factor"])
def test_fits_other_quantities(quantity):
    recipe = glimpse.Recipe.load(NEURAL)
    brdf = glimpse.load_material("procedural:1:77")(recipe.directions)
    cos_i, cos_o = recipe.directions[:, 0, 2:], recipe.directions[:, 1, 2:]
    factor = {"brdf": 1, "brdf-cos-i": cos_i, "brdf-cos-o": cos_o, "reflectance-factor": np.pi}[quantity]
    fitted = recipe.fit(brdf * factor, quantity=quantity)
    np.testing.assert_allclose(fitted.parameters, recipe.fit(brdf).parameters, rtol=1e-4, atol=1e-5)


def test_fits_counts_with_white_reference():
    recipe = glimpse.Recipe.load(NEURAL)
    brdf = glimpse.load_material("procedural:1:77")(recipe.directions).astype(float)
    expected = recipe.fit(brdf).parameters
    gain = np.random.default_rng(5).uniform(1000, 2000, (8, 3))
    white = 0.9 / np.pi * gain + 96
    fitted = recipe.fit(brdf * gain + 96, white=white, dark=96, white_reflectance=0.9)
    np.testing.assert_allclose(fitted.parameters, expected, rtol=1e-3, atol=1e-3)
    # The white reference is read once. The light's spot is larger, so counts are proportional to cos(theta_i).
    white_directions = glimpse.directions_from_degrees(10, 0, 20, 180)
    white_count = 0.99 / np.pi * 5000 * white_directions[0, 2]
    counts = brdf * 5000 * recipe.directions[:, 0, 2:]
    fitted = recipe.fit(counts, white=[white_count] * 3, white_directions=white_directions, footprint="light")
    np.testing.assert_allclose(fitted.parameters, expected, rtol=1e-3, atol=1e-3)
    for options, expected_names in [
        ({"dark": 3}, ["dark", "white"]),
        ({"white": white, "quantity": "brdf"}, ["quantity", "white"]),
        ({"white": white[1:]}, ["white", "(8, 3)"]),
        ({"white": white, "footprint": "light"}, ["footprint"]),
        ({"white": white, "dark": [1, 2]}, ["dark"]),
    ]:
        with pytest.raises(glimpse.GlimpseError) as error:
            recipe.fit(counts, **options)
        assert_names(error.value, *expected_names)


def test_outlier_is_reported_and_excluded(trained):
    recipe = trained["linear"]
    # A training material: the other readings predict the outlier's sample well.
    material = glimpse.load_material("procedural:1:3")
    readings = material(recipe.directions).astype(float)
    fitted_without_outlier = recipe.fit(readings)
    readings[2] *= 1000
    fitted = recipe.fit(readings)
    outlier = fitted.report["readings"]["outliers"][0]
    assert outlier["sample"] == 2 and outlier["status"] == "outlier" and outlier["z"] > 3
    assert {"sample": 2, "status": "outlier"} in fitted.report["readings"]["unused"]
    np.testing.assert_allclose(outlier["reading"], readings[2], rtol=1e-6)
    assert max(outlier["expected"]) < min(outlier["reading"])
    assert recipe.fit(readings, keep_all=True).report["readings"]["unused"] == []
    saturated = np.arange(len(recipe)) == 4
    unused = recipe.fit(readings, saturated=saturated).report["readings"]["unused"]
    assert {"sample": 4, "status": "saturated"} in unused
    assert fitted_without_outlier.report["expected_loss"]["loss"] > 0


def test_implausible_readings_raise_with_fit():
    recipe = glimpse.Recipe.load(NEURAL)
    readings = glimpse.load_material("procedural:1:77")(recipe.directions)
    with pytest.raises(glimpse.ImplausibleError, match="percent") as error:
        recipe.fit(np.full_like(readings, 9.0) * (1 + 0.01 * np.arange(8)[:, None]))
    assert error.value.fit.model == "neural"
    assert np.isfinite(error.value.fit(recipe.directions)).all()


def test_rejects_invalid_readings(trainer, tmp_path):
    recipe = glimpse.Recipe.load(NEURAL)
    readings = glimpse.load_material("procedural:1:77")(recipe.directions).astype(float)

    def fit_error(*args, **options):
        with pytest.raises(glimpse.GlimpseError) as error:
            recipe.fit(*args, **options)
        return str(error.value)

    incomplete = readings.copy()
    incomplete[3] = np.nan
    rows = np.concatenate([recipe.angles_degrees, incomplete], 1)
    write_csv(tmp_path / "m.csv", HEADER, rows.tolist())
    command_error = trainer("fit", NEURAL, "--measurements", "m.csv", "--out", "out", fails=True)
    error = fit_error(incomplete)
    assert "sample 3" in error and "missing" in error and "--" not in error
    assert "sample 3" in command_error and "--missing" in command_error
    incomplete[3, 0] = 1
    assert_names(fit_error(incomplete), "3", "NaN")
    assert_names(fit_error(readings[:7]), "(8, 3)")
    assert_names(fit_error(readings.ravel()), "(8, 3)")
    with pytest.raises(FileNotFoundError):
        recipe.fit("readings")
    fit_error(readings * np.nan)
    infinite = readings.copy()
    infinite[0, 0] = np.inf
    assert_names(fit_error(infinite), "0")

    angles = recipe.angles_degrees.copy()
    angles[4, 0] += 2
    pairs = glimpse.directions_from_degrees(*angles.T)
    assert recipe.fit(readings, pairs).report["recipe"]["off_pattern"]
    assert_names(fit_error(readings, pairs, noise=np.full(8, -1.0)), "noise")
    fit_error(readings, pairs[:5])
    assert_names(fit_error(readings, name="a/b"), "name")
    assert_names(fit_error(readings, saturated=[True]), "8")
    assert_names(fit_error(readings, quantity="radiance"), "brdf", "brdf-cos-i")


@pytest.mark.parametrize("model", ["linear", "neural", "phong", "cook-torrance"])
def test_completes_readings_at_any_directions(model):
    basis = (BUNDLED / "any/linear-any.basis").read_bytes()
    recipe = glimpse.Recipe((BUNDLED / f"any/{model}-any.recipe").read_bytes(), basis)
    assert len(recipe) == 0
    theta_o = np.arange(-60, 80, 10)
    pairs = glimpse.directions_from_degrees(45, 0, np.abs(theta_o), np.where(theta_o < 0, 0, 180))
    material = glimpse.load_material("procedural:1:9")
    fitted = recipe.fit(material(pairs), pairs)
    report = fitted.report
    assert report["readings"]["used"] == len(theta_o) and not report["recipe"]["off_pattern"]
    assert 0 < report["expected_loss"]["loss"] < report["expected_loss"]["bound"]
    np.testing.assert_allclose(fitted.directions[..., 2], pairs[..., 2], atol=1e-5)
    elsewhere = glimpse.directions()[:500]
    deviation = fitted.deviation(elsewhere)
    assert deviation.shape == (500, 3) and (deviation > 0).all()
    assert glimpse.loss(material, fitted) < report["expected_loss"]["bound"]
    again = pickle.loads(pickle.dumps(fitted))
    np.testing.assert_array_equal(again.parameters, fitted.parameters)
    assert report["noise"]["source"] == "default" and report["gaps"]["gloss"] is None
    assert report["loss_scale"]["black"] > report["expected_loss"]["loss"]
    exact = recipe.fit(material(pairs), pairs, noise=0)
    assert exact.report["noise"]["source"] == "stated"
    each = recipe.fit(material(pairs), pairs, noise=np.zeros(len(pairs)))
    np.testing.assert_array_equal(each.parameters, exact.parameters)
    assert_names(str(pytest.raises(glimpse.GlimpseError, recipe.fit, material(pairs), pairs, noise=2).value), "noise")
    # A recipe of the same directions gives the same fit, in their order.
    np.testing.assert_allclose(recipe.at(pairs).fit(material(pairs)).parameters, fitted.parameters, atol=1e-5)
    with pytest.raises(glimpse.GlimpseError):
        recipe.fit(material(pairs))


def test_next_leads_a_scan(trainer, tmp_path):
    basis = (BUNDLED / "any/linear-any.basis").read_bytes()
    recipe = glimpse.Recipe((BUNDLED / "any/linear-any.recipe").read_bytes(), basis)
    material = glimpse.load_material("procedural:1:9")
    first = recipe.next(count=2)
    assert first.loss_scale["black"] > first.loss_scale["just_visible"]
    assert len(first) == 2 and first.seconds is None and first.directions.shape == (2, 2, 3)
    pairs, losses = first.directions, [first.expected_loss_so_far]
    machine = Machine(settle_seconds=1, max_theta_i_degrees=70)
    for _ in range(4):
        proposal = recipe.next(pairs, material(pairs), machine=machine)
        assert proposal.seconds[0] > 1 and proposal.directions[0, 0, 2] > np.cos(np.radians(70.1))
        assert proposal.expected_losses[0] < proposal.loss_bounds[0]
        losses.append(proposal.expected_loss_so_far)
        pairs = np.concatenate([pairs, proposal.directions])
    assert losses[-1] < 0.6 * losses[0]
    assert recipe.fit(material(pairs), pairs).report["expected_loss"]["loss"] < losses[0]
    # The command proposes the same.
    write_csv(tmp_path / "scan.csv", HEADER, np.hstack([to_degrees(pairs), material(pairs)]).tolist())
    command = json.loads(trainer("next", "--measurements", "scan.csv", "--in-plane", "--json"))
    same = recipe.next(pairs, material(pairs), machine=Machine(in_plane=True))
    [direction] = command["directions"]
    assert direction["phi_i"] is None and direction["phi_o"] is None
    # The azimuth of the light is 0 there, and the sensor's that of the mirror side.
    expected = glimpse.directions_from_degrees(direction["theta_i"], 0, direction["theta_o"], 180)
    np.testing.assert_allclose(same.directions[0, :, 2], expected[:, 2], atol=1e-4)
    with pytest.raises(glimpse.GlimpseError):
        recipe.next(pairs)
    too_bright = np.full((len(pairs), 3), 8.0)
    with pytest.raises(glimpse.ImplausibleError):
        recipe.next(pairs, too_bright)
    assert len(recipe.next(pairs, too_bright, accept_implausible=True)) == 1
    with pytest.raises(glimpse.GlimpseError):
        recipe.next(machine=Machine(max_theta_i_degrees=1, max_theta_o_degrees=1, min_separation_degrees=1.99))


def test_fits_readings_of_instruments(tmp_path):
    """Arrays and a table of the same displays give the same BRDFs, and arrays need no directions of a gloss meter."""
    recipe = glimpse.Recipe.load("linear-any")
    instrument = ["gloss-60", "sci", None, "multi-angle"]
    angles = np.radians([[np.nan, np.nan], [np.nan, np.nan], [45, 20], [45, 0]])
    vector = lambda theta: np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    pairs = np.stack([vector(-angles[:, 0]), vector(angles[:, 1])], 1)
    displays = np.array([[1, 1, 1], [32, 13, 6], [31, 13, 6], [30, 12, 5]])
    fitted = recipe.fit(displays, pairs, instrument=instrument)
    np.testing.assert_allclose(fitted.readings[1:], displays[1:] / 100 / np.pi, rtol=1e-5)
    copied = pickle.loads(pickle.dumps(fitted))
    np.testing.assert_array_equal(copied.parameters, fitted.parameters)

    table = "instrument,theta_i,theta_o,r,g,b,value\ngloss-60,,,,,,1\nsci,,,32,13,6,\n,45,20,31,13,6,\nmulti-angle,45,0,30,12,5,\n"
    (tmp_path / "table.csv").write_text(table)
    np.testing.assert_allclose(recipe.fit(tmp_path / "table.csv").readings, fitted.readings, rtol=1e-6)
    assert len(recipe.fit(displays[:2], instrument=instrument[:2]).readings) == 2
    gloss = [[1, 2, 3]]
    for arguments in [{"instrument": ["gloss"]}, {"instrument": ["gloss-60"]}, {"instrument": [None]}]:
        with pytest.raises(glimpse.GlimpseError):
            recipe.fit(gloss, **arguments)


def test_fits_readings_in_bands(tmp_path):
    """Bands that are mixtures of red, green and blue are fitted to within 3 %."""
    recipe = glimpse.Recipe.load("linear-any")
    material = glimpse.load_material("procedural:1:9")
    angles = np.radians([[45, 60], [45, 30], [45, 20], [45, 0], [45, -30], [45, -65]])
    vector = lambda theta: np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    pairs = np.stack([vector(-angles[:, 0]), vector(angles[:, 1])], 1)
    wavelengths = np.arange(400, 701, 50)
    mix = np.exp(-((wavelengths - np.array([620, 540, 450])[:, None]) / 60) ** 2)
    readings = material(pairs) @ (mix / mix.sum(0))
    fitted = recipe.fit(readings, pairs, wavelengths=wavelengths)
    np.testing.assert_array_equal(fitted.wavelengths, wavelengths)
    spectrum = fitted.spectrum(pairs)
    assert spectrum.shape == (6, 7) and np.abs(spectrum / readings - 1).mean() < 0.03
    percent = recipe.fit(100 * np.pi * readings, pairs, wavelengths=wavelengths, quantity="reflectance-percent")
    np.testing.assert_allclose(percent.spectrum(pairs), spectrum, rtol=1e-3)
    copied = pickle.loads(pickle.dumps(fitted))
    np.testing.assert_array_equal(copied.spectrum(pairs), spectrum)

    with open(tmp_path / "bands.csv", "w") as file:
        print("theta_i,theta_o", *wavelengths, sep=",", file=file)
        for row, bands in zip(np.degrees(angles), readings):
            print(*row, *bands, sep=",", file=file)
    np.testing.assert_allclose(recipe.fit(tmp_path / "bands.csv").spectrum(pairs), spectrum, rtol=1e-3)
    for arguments in [{"wavelengths": wavelengths[::-1]}, {"wavelengths": [400, 500]}]:
        with pytest.raises(glimpse.GlimpseError):
            recipe.fit(readings, pairs, **arguments)
    with pytest.raises(glimpse.GlimpseError):
        recipe.fit(readings[:, :3], pairs).spectrum(pairs)


def test_bundled_recipes_have_names_and_components():
    recipe = glimpse.Recipe.load("linear-n8")
    assert recipe.model == "linear" and recipe.samples == 8
    material = glimpse.load_material("procedural:1:9")
    any_recipe = glimpse.Recipe.load("linear-any")
    fitted = any_recipe.fit(material(recipe.directions), recipe.directions)
    mean, components = any_recipe.components(recipe.directions)
    lists, count = fitted.parameters.reshape(3, -1), components.shape[1]
    assert lists.shape[1] == count + recipe.samples
    mapped = mean[:, None] + components @ lists[:, :count].T
    cosines = recipe.directions[:, :, 2].prod(1)[:, None]
    brdf = np.maximum(1e-3 * (np.exp(mapped) - 1) / cosines, 0)
    # The rest is the discrepancy.
    assert np.abs(np.log(brdf / fitted(recipe.directions))).mean() < 0.1
