"""Numbers of gloss meters and spheres, by Monte Carlo integrals over the geometry of their standards."""

import glimpse_brdf as glimpse
import numpy as np
import pytest

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# The full angles of a gloss meter's receptor, in the plane of incidence and across it; those of its source (ISO 2813).
RECEPTORS = {20: (1.8, 3.6), 60: (4.4, 11.7), 85: (4.0, 6.0)}
SOURCE = (0.75, 2.5)
COUNT = 60_000


def around(theta, along, across):
    """Unit vectors at two angles from the direction with the signed polar angle theta, in radians."""
    theta = theta + along
    return np.stack([np.cos(across) * np.sin(theta), np.sin(across), np.cos(across) * np.cos(theta)], -1)


def fresnel(cosine, index=1.567):
    inside = np.sqrt(1 - (1 - cosine**2) / index**2)
    across, along = [(a * cosine - b * inside) / (a * cosine + b * inside) for a, b in ((1, index), (index, 1))]
    return (across**2 + along**2) / 2


def gloss(material, degrees, random):
    """Gloss units: the flux in the receptor relative to that of black glass, for light of all points of the source."""
    theta, receptor, source = np.radians(degrees), *np.radians([RECEPTORS[degrees], SOURCE])
    light = around(theta, *(source[:, None] * random.uniform(-0.5, 0.5, (2, COUNT))))
    along, across = receptor[:, None] * random.uniform(-0.5, 0.5, (2, COUNT))
    sensor = around(-theta, along, across)
    flux = material(light, sensor) @ LUMINANCE * sensor[:, 2] * np.cos(across) * np.prod(receptor)
    return 100 * flux.mean() / fresnel(np.cos(theta))


def sphere(material, trap, random):
    """Percent: the flux of light at 8 degrees in all directions but those within an angle of the mirror direction, relative
    to that of a perfect diffuser. Half of the directions are drawn around the mirror direction."""
    mirror = around(np.radians(-8), 0, 0)
    light = np.broadcast_to(around(np.radians(8), 0, 0), (COUNT, 3))
    radius, phi = np.sqrt(random.uniform(size=COUNT)), random.uniform(0, 2 * np.pi, COUNT)
    diffuse = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - radius**2)], -1)
    cosine = random.uniform(size=COUNT) ** (1 / 101)
    sine = np.sqrt(1 - cosine**2)
    tangent = np.array([mirror[2], 0, -mirror[0]])
    near = cosine[:, None] * mirror + (sine * np.cos(phi))[:, None] * tangent + np.outer(sine * np.sin(phi), [0, 1, 0])
    sensor = np.where((random.uniform(size=COUNT) < 0.5)[:, None], diffuse, near)
    above = np.maximum(sensor[:, 2], 1e-3)
    density = 0.5 * above / np.pi + 0.5 * 101 / (2 * np.pi) * np.clip(sensor @ mirror, 0, 1) ** 100
    weight = above / density * (sensor[:, 2] > 1e-3) * (sensor @ mirror < np.cos(np.radians(trap)) + 1e-12 * (trap == 0))
    sensor[:, 2] = above
    sensor /= np.linalg.norm(sensor, axis=1, keepdims=True)
    return 100 * np.pi * (material(light, sensor) * weight[:, None]).mean(0) / weight.mean()


def displays(material):
    random = np.random.default_rng(3)
    return {
        **{f"gloss-{degrees}": [gloss(material, degrees, random)] * 3 for degrees in RECEPTORS},
        **{name: sphere(material, trap, random) for name, trap in (("sci", 0), ("sce", 5))},
    }


def lambert(light, sensor):
    return np.full((len(light), 3), 0.5 / np.pi)


def black_glass(light, sensor, alpha=0.05):
    """Polished black glass with a narrow lobe (GGX)."""
    half = light + sensor
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    normals = alpha**2 / np.pi / (half[:, 2] ** 2 * (alpha**2 - 1) + 1) ** 2
    masking = [2 * c / (c + np.sqrt(alpha**2 + (1 - alpha**2) * c**2)) for c in (light[:, 2], sensor[:, 2])]
    value = fresnel((light * half).sum(1)) * normals * np.prod(masking, 0) / (4 * light[:, 2] * sensor[:, 2])
    return np.repeat(value[:, None], 3, 1)


@pytest.mark.parametrize("material", [lambert, black_glass, *glimpse.load_materials("procedural:3:5")])
def test_fit_shows_the_same_numbers(material):
    """The fit to the displays has the same displays, integrated here."""
    shown = displays(material)
    fit = glimpse.Recipe.load("linear-any").fit(
        np.array(list(shown.values())), instrument=list(shown), noise=0.001, keep_all=True
    )
    for name, number in displays(fit).items():
        resolution = 0.1 if name.startswith("gloss") else 0.02
        np.testing.assert_allclose(number, shown[name], rtol=0.015, atol=resolution, err_msg=name)
