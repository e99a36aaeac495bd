"""Photographs of a ball become readings: in Python, and by the program."""

import csv
import json
import struct
import zlib

import glimpse_brdf as glimpse
import numpy as np
import photographs
import pytest
from conftest import assert_names
from photographs import CENTER, RADIUS, SIDE, Setup, errors, light, photograph

LIGHTS = np.array([light(*angles) for angles in photographs.LIGHTS])


def write_png(path, pixels, gamma=100_000):
    """Writes a PNG file of 16 bits; pixels are fractions of full scale."""
    samples = np.round(np.clip(pixels, 0, 1) * 65535).astype(">u2")
    height, width, _ = samples.shape
    rows = b"".join(b"\0" + row.tobytes() for row in samples)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"gAMA", struct.pack(">I", gamma)), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*one) for one in chunks))


def write_set(folder, pictures, lights=LIGHTS, intensities=None):
    """Writes pictures and the table of their lights. Returns the pictures' names."""
    names = [f"{index}.png" for index in range(len(pictures))]
    for name, pixels in zip(names, pictures):
        write_png(folder / name, pixels)
    rows = ["picture,x,y,z" + (",r,g,b" if intensities is not None else "")]
    for index, name in enumerate(names):
        numbers = [*lights[index], *(intensities[index] if intensities is not None else [])]
        rows.append(",".join([name, *map(str, numbers)]))
    (folder / "lights.csv").write_text("\n".join(rows) + "\n")
    return names


def read_table(path):
    return np.genfromtxt(path, delimiter=",", names=True, usecols=range(8))


def lambertian(pairs):
    return np.broadcast_to([0.2, 0.1, 0.05], (*pairs.shape[:-2], 3))


def lambertian_readings(path):
    table = read_table(path)
    return np.stack([table[name] for name in "rgb"], 1)


@pytest.fixture(scope="module")
def white():
    """Photographs of a Lambertian ball without noise, f cos(theta_i)."""
    return np.array([photograph(lambertian, direction) for direction in LIGHTS])


def test_lambertian_ball_has_one_brdf(white):
    readings = glimpse.photo(white, LIGHTS, intensities=np.ones((3, 3)))
    assert np.abs(np.subtract(readings["circle"], (*CENTER, RADIUS))).max() < 0.5
    assert 200 < len(readings["brdf"]) <= 4096
    # An error of the circle matters where the light grazes, and the noise says so.
    assert np.all(np.abs(readings["brdf"] / [0.2, 0.1, 0.05] - 1) <= readings["noise"][:, None])
    assert set(readings["pixels"][:, 0]) == {0, 1, 2}
    assert readings["noise"].min() >= 0.08
    # With the true circle, only the pixels' size remains.
    exact = glimpse.photo(white, LIGHTS, intensities=np.ones((3, 3)), circle=(*CENTER, RADIUS))
    np.testing.assert_allclose(exact["brdf"], np.broadcast_to([0.2, 0.1, 0.05], exact["brdf"].shape), rtol=0.005)
    relative = glimpse.photo(7 * white, LIGHTS, albedo=0.3)
    assert np.median(relative["brdf"].mean(1)) * np.pi == pytest.approx(0.3, rel=0.01)


def test_each_picture_shows_the_circle(white):
    for picture, direction in zip(white[:2], LIGHTS):
        circle = glimpse.photo([picture], [direction], albedo=0.5)["circle"]
        assert np.abs(np.subtract(circle, (*CENTER, RADIUS))).max() < 1


def test_saturated_and_unknown_pixels_are_left_out(white):
    pictures = white.copy()
    pictures[0, 90:100, 90:100] = np.inf
    pictures[1, :80] = np.nan
    readings = glimpse.photo(pictures, LIGHTS, intensities=np.ones((3, 3)), circle=(*CENTER, RADIUS))
    photo, column, row = readings["pixels"].T
    assert not np.any((photo == 0) & (abs(column - 94.5) < 5) & (abs(row - 94.5) < 5))
    assert np.all(row[photo == 1] >= 80)
    assert np.isfinite(readings["brdf"]).all()


def test_wrong_arguments_are_refused(white):
    lights = LIGHTS.copy()
    for change, name in [
        ({"pictures": white[0]}, "pictures"),
        ({"lights": lights[:2]}, "lights"),
        ({"lights": lights * [[0], [1], [1]]}, 0),
        ({"intensities": None}, "albedo"),
        ({"pictures": np.zeros_like(white)}, "circle"),
    ]:
        arguments = {"pictures": white, "lights": lights, "intensities": np.ones((3, 3))} | change
        with pytest.raises(glimpse.GlimpseError) as error:
            glimpse.photo(**arguments)
        assert_names(error.value, name)


def test_fit_of_photographs_is_as_good_as_of_exact_readings():
    recipe = glimpse.Recipe.load("linear-any")
    ratios = []
    for index, material in enumerate(glimpse.load_materials("procedural:5:6")):
        # The limb of the mirror among them is too dark to find.
        readings = Setup(material, np.random.default_rng(index)).readings(circle=(*CENTER, RADIUS))
        exact = np.maximum(material(readings["directions"]), 0)
        of_exact = errors(recipe, material, readings | {"brdf": exact})
        ratios.append(np.divide(errors(recipe, material, readings), of_exact))
    assert np.all(np.median(ratios, 0) <= 1.1), ratios


def test_program_takes_the_pictures_that_it_renders(trainer, tmp_path):
    write_set(tmp_path, [])
    rows = [f"{index}.png,{','.join(map(str, direction))}" for index, direction in enumerate(LIGHTS)]
    (tmp_path / "lamps.csv").write_text("\n".join(["picture,x,y,z", *rows]) + "\n")
    trainer("render", "sphere", "procedural:1:5", "--lights", "lamps.csv", "--size", 160, "--out", "set")
    pictures = [f"set/{index}.png" for index in range(3)]
    photo = ["photo", *pictures, "--lights", "set/lights.csv"]
    report = json.loads(trainer(*photo, "--out", "ball.csv", "--json"))
    assert [row["picture"] for row in report["photographs"]] == ["0.png", "1.png", "2.png"]
    assert (tmp_path / "ball.png").read_bytes().startswith(b"\x89PNG")
    assert report["circle"]["radius"] == pytest.approx(0.48 * 160, abs=0.5)
    counts = report["photographs"][2]["pixels"]
    assert counts["shadowed"] > counts["used"] > 0
    trainer("fit", "--measurements", "ball.csv", "--out", "fit")
    compare = [*photo, "--compare", "fit/material.json", "--measurements", "ball.csv"]
    errors = json.loads(trainer(*compare, "--out", "comparison.png", "--json"))
    assert [row["picture"] for row in errors["pictures"]] == ["0.png", "1.png", "2.png", "mean"]
    (of_fit, loss), of_ggx = errors["pictures"][3]["levels_and_loss"], errors["pictures"][3]["ggx"]
    assert of_fit < 3 and loss < 0.01 and of_fit < 1.5 * of_ggx[0]
    assert (tmp_path / "comparison.png").read_bytes().startswith(b"\x89PNG")


def test_program_finds_scale_and_lights(white, trainer, tmp_path):
    expected = [0.2, 0.1, 0.05]
    dark = np.full((SIDE, SIDE, 3), 0.01)
    intensities = np.array([[1.0, 2, 3], [2, 2, 2], [3, 3, 3]])
    exposed = white * intensities[:, None, None] + dark
    names = write_set(tmp_path, exposed, intensities=intensities)
    write_png(tmp_path / "dark.png", dark)
    photo = ["photo", *names, "--lights", "lights.csv", "--force"]
    trainer(*photo, "--dark", "dark.png", "--out", "table.csv")
    np.testing.assert_allclose(np.median(lambertian_readings(tmp_path / "table.csv"), 0), expected, rtol=0.01)

    # The scale of a white ball of another size, and of a tile, for lights without intensities.
    write_set(tmp_path, exposed)
    assert_names(trainer(*photo, "--out", "x.csv", fails=True), "--white", "--albedo")
    for shape in ["ball", "tile"]:
        for index, direction in enumerate(LIGHTS[:2]):
            ball = photograph(lambda pairs: np.full((len(pairs), 3), 0.9 / np.pi), direction)
            pixels = ball if shape == "ball" else np.full_like(ball, 0.9 / np.pi * direction[2])
            write_png(tmp_path / f"white{index}.png", pixels * intensities[index] + dark)
        white_args = ["--white", "white0.png", "white1.png", "--white-shape", shape, "--white-reflectance", 0.9]
        two = ["photo", *names[:2], "--lights", "lights.csv", "--force"]
        trainer(*two, "--dark", "dark.png", *white_args, "--out", "white.csv")
        np.testing.assert_allclose(np.median(lambertian_readings(tmp_path / "white.csv"), 0), expected, rtol=0.01)

    # The lights of a chrome ball with radius 60: the highlight's normal is half-way to the camera.
    column, row = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    right, up = (column - 90) / 60, (88 - row) / 60
    square = 1 - right**2 - up**2
    normals = np.stack([right, up, np.sqrt(np.maximum(square, 0))], -1)
    mirrored = 2 * normals[..., 2:] * normals - [0, 0, 1]
    for index, direction in enumerate(LIGHTS):
        is_lit = (square > 0) & (mirrored @ direction > np.cos(np.radians(2)))
        write_png(tmp_path / f"chrome{index}.png", np.where(is_lit, 1.0, 0.02)[..., None] * np.ones(3))
    chrome = ["--chrome", *(f"chrome{index}.png" for index in range(3)), "--chrome-circle", "90,88,60"]
    report = json.loads(
        trainer("photo", *names, *chrome, "--albedo", 0.3, "--dark", "dark.png", "--out", "chrome.csv", "--json")
    )
    angles = [row["light_degrees"] for row in report["photographs"]]
    np.testing.assert_allclose(angles, [10, 60, 120], atol=0.7)
    assert report["albedo"] == 0.3


def test_dust_is_named_by_its_place_and_masked(trainer, tmp_path):
    material = glimpse.load_material("procedural:1:5")
    clean = np.array([photograph(material, direction) for direction in LIGHTS])
    intensities = np.repeat(0.9 / clean.max((1, 2, 3))[:, None], 3, 1)
    pictures = clean * intensities[:, None, None]
    photo = ["photo", *write_set(tmp_path, pictures, intensities=intensities), "--lights", "lights.csv"]
    report = json.loads(trainer(*photo, "--out", "clean.csv", "--json"))
    assert all(row["pixels"]["outlier"] <= 30 for row in report["photographs"]), report
    # Dust, and a reflection of the room.
    pictures[0, 60:66, 80:86] *= 0.2
    pictures[1, 90:94, 70:74] *= 1.6
    write_set(tmp_path, pictures, intensities=intensities)
    report = json.loads(trainer(*photo, "--out", "ball.csv", "--json"))
    for index, (column, row, count) in enumerate([(82.5, 62.5, 36), (71.5, 91.5, 16)]):
        outlier = report["photographs"][index]
        assert outlier["pixels"]["outlier"] == pytest.approx(count, abs=30)
        name, _, x, _, y = outlier["outlier"].split(" ")
        assert name == f"{index}.png," and np.hypot(int(x[:-1]) - column, int(y) - row) < 5

    # The fit names the place of an outlier among the readings.
    with open(tmp_path / "clean.csv", newline="") as file:
        rows = list(csv.reader(file))
    wrong = rows[150]
    wrong[4:7] = [str(5 * float(number)) for number in wrong[4:7]]
    wrong[7] = "0.05"
    with open(tmp_path / "wrong.csv", "w", newline="") as file:
        csv.writer(file).writerows(rows)
    (fit,) = json.loads(trainer("fit", "--measurements", "wrong.csv", "--out", "fit", "--json"))
    assert wrong[8] in [outlier["place"] for outlier in fit["readings"]["outliers"]]

    mask = np.zeros((SIDE, SIDE, 3))
    column, row = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    mask[np.hypot(column - CENTER[0], row - CENTER[1]) < RADIUS] = 1
    mask[58:68, 78:88] = 0
    write_png(tmp_path / "mask.png", mask)
    report = json.loads(trainer(*photo, "--mask", "mask.png", "--out", "masked.csv", "--json"))
    assert report["photographs"][0]["pixels"]["masked"] == pytest.approx(100, abs=20)
    assert report["photographs"][0]["pixels"]["outlier"] <= 30


def test_wrong_pictures_are_refused(white, trainer, tmp_path):
    names = write_set(tmp_path, white, intensities=np.ones((3, 3)))
    photo = ["photo", *names, "--lights", "lights.csv", "--out", "x.csv"]
    write_png(tmp_path / "1.png", white[1], gamma=45_455)
    assert_names(trainer(*photo, fails=True), "1.png")
    write_png(tmp_path / "1.png", white[1, 1:])
    assert_names(trainer(*photo, fails=True), "1.png")
    write_png(tmp_path / "1.png", np.zeros_like(white[1]))
    (tmp_path / "lights.csv").write_text("picture,x,y,z,r,g,b\n0.png,0,0,1,1,1,1\n")
    assert_names(trainer(*photo, fails=True), "lights.csv", "1.png")
    assert not (tmp_path / "x.csv").exists()
