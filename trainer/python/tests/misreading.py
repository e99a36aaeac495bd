"""The confusion table of files of readings that mean something else than they seem to.

usage: python misreading.py RECIPE SOURCE...

Files of materials at the directions of instruments are written as people write them, and read as `trainer fit` does.
Prints for each instrument and change the shares of files with the right values and no word, with a refusal or a question that
names the cause, with one that names another cause, with wrong values and no word, and of refused files.
"""

import sys
import tempfile
import warnings
from pathlib import Path

import glimpse_brdf as glimpse
import numpy as np

LINE = [(45, angle) for angle in range(-80, 81, 5) if abs(45 + angle) >= 4]
SIX = [(45, angle) for angle in (60, 30, 20, 0, -30, -65)]
# theta_i, and theta_o, which is positive on the side of the mirror direction.
INSTRUMENTS = {
    "six angles": SIX,
    "the same and gloss": SIX + [(20, 20), (60, 60), (80, 80)],
    "one line": LINE,
    "five lines": [(i, o) for i in (5, 20, 40, 60, 75) for o in range(-80, 81, 5) if abs(i + o) >= 4],
    "sixteen random": None,
}
NOISE = 0.01
# The ratio to the loss of the right file from which on values are wrong.
WRONG = 1.3
# Light and sensor are in each other's way within this angle, degrees.
SHADOW = 8


class File:
    """Rows of angles (theta_i, theta_o and for random directions phi, degrees), numbers and further cells."""

    def __init__(self, material, pairs, random):
        self.is_in_plane = pairs is not None
        if self.is_in_plane:
            theta_i, signed = np.array(pairs, float).T
            theta_o, phi = abs(signed), np.where(signed > 0, 180.0, 0.0)
            self.angles = np.stack([theta_i, signed], 1)
        else:
            # Uniform over half vectors and differences, as a goniometer without a plan.
            directions = np.random.default_rng(77)
            theta_i, theta_o = np.degrees(np.arccos(directions.uniform(0.05, 1, (2, 16))))
            phi = directions.uniform(0, 360, 16)
            self.angles = np.stack([theta_i, theta_o, phi], 1)
        pairs = glimpse.directions_from_degrees(theta_i, 0 * theta_i, theta_o, phi)
        self.cosines = pairs[..., 2].T[..., None]
        self.separation = np.degrees(np.arccos(np.clip((pairs[:, 0] * pairs[:, 1]).sum(1), -1, 1)))
        self.numbers = np.maximum(material(pairs), 0) * (1 + NOISE * random.normal(size=(len(pairs), 3)))
        self.columns, self.words, self.has_commas = "r,g,b", [""] * len(pairs), False

    def double(self, column, words, numbers):
        """Adds a row with other numbers to each row, and a column of words."""
        self.columns += "," + column
        self.words = [word for _ in self.angles for word in words]
        self.angles = np.repeat(self.angles, 2, 0)
        self.numbers = np.stack([self.numbers, numbers], 1).reshape(-1, 3)

    def text(self):
        rows = [",".join(f"{cell:.6f}" for cell in [*at, *numbers]) for at, numbers in zip(self.angles, self.numbers)]
        azimuth = "phi," if self.angles.shape[1] > 2 else ""
        lines = [f"theta_i,theta_o,{azimuth}{self.columns}"]
        lines += [row + (f",{word}" if word else "") for row, word in zip(rows, self.words)]
        text = "\n".join(lines) + "\n"
        return text.translate({44: ";", 46: ",", 45: "\u2212"}) if self.has_commas else text


def turn(file):
    if file.is_in_plane:
        file.angles[:, 1] *= -1
    else:
        file.angles[:, 2] = (file.angles[:, 2] + 180) % 360


def elevate(file):
    file.angles[:, :2] = np.copysign(90, file.angles[:, :2]) - file.angles[:, :2]


def exchange(file):
    file.angles[:, [0, 1]] = file.angles[:, [1, 0]]


def to_radians(file):
    file.angles = np.radians(file.angles)


def azimuths_to_radians(file):
    theta_i, theta_o = file.angles[:, 0], file.angles[:, 1]
    phi = np.where(theta_o > 0, 180.0, 0.0) if file.is_in_plane else file.angles[:, 2]
    file.angles = np.stack([theta_i, abs(theta_o), np.radians(phi)], 1)


def numbers(change):
    def apply(file):
        file.numbers = change(file.numbers, *file.cosines)

    return apply


def encode(values):
    values = np.minimum(values, 1)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


def lengthen(file):
    file.columns = "value,channel"
    file.words = ["R", "G", "B"] * len(file.angles)
    file.angles = np.repeat(file.angles, 3, 0)
    file.numbers = file.numbers.reshape(-1, 1)


def write_commas(file):
    file.has_commas = True


def gain(file):
    factors = np.where(np.arange(len(file.angles)) % 2, 4, 1)
    file.columns += ",gain"
    file.numbers = file.numbers * factors[:, None]
    file.words = [str(factor) for factor in factors]


def shadow(change):
    def apply(file):
        hidden = file.separation <= SHADOW
        file.numbers[hidden] = change(file.numbers[hidden])

    return apply


def clip(file):
    file.numbers = np.minimum(file.numbers, file.numbers.max() / 3)


# The change, and a word of the cause that a message must contain: None if the file has to be read. A tuple has kinds of outliers.
CHANGES = {
    "right": (lambda file: None, None),
    "mirror on the other side": (turn, "from-mirror"),
    "angles from the surface": (elevate, "elevation"),
    "light and sensor exchanged": (exchange, "exchanged"),
    "radians": (to_radians, "radians"),
    "azimuths in radians": (azimuths_to_radians, "radians"),
    "times cos(theta_i)": (numbers(lambda f, i, o: f * i), "brdf-cos-i"),
    "times cos(theta_o)": (numbers(lambda f, i, o: f * o), "brdf-cos-o"),
    "times both cosines": (numbers(lambda f, i, o: f * i * o), "brdf-cos-i-o"),
    "reflectance factors": (numbers(lambda f, i, o: np.pi * f), "reflectance-factor"),
    "percent": (numbers(lambda f, i, o: 100 * np.pi * f), "percent"),
    "sRGB": (numbers(lambda f, i, o: encode(np.pi * f)), "srgb"),
    "a row for each channel": (lengthen, None),
    "decimal commas, minus signs": (write_commas, None),
    "flags of wrong rows": (lambda file: file.double("valid", "10", 0.2 * file.numbers), None),
    "rows of transmission": (lambda file: file.double("scatter", ["BRDF", "BTDF"], file.numbers[:, ::-1]), None),
    "two samples": (lambda file: file.double("sample", ["one", "other"], file.numbers[:, ::-1]), "sample"),
    "a column of gains": (gain, "gain"),
    "zeros in the shadow": (shadow(lambda f: 0 * f), ("no-light", "obstructed")),
    "stray light in the shadow": (shadow(lambda f: 3 * f + 0.1), ("obstructed", "neighbors")),
    "cut off at a third": (clip, ("clipped",)),
}


def outcome(recipe, material, text, cause, right_loss):
    """Returns the loss, and the shares: right, cause named, other cause, silently wrong, refused."""
    loss, words, kinds, is_refused = np.inf, "", [], False
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as questions:
        warnings.simplefilter("always")
        path = Path(folder, "file.csv")
        path.write_text(text, encoding="utf-8")
        try:
            fit = recipe.fit(path)
            loss, words = glimpse.loss(material, fit), " ".join(str(question.message) for question in questions)
            kinds = [outlier["kind"] for outlier in fit.report["readings"]["outliers"]]
        except glimpse.GlimpseError as error:
            words, is_refused = str(error), True
    of_readings = isinstance(cause, tuple)
    is_named = any(kind in cause for kind in kinds) if of_readings else cause is not None and cause in words
    has_word = bool(words) or of_readings and bool(kinds)
    is_right = loss <= WRONG * (right_loss or loss)
    shares = [not has_word and is_right, is_named, has_word and not is_named, not has_word and not is_right, is_refused]
    return loss, np.array(shares, float)


def confusion(recipe, materials):
    """Returns the shares of each instrument and change."""
    shares = {}
    for instrument, pairs in INSTRUMENTS.items():
        for seed, material in enumerate(materials):
            right_loss = None
            for name, (change, cause) in CHANGES.items():
                file = File(material, pairs, np.random.default_rng(seed))
                change(file)
                loss, result = outcome(recipe, material, file.text(), cause, right_loss)
                right_loss = right_loss or loss
                shares[instrument, name] = shares.get((instrument, name), 0) + result / len(materials)
    return shares


def main():
    recipe = glimpse.Recipe.load(sys.argv[1])
    for source in sys.argv[2:]:
        print(f"\n{source}\n\n| instrument | file | right | named | other cause | silently wrong | refused |")
        print("|---|---|--:|--:|--:|--:|--:|")
        for (instrument, name), shares in confusion(recipe, glimpse.load_materials(source)).items():
            print(f"| {instrument} | {name} | " + " | ".join(f"{share:.2f}" for share in shares) + " |")


if __name__ == "__main__":
    main()
