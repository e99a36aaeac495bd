"""Materials: agreement with `trainer query`, construction from functions and arrays, writing and reading."""

import copy
import csv
import io
import os
import pickle
import subprocess
import sys
import threading

import glimpse_brdf as glimpse
import numpy as np
import pytest
from conftest import BUNDLED, assert_names, directions, to_degrees, write_csv


def test_material_matches_query_command(trainer, tmp_path):
    pairs = directions(500)
    write_csv(tmp_path / "angles.csv", "theta_i,phi_i,theta_o,phi_o", to_degrees(pairs).tolist())
    rows = csv.DictReader(io.StringIO(trainer("query", "procedural:1:77", "--angles", "angles.csv")))
    expected = np.array([[float(row[c]) for c in "rgb"] for row in rows])
    material = glimpse.load_material("procedural:1:77")
    brdf = material(pairs)
    assert brdf.shape == (500, 3) and brdf.dtype == np.float32
    # The conversion to degrees rounds.
    np.testing.assert_allclose(brdf, expected, rtol=1e-4, atol=1e-6)
    assert np.median(np.abs(brdf / expected - 1)) < 1e-6


def test_shapes_layouts_and_types():
    material = glimpse.load_material("procedural:1")
    pairs = directions(24)
    expected = material(pairs)
    incoming, outgoing = pairs[:, 0], pairs[:, 1]
    equivalent = [
        material(incoming, outgoing),
        material(np.asfortranarray(incoming), outgoing.copy()),
        material(incoming.tolist(), outgoing.tolist()),
        material(7 * incoming, 0.5 * outgoing),
        material(pairs.reshape(4, 6, 2, 3)).reshape(24, 3),
        np.stack([material(i, o) for i, o in pairs]),
        material(pairs[::-1])[::-1],
    ]
    for brdf in equivalent:
        np.testing.assert_allclose(brdf, expected, rtol=1e-5)
    np.testing.assert_allclose(material(pairs.astype(np.float32)), expected, rtol=1e-3)
    assert material(incoming[0], outgoing).shape == (24, 3)
    assert material(pairs[0]).shape == (3,)
    assert material(np.empty((0, 2, 3))).shape == (0, 3)
    assert not material([0, 0, 1], [0.6, 0, -0.8]).any()
    many = directions(5000, 1)
    np.testing.assert_array_equal(material(many)[:10], material(many[:10]))


@pytest.mark.parametrize(
    "arguments, expected_names",
    [
        ((np.zeros((4, 3)),), ["(..., 2, 3)"]),
        ((np.zeros((4, 2, 3)),), ["0", "(0, 0, 0)"]),
        (([[0, 0, np.nan]], [0, 0, 1]), ["incoming", "0"]),
        ((np.ones((4, 3)), np.ones((5, 3))), []),
        ((np.ones(3), np.ones(2)), ["outgoing", "(..., 3)", "(2,)"]),
        ((np.ones((2, 3), complex),), ["dtype", "complex128"]),
        (("up",), []),
        (([[1, 2], [3]],), []),
        ((None,), []),
    ],
)
def test_rejects_invalid_directions(arguments, expected_names):
    with pytest.raises(glimpse.GlimpseError) as error:
        glimpse.load_material("procedural:1")(*arguments)
    assert_names(error.value, *expected_names)


def test_errors_match_commands(trainer, tmp_path):
    with pytest.raises(FileNotFoundError) as error:
        glimpse.load_material("nowhere.binary")
    mirror = tmp_path / "mirror.csv"
    mirror.write_text("theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n")
    assert str(error.value) == trainer("query", "nowhere.binary", "--angles", "mirror.csv", fails=True)
    damaged = tmp_path / "damaged.binary"
    damaged.write_bytes(b"no table")
    with pytest.raises(glimpse.GlimpseError) as error:
        glimpse.load_materials(damaged)
    assert str(error.value) == trainer("query", damaged, "--angles", "mirror.csv", fails=True)
    with pytest.raises(glimpse.GlimpseError, match=r"\b3\b"):
        glimpse.load_material("procedural:3")
    with pytest.raises(ValueError, match="procedural:many"):
        glimpse.load_material("procedural:many")
    with pytest.raises(TypeError):
        glimpse.load_material(3)
    names = [material.name for material in glimpse.load_materials("procedural:3:5")]
    assert len(set(names)) == 3


def glossy(incoming, outgoing):
    assert incoming.shape == outgoing.shape and incoming.shape[1] == 3
    highlight = np.exp(-20 * (1 - (incoming[:, 2] + outgoing[:, 2]) / np.linalg.norm(incoming + outgoing, axis=1)))
    return np.array([0.1, 0.2, 0.3]) + highlight[:, None]


def test_material_from_function(tmp_path):
    material = glimpse.Material.from_function(glossy, "glossy")
    assert material.name == "glossy"
    pairs = directions(2000, 3)
    # Within two degrees of the horizon, nodes for interpolation are missing.
    inside = (pairs[..., 2] > np.sin(np.radians(2))).all(1)
    expected = glossy(pairs[:, 0], pairs[:, 1])
    assert inside.mean() > 0.9
    np.testing.assert_allclose(material(pairs)[inside], expected[inside], rtol=2e-3)
    np.testing.assert_allclose(material(pairs), expected, rtol=0.05)
    nodes = glimpse.table_directions()
    assert nodes.shape[1:] == (2, 3) and (nodes[..., 2] > 0).all()
    np.testing.assert_allclose(np.linalg.norm(nodes, axis=-1), 1, atol=1e-6)
    values = glossy(nodes[:, 0], nodes[:, 1])
    from_table = glimpse.Material.from_table(values, "glossy")
    np.testing.assert_array_equal(from_table(pairs), material(pairs))

    from_table.save(tmp_path / "glossy.binary", as_fitted=True)
    loaded = glimpse.load_material(tmp_path / "glossy.binary")
    # Values are rounded to 32 bits before they are written.
    np.testing.assert_allclose(loaded(pairs), material(pairs), rtol=1e-6)
    with pytest.raises(FileExistsError, match="overwrite"):
        glimpse.load_material("procedural:1").save(tmp_path / "glossy.binary")
    from_table.save(tmp_path / "glossy.binary", as_fitted=True)
    glimpse.load_material("procedural:1").save(tmp_path / "glossy.binary", overwrite=True)

    values[5] = np.nan
    with pytest.warns(UserWarning, match="with an unknown value: 0.00 %"):
        glimpse.Material.from_table(values, "with an unknown value")
    values[6, 1] = np.inf
    with pytest.raises(glimpse.GlimpseError, match="6.*inf.*green"):
        glimpse.Material.from_table(values, "broken")
    with pytest.raises(glimpse.GlimpseError, match=rf"\b{len(values) - 1}\b"):
        glimpse.Material.from_table(values[1:], "short")


@pytest.mark.parametrize("value", [-1, -1e-9, -np.inf, np.inf])
def test_error_names_direction_of_invalid_value(value):
    def function(incoming, outgoing):
        # Red is invalid where the half vector is the normal and theta_d is 7 degrees.
        is_invalid = np.isclose(incoming[:, 2], np.cos(np.radians(7))) & np.isclose(outgoing[:, 2], incoming[:, 2])
        is_invalid &= np.isclose(np.linalg.norm((incoming + outgoing)[:, :2], axis=1), 0, atol=1e-9)
        brdf = np.full((len(incoming), 3), 0.25)
        brdf[is_invalid, 0] = value
        return brdf

    with pytest.raises(glimpse.GlimpseError) as error:
        glimpse.Material.from_function(function, "a")
    text = str(error.value)
    assert "red" in text and "theta_h 0.000" in text and "theta_d 7.000" in text, text
    finite = f"-{abs(np.float32(value)):.9f}".rstrip("0").rstrip(".")
    formatted = {np.inf: "inf", -np.inf: "-inf"}.get(value, finite)
    assert f" {formatted} " in text, text


def test_error_for_table_of_nan_names_nan():
    for brdf in ([np.nan, np.nan, np.nan], [1, 1, np.nan]):
        with pytest.raises(glimpse.GlimpseError) as error:
            glimpse.Material.from_function(lambda i, o, brdf=brdf: np.full((len(i), 3), brdf), "a")
        text = str(error.value)
        assert "NaN" in text and "100.0 %" in text and "negative" not in text, text


def test_loss_matches_evaluate(trained):
    pairs = glimpse.directions()
    assert pairs.shape == (40503, 2, 3) and pairs.dtype == np.float64 and (pairs[..., 2] > 0).all()
    np.testing.assert_allclose(np.linalg.norm(pairs, axis=-1), 1, atol=1e-6)
    # Directions are uniform in theta_h over the valid region. Over the hemisphere, few would have a small theta_h.
    half = pairs.sum(1) / np.linalg.norm(pairs.sum(1), axis=-1, keepdims=True)
    theta_h = np.degrees(np.arccos(np.clip(half[:, 2], -1, 1)))
    assert (theta_h < 9).mean() > 0.15
    for model in ("linear", "neural"):
        recipe = trained[model]
        for material, report in zip(
            glimpse.load_materials("procedural:2:8"), glimpse.evaluate(recipe, "procedural:2:8")["materials"]
        ):
            fitted = recipe.fit(material(recipe.directions))
            loss = glimpse.loss(material, fitted)
            assert loss == pytest.approx(report["loss"], abs=1e-6) and isinstance(loss, float)
            loss_of_arrays = glimpse.loss(material(pairs), fitted(pairs))
            # The conversion between vectors and angles rounds.
            assert loss_of_arrays == pytest.approx(loss, rel=1e-4)
            assert glimpse.loss(fitted, material) == pytest.approx(loss, rel=1e-9)
            assert glimpse.loss(material, material) == 0
            logarithms = [np.log1p(brdf.astype(float) * pairs[:, 0, 2:]) for brdf in (material(pairs), fitted(pairs))]
            assert np.abs(logarithms[0] - logarithms[1]).mean() == pytest.approx(loss, rel=1e-4)
    values = material(pairs)
    invalid = [(values[1:], "(40503, 3)"), (np.where(values > 0, -1, values), "row 0"), (values * np.nan, "nan")]
    for brdf, text in invalid:
        with pytest.raises(glimpse.GlimpseError) as error:
            glimpse.loss(material, brdf)
        assert text in str(error.value).lower()


def unpickle_in_process(material, tmp_path):
    """Unpickles a material in another process. Returns its BRDF at directions(300), its type and its name."""
    (tmp_path / "m.pickle").write_bytes(pickle.dumps(material))
    np.save(tmp_path / "directions.npy", directions(300))
    code = """
        import pickle, numpy as np
        material = pickle.load(open("m.pickle", "rb"))
        np.save("values.npy", material(np.load("directions.npy")))
        print(type(material).__name__, material.name)
    """
    command = [sys.executable, "-c", "\n".join(map(str.strip, code.splitlines()))]
    process = subprocess.run(command, cwd=tmp_path, text=True, capture_output=True)
    assert process.returncode == 0, process.stderr
    return np.load(tmp_path / "values.npy"), process.stdout.split()


def materials_of_all_kinds(trained, folder):
    glimpse.load_material("procedural:1:4").save(folder / "table.binary")
    glimpse.load_material("procedural:1:5").save(folder / "other.bsdf")
    yield from glimpse.load_materials("procedural:3:5")
    yield from glimpse.load_materials(folder)
    yield glimpse.Material.from_function(
        lambda i, o: np.full((len(i), 3), [0.1, 0.2, 0.3]) * i[:, 2:] * o[:, 2:], "from a lambda"
    )
    for recipe in trained.values():
        material = glimpse.load_material("procedural:1:3")
        readings = material(recipe.directions).astype(float)
        readings[2] *= 1000
        readings[4] = np.nan
        # The outlier may be implausible.
        try:
            fitted = recipe.fit(readings, name="fit")
        except glimpse.ImplausibleError as error:
            fitted = error.fit
        yield fitted


def test_materials_are_copied_and_pickled(trained, tmp_path, monkeypatch):
    # Paths are relative, and the material is unpickled in another working directory.
    folder, elsewhere = tmp_path / "folder", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    monkeypatch.chdir(tmp_path)
    at, kinds = directions(300), set()
    for material in materials_of_all_kinds(trained, folder.relative_to(tmp_path)):
        assert copy.copy(material) is material and copy.deepcopy([material])[0] is material
        unpickled = pickle.loads(pickle.dumps(material))
        np.testing.assert_array_equal(unpickled(at), material(at))
        assert unpickled.name == material.name and type(unpickled) is type(material)
        values, words = unpickle_in_process(material, elsewhere)
        np.testing.assert_array_equal(values, material(at))
        assert words == [type(material).__name__, *material.name.split()]
        kinds.add(words[0])
        if isinstance(material, glimpse.FittedMaterial):
            np.testing.assert_array_equal(unpickled.parameters, material.parameters)
            assert unpickled.report == material.report
    assert kinds == {"Material", "FittedMaterial"}


def test_unpickling_requires_same_file(tmp_path):
    path = tmp_path / "m.binary"
    glimpse.load_material("procedural:1:4").save(path)
    pickled = pickle.dumps(glimpse.load_material(path))
    assert len(pickled) < 10_000
    os.rename(path, tmp_path / "elsewhere.binary")
    with pytest.raises(FileNotFoundError, match="m.binary"):
        pickle.loads(pickled)
    glimpse.load_material("procedural:1:5").save(path)
    with pytest.raises(glimpse.GlimpseError, match="m.binary"):
        pickle.loads(pickled)


def test_exception_of_function_is_passed_on():
    def broken(incoming, outgoing):
        raise KeyError("lamp")

    with pytest.raises(KeyError, match="lamp"):
        glimpse.Material.from_function(broken, "a")
    with pytest.raises(glimpse.GlimpseError):
        glimpse.Material.from_function(lambda i, o: i[:, 0], "a")
    with pytest.raises(glimpse.GlimpseError, match=r"\(1, 3\)"):
        glimpse.Material.from_function(lambda i, o: i[:1], "a")


@pytest.mark.parametrize("name", ["m.bsdf", "m_fc1.npy", "m"])
def test_save_matches_convert_command(trainer, tmp_path, name):
    trainer("convert", "procedural:1:4", f"command-{name}", *(["--format", "pab"] if name == "m" else []))
    material = glimpse.load_material("procedural:1:4")
    material.save(tmp_path / f"python-{name}", "pab" if name == "m" else None)
    paths = sorted(tmp_path.glob("command-*"))
    assert paths
    for path in paths:
        written = path.with_name(path.name.replace("command", "python")).read_bytes()
        assert written.replace(b"python-", b"command-") == path.read_bytes()


def test_save_changes_tables_to_be_physical(tmp_path):
    neural = glimpse.Recipe.load(BUNDLED / "completed/neural-n4.recipe")
    fitted = neural.fit(glimpse.load_material("procedural:1:4")(neural.directions))
    pairs = directions(200, 3)

    def change(path):
        material = glimpse.load_material(path)
        one, other = material(pairs), material(pairs[:, ::-1])
        return np.abs(one - other).sum() / one.sum()

    with pytest.warns(UserWarning, match="as_fitted"):
        fitted.save(tmp_path / "physical.bsdf")
    fitted.save(tmp_path / "fitted.bsdf", as_fitted=True)
    assert change(tmp_path / "physical.bsdf") < 0.5 * change(tmp_path / "fitted.bsdf")
    with pytest.raises(glimpse.GlimpseError, match="as_fitted"):
        fitted.save(tmp_path / "m.gltf", as_fitted=True)


def test_rejects_path_without_format(tmp_path):
    material = glimpse.load_material("procedural:1")
    with pytest.raises(glimpse.GlimpseError, match="m.txt"):
        material.save(tmp_path / "m.txt")
    with pytest.raises(glimpse.GlimpseError, match=r"\bmerl\b"):
        material.save(tmp_path / "m.binary", "rgl")
    with pytest.raises(glimpse.GlimpseError, match="nbrdf"):
        material.save(tmp_path / "m", "obj")
    with pytest.raises(FileNotFoundError, match="none"):
        material.save(tmp_path / "none" / "m.bsdf")


def test_directions_from_degrees():
    pairs = glimpse.directions_from_degrees([0, 30, 90], 0, 30, [180, 180, 90])
    assert pairs.shape == (3, 2, 3)
    s, c = 0.5, 3**0.5 / 2
    np.testing.assert_allclose(pairs[1], [[s, 0, c], [-s, 0, c]], atol=1e-15)
    assert glimpse.directions_from_degrees(10, 0, 10, 180).shape == (2, 3)


def test_other_threads_run_during_evaluation():
    material = glimpse.load_material("procedural:1")
    pairs = directions(300_000)
    finished, iterations = threading.Event(), 0
    thread = threading.Thread(target=lambda: (material(pairs), finished.set()))
    thread.start()
    while not finished.is_set():
        iterations += 1
        finished.wait(0.001)
    thread.join()
    assert iterations > 3


def test_unmeasured_directions_are_nan_and_not_used(tmp_path):
    for theta_i, value in [(20, 0.1), (40, 0.4)]:
        lines = [f"{theta} {phi} {value}" for theta in range(0, 90, 10) for phi in range(0, 360, 20)]
        header = f"#colorimetry: CIE-Y\n#format: theta phi BRDF\n#intheta {theta_i}\n#inphi 0\n"
        (tmp_path / f"card_{theta_i}.dat").write_text(header + "\n".join(lines) + "\n")
    path = tmp_path / "card_20.dat"
    with pytest.warns(UserWarning, match=r"20 \(card_20.dat\), 40 \(card_40.dat\)"):
        card = glimpse.load_material(path)
    brdf = card(glimpse.directions_from_degrees([30, 60, 5], 0, [10, 10, 5], 180))
    np.testing.assert_allclose(brdf[0], 0.25, atol=1e-3)
    assert np.isnan(brdf[1:]).all()
    reference = glimpse.load_material("procedural:1")
    for use in [
        lambda: glimpse.loss(reference, card),
        lambda: glimpse.compare(reference, card),
        lambda: glimpse.compare(reference, path),
        lambda: card.save(tmp_path / "card.binary"),
        lambda: glimpse.train("linear", card, samples=4),
    ]:
        with pytest.raises(glimpse.GlimpseError) as error:
            use()
        assert_names(error.value, "card_20.dat", "20", "40")


def test_albedo_and_picture():
    gray = glimpse.Material.from_function(lambda incoming, outgoing: np.full((len(incoming), 3), 0.3 / np.pi), "gray")
    np.testing.assert_allclose(gray.albedo([[0, 30, 60]]), np.full((1, 3, 3), 0.3), rtol=2e-3)
    with pytest.raises(glimpse.GlimpseError):
        gray.albedo(91)
    picture = gray.render(32)
    assert picture.shape == (32, 32, 3) and picture.dtype == np.uint8 and np.ptp(picture) > 50
