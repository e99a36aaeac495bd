"""The errors of fits to photographs of a ball.

usage: python photographs.py RECIPE SOURCE...
       python photographs.py --mitsuba RECIPE FILE.bsdf...

NumPy, or Mitsuba's plugin `measured`, photographs a ball of each material under three lights, with noise. Prints for each error of the setup the
means over materials: the loss, its ratio to that of exact readings at the same directions, and the color error; and how far the circle that was
found is off, in pixels.
"""

import sys
import warnings

import glimpse_brdf as glimpse
import numpy as np

SIDE, RADIUS, CENTER = 192, 80.3, (96.2, 94.7)
# The angles between light and camera, degrees, and the directions of the lights about the camera's axis.
LIGHTS = [(10, 0), (60, 140), (120, 250)]
NOISE = 0.02
SUBPIXELS = 3


def light(angle, azimuth):
    angle, azimuth = np.radians([angle, azimuth])
    return np.array([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)])


def photograph(material, direction):
    """Returns BRDF times cosine of the incoming angle at the pixels of a ball seen from far away, (SIDE, SIDE, 3)."""
    offsets = (np.arange(SUBPIXELS) + 0.5) / SUBPIXELS - 0.5
    columns = (np.arange(SIDE)[:, None] + offsets).ravel()
    right, up = np.meshgrid((columns - CENTER[0]) / RADIUS, (CENTER[1] - columns) / RADIUS)
    square = 1 - right**2 - up**2
    normals = np.stack([right, up, np.sqrt(np.maximum(square, 0))], -1)
    cosine = normals @ direction
    lit = (square > 1e-6) & (cosine > 1e-6)
    normal = normals[lit]
    tangent = np.cross(normal, [0.3, 0.8, -0.5])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], 1)
    pairs = np.stack([frame @ direction, frame[..., 2]], 1)
    image = np.zeros((*lit.shape, 3))
    image[lit] = np.maximum(material(pairs), 0) * cosine[lit, None]
    return image.reshape(SIDE, SUBPIXELS, SIDE, SUBPIXELS, 3).mean((1, 3))


def photograph_by_mitsuba(path, direction):
    """Returns `photograph` of a file of RGL's database, rendered by Mitsuba."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    middle = (SIDE - 1) / 2
    center = [(CENTER[0] - middle) / RADIUS, (middle - CENTER[1]) / RADIUS, 0]
    to_world = mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0])
    side = SIDE / 2 / RADIUS
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "orthographic",
            "to_world": to_world @ mi.ScalarTransform4f().scale([side, side, 1]),
            "film": {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}},
        },
        "lamp": {"type": "directional", "direction": (-direction).tolist(), "irradiance": 1.0},
        "ball": {"type": "sphere", "center": center, "bsdf": {"type": "measured", "filename": path}},
    }
    image = np.array(mi.render(mi.load_dict(scene), spp=4 * SUBPIXELS**2))[..., :3]
    return np.maximum(image, 0)


class Setup:
    """Photographs of a material by a camera of 16 bits, exposed so that the brightest pixel is nearly white."""

    def __init__(self, material, random, photograph=photograph):
        self.lights = np.array([light(*angles) for angles in LIGHTS])
        images = np.array([photograph(material, direction) for direction in self.lights])
        images *= 1 + NOISE * random.normal(size=images.shape)
        intensities = 0.95 / images.max((1, 2, 3))
        self.intensities = np.repeat(intensities[:, None], 3, 1)
        self.pictures = np.round(images * intensities[:, None, None, None] * 65535) / 65535

    def readings(self, **changes):
        arguments = {"pictures": self.pictures, "lights": self.lights, "intensities": self.intensities} | changes
        return glimpse.photo(**arguments)


def tilted(lights, degrees):
    """Turns lights about the picture's vertical axis."""
    sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    return lights @ np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])


def errors(recipe, material, readings):
    """Returns the loss and the color error of a fit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            fit = recipe.fit(readings["brdf"], readings["directions"], noise=readings["noise"])
        except glimpse.ImplausibleError as error:
            fit = error.fit
        (row,) = glimpse.compare(material, [fit])
    return row["loss"], row["delta_e"]


def cases(setup, material):
    """Yields the name and the readings of each case."""
    circle = {}
    try:
        readings = setup.readings()
    except glimpse.GlimpseError:
        # The limb of a mirror is too dark.
        circle = {"circle": (*CENTER, RADIUS)}
        readings = setup.readings(**circle)
    exact = np.maximum(material(readings["directions"]), 0)
    yield "exact readings", readings | {"brdf": exact}
    yield "photographs", readings
    x, y, radius = *CENTER, RADIUS
    yield "circle 1 pixel to the right", setup.readings(circle=(x + 1, y, radius))
    yield "radius 1 pixel larger", setup.readings(circle=(x, y, radius + 1))
    yield "lights 2 degrees off", setup.readings(lights=tilted(setup.lights, 2), **circle)
    exposure = setup.intensities * np.array([[1.05], [1.0], [1.0]])
    yield "one exposure 5 % off", setup.readings(intensities=exposure, **circle)
    yield "all exposures 5 % off", setup.readings(intensities=setup.intensities * 1.05, **circle)


def main(*arguments):
    by_mitsuba = arguments[0] == "--mitsuba"
    recipe, *sources = arguments[by_mitsuba:]
    recipe = glimpse.Recipe.load(recipe)
    rows, circles = {}, []
    pairs = [(source, material) for source in sources for material in glimpse.load_materials(source)]
    for index, (source, material) in enumerate(pairs):
        random = np.random.default_rng(index)
        if by_mitsuba:
            setup = Setup(source, random, photograph_by_mitsuba)
        else:
            setup = Setup(material, random)
        for name, readings in cases(setup, material):
            rows.setdefault(name, []).append(errors(recipe, material, readings))
            if name == "photographs":
                circles.append(np.abs(np.subtract(readings["circle"], (*CENTER, RADIUS))).max())
    exact = np.mean(rows["exact readings"], 0)
    print(f"| {'':28} |   loss | ratio | color error | ratio |\n|{'-' * 30}|-------:|------:|------------:|------:|")
    for name, values in rows.items():
        loss, color = np.mean(values, 0)
        print(f"| {name:28} | {loss:.4f} | {loss / exact[0]:5.2f} | {color:11.2f} | {color / exact[1]:5.2f} |")
    print(f"\nThe circle is off by {np.mean(circles):.2f} pixels, at most {np.max(circles):.2f}, of {len(circles)} materials.")


if __name__ == "__main__":
    main(*sys.argv[1:])
