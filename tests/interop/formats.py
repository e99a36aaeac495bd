"""Checks by other people's programs of what `trainer convert` writes and reads.

    python3 tests/interop/formats.py [TRAINER]

Mitsuba 3, NumPy, scikit-image and Radiance's programs are installed from PyPI into an environment of their own in target/. The programs of
trainer/docs/formats.md run as they stand there; what they write is read by the trainer; and Mitsuba's values
are compared with the trainer's, at grazing angles too, its samples with a sum over all directions, and spheres
by both under the same light. scikit-image finds the same errors of pictures. Radiance makes of PAB-Opto's text a BSDF whose reflectance is compared.
"""
import csv, json, math, os, re, subprocess, sys, tempfile, venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "target" / "interop"
PACKAGES = ["mitsuba==3.9.1", "numpy", "pyradiance==1.3.1", "scikit-image"]


def enter_environment():
    """Goes on in the environment, which is made if it is not there."""
    python = ENVIRONMENT / "bin" / "python"
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    os.execv(python, [str(python), __file__, *sys.argv[1:], "--inside"])


def run(*words):
    """A command's output; the check fails if it does."""
    print("==", *words, flush=True)
    return subprocess.run([str(word) for word in words], check=True, text=True, stdout=subprocess.PIPE).stdout


def loss(printed):
    return float(printed.split()[-1])


def programs_of_the_document(trainer):
    """Every program of the document runs, and what it writes is read."""
    text = (ROOT / "trainer/docs/formats.md").read_text()
    programs = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(programs) == 8, len(programs)
    for program in programs:
        run(sys.executable, "-c", program)
    mirror = Path("mirror.csv")
    mirror.write_text("theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n")
    for name in ("matt.binary", "matt_fc1.npy"):
        row = next(csv.DictReader(run(trainer, "query", name, "--angles", mirror).splitlines()))
        for color, albedo in zip("rgb", (0.8, 0.4, 0.2)):
            assert abs(float(row[color]) * math.pi / albedo - 1) < 1e-5, (name, row)
    run(trainer, "query", "hand_rgb.bsdf", "--angles", mirror)
    row = next(csv.DictReader(run(trainer, "query", "card_30.dat", "--angles", mirror).splitlines()))
    for color in "rgb":
        assert abs(float(row[color]) * math.pi / 0.5 - 1) < 0.1, row


def compare_with_mitsuba(trainer, name, count=20_000):
    """The trainer's reader and Mitsuba agree on a file."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant("scalar_rgb")
    random = np.random.default_rng(1)
    theta = np.arccos(random.uniform(0, 1, (2, count)))
    phi = random.uniform(0, 2 * np.pi, (2, count))
    # A third near the mirror direction; of the rest half with a grazing theta_i or theta_o.
    phi[1, ::3] = phi[0, ::3] + np.pi + random.normal(0, 0.1, len(phi[0, ::3]))
    theta[1, ::3] = np.clip(theta[0, ::3] + random.normal(0, 0.03, len(phi[0, ::3])), 0, 1.569)
    theta[0, 1::6] = np.radians(random.uniform(80, 89.9, len(theta[0, 1::6])))
    theta[1, 4::6] = np.radians(random.uniform(80, 89.9, len(theta[1, 4::6])))
    angles = np.degrees(np.stack([theta[0], phi[0], theta[1], phi[1]], -1))
    np.savetxt("angles.csv", angles, delimiter=",", comments="", header="theta_i,phi_i,theta_o,phi_o", fmt="%.9g")
    run(trainer, "query", name, "--angles", "angles.csv", "--out", "values.csv")
    ours = np.loadtxt("values.csv", delimiter=",", skiprows=1)[:, 4:] * np.cos(theta[1])[:, None]

    vector = lambda t, p: mi.Vector3f(math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t))
    bsdf = mi.load_dict({"type": "measured", "filename": name})
    at, context, theirs = mi.SurfaceInteraction3f(), mi.BSDFContext(), np.empty_like(ours)
    for k in range(count):
        at.wi = vector(theta[0, k], phi[0, k])
        theirs[k] = bsdf.eval(context, at, vector(theta[1, k], phi[1, k]))
    # Mitsuba does not clamp what interpolation leaves below 0.
    theirs = np.maximum(theirs, 0)
    seen = theirs > 1e-4
    error = np.abs(ours / np.where(seen, theirs, 1) - 1)[seen]
    absolute = np.abs(ours - theirs).max()
    print(f"{name}: {seen.sum()} values of BRDF times cosine differ by {np.median(error):.1e}, at most "
          f"{error.max():.1e}; absolutely by {absolute:.1e}, where the largest is {theirs.max():.3g}")
    assert error.max() < 0.01, "the trainer and Mitsuba differ by 1 % and more"

    # What sampling finds is the integral, whatever density it has.
    for degrees in (0, 45, 80):
        at.wi = vector(math.radians(degrees), 0)
        mean = np.mean([
            bsdf.sample(context, at, 0.5, mi.Point2f((k + 0.5) / 4096, (k * 0.6180339887) % 1))[1] for k in range(4096)
        ], 0)
        whole = integral(lambda wo: bsdf.eval(context, at, wo), mi, at.wi)
        print(f"{name}: reflects {whole} at {degrees} degrees, by samples {mean}")
        assert np.allclose(mean, whole, rtol=0.05), "samples do not find the integral"


def write_panorama(name):
    """A sky with two soft suns, fine enough that where a program has the centers of pixels is no matter."""
    import mitsuba as mi
    import numpy as np

    width, height = 2048, 1024
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    latitude = (0.5 - (np.arange(height) + 0.5) / height) * np.pi
    azimuth, latitude = np.meshgrid(azimuth, latitude)
    # Its center is straight ahead of the viewer, who looks along -z.
    direction = np.stack([np.sin(azimuth) * np.cos(latitude), np.sin(latitude), -np.cos(azimuth) * np.cos(latitude)], -1)
    radiance = np.maximum(np.array([0.3, 0.4, 0.5]) + 0.2 * direction[..., 1:2] * np.array([0.2, 0.5, 1]), 0.05)
    for towards, color in (((-0.55, 0.62, 0.56), (6, 5, 4)), ((0.8, 0.1, -0.5), (2, 3, 4))):
        cosine = direction @ (np.array(towards) / np.linalg.norm(towards))
        radiance = radiance + np.exp((cosine - 1) / math.radians(20) ** 2)[..., None] * np.array(color)
    mi.Bitmap(radiance.astype(np.float32)).write(name)


def compare_spheres(trainer, material):
    """A sphere of a file's material, by the trainer and by Mitsuba, under the same light: pixel by pixel."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant("scalar_rgb")
    side, radius = 64, 0.96
    if not Path("sky.exr").exists():
        write_panorama("sky.exr")

    def ours(source):
        run(trainer, "render", "sphere", source, "--environment", "sky.exr", "--size", 4 * side, "--out", "sphere.exr")
        pixels = np.array(mi.Bitmap("sphere.exr"))[..., :3]
        return pixels.reshape(side, 4, side, 4, 3).mean((1, 3))

    def theirs(bsdf):
        world = mi.ScalarTransform4f()
        film = {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
        return np.array(mi.render(mi.load_dict({
            "type": "scene",
            "integrator": {"type": "direct"},
            "sensor": {
                "type": "orthographic",
                "to_world": world.look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0]),
                "film": film,
                "sampler": {"type": "multijitter", "sample_count": 2048},
            },
            "sphere": {"type": "sphere", "radius": radius, "bsdf": bsdf},
            "light": {"type": "envmap", "filename": "sky.exr", "to_world": world.rotate([0, 1, 0], 180)},
        })))

    centers = (np.arange(side) + 0.5) / (side / 2) - 1
    inside = np.hypot(*np.meshgrid(centers, centers)) < radius - 2 / side
    # The trainer chooses exposure by the light; a matt sphere tells what it was.
    matt = theirs({"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.8, 0.4, 0.2]}})
    exposure = np.median((ours("matt.binary") / matt)[inside])
    ours, theirs = ours(material)[inside] / exposure, theirs({"type": "measured", "filename": material})[inside]
    error = np.abs(ours / theirs - 1)
    most = np.quantile(error, 0.98)
    print(f"sphere of {material}: {error.size} values differ by {np.median(error):.1e}, 98 % of them by at most "
          f"{most:.1e}, all by at most {error.max():.1e}; exposure {exposure:.4f}")
    # What is left is the trainer's, which takes light from a file by a rule of some thousand directions.
    assert most < 0.01 and error.max() < 0.02, "spheres by the trainer and by Mitsuba differ"


def compare_picture_errors(trainer):
    """scikit-image finds the errors that the trainer prints, in the PNG file of pairs of spheres, and of `evaluate`."""
    import numpy as np
    from skimage.color import deltaE_ciede2000, rgb2lab
    from skimage.io import imread
    from skimage.metrics import mean_squared_error, peak_signal_noise_ratio, structural_similarity

    run(trainer, "recipes", "get", "neural-n8")
    source = "procedural:3:9"
    evaluated = json.loads(run(trainer, "evaluate", "--recipe", "neural-n8.recipe", "--test", source, "--json"))
    for side in (128, 256):
        printed = run(trainer, "render", "sphere", source, "--recipe", "neural-n8.recipe", "--size", side, "--columns", 1,
                      "--out", "pairs.png").splitlines()[1:]
        sheet = imread("pairs.png")[..., :3]
        centers = np.arange(side) + 0.5 - side / 2
        disc = np.hypot(*np.meshgrid(centers, centers)) <= 0.48 * side
        for index, (line, material) in enumerate(zip(printed, evaluated["materials"], strict=True)):
            top = index * (side + 4)
            one, other = sheet[top:top + side, :side], sheet[top:top + side, side:2 * side]
            expected = (
                (1 - structural_similarity(one, other, channel_axis=2)) / 2,
                mean_squared_error(one / 255, other / 255),
                peak_signal_noise_ratio(one, other),
                deltaE_ciede2000(rgb2lab(one), rgb2lab(other))[disc].mean(),
            )
            print(f"{material['name']} at {side} pixels: DSSIM, L2, PSNR, delta E {np.round(expected, 5)}")
            # As printed: to 4, 6, 2 and 4 digits.
            found = [float(word) for word in line.split()[4:]]
            assert np.allclose(found, expected, rtol=0, atol=(1e-4, 1e-6, 0.01, 1e-4)), (line, expected)
            if side == 128:
                found = [material[name] for name in ("dssim", "l2", "psnr", "delta_e")]
                assert np.allclose(found, expected, rtol=0, atol=(1e-9, 1e-9, 1e-6, 1e-4)), (found, expected)


def integral(of_outgoing, mi, wi, steps=200):
    """Over all directions w_o, by half vectors: they are evenly spread where theta_m is the square of an even step."""
    import numpy as np

    whole = np.zeros(3)
    for u in (np.arange(steps) + 0.5) / steps:
        theta = math.pi / 2 * u * u
        for v in (np.arange(steps) + 0.5) / steps:
            phi = 2 * math.pi * v
            m = mi.Vector3f(math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
            cosine = m.x * wi.x + m.y * wi.y + m.z * wi.z
            if cosine > 0:
                solid_angle = 4 * cosine * 2 * math.pi**2 * u * math.sin(theta)
                whole += np.array(of_outgoing(2 * cosine * m - wi)) * solid_angle
    return whole / steps**2


# Klems' patches: borders of theta in degrees, and how many there are around.
BORDERS = (0, 5, 15, 25, 35, 45, 55, 65, 75, 90)
AROUND = (1, 8, 16, 20, 24, 24, 24, 16, 12)


def read_by_radiance(trainer):
    """Radiance makes of the text a BSDF that reflects as much, and to where a mirror would."""
    import numpy as np
    import pyradiance

    programs = Path(pyradiance.__file__).parent / "bin"
    run(trainer, "convert", "procedural:1:18", "radiance", "--format", "pab")
    with open("radiance.sir", "wb") as file:
        subprocess.run([programs / "pabopto2bsdf", *sorted(Path().glob("radiance_in*.txt"))], check=True, stdout=file)
    # In place of the program that packs matrices as XML, for which the package lacks a template: their text.
    Path("stand-in").mkdir()
    stand_in = Path("stand-in/wrapBSDF")
    stand_in.write_text('#!/bin/sh\nfor file in "$@"; do [ -f "$file" ] && echo "MATRIX" && cat "$file"; done; true\n')
    stand_in.chmod(0o755)
    path = {**os.environ, "PATH": f"{stand_in.parent.resolve()}:{os.environ['PATH']}"}
    text = subprocess.run([programs / "bsdf2klems", "-n", "500", "radiance.sir"], check=True, text=True, env=path,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    luminance = [float(word) for word in text.split("MATRIX")[1].split() if word[0] in "-.0123456789"]
    matrix = np.array(luminance).reshape(145, 145)
    patches = [(k, phi) for k, count in enumerate(AROUND) for phi in range(count)]
    sines = np.sin(np.radians(BORDERS)) ** 2
    projected = np.array([math.pi * (sines[k + 1] - sines[k]) / AROUND[k] for k, _ in patches])

    cosine, phi = (grid.ravel() for grid in np.meshgrid((np.arange(90) + 0.5) / 90, (np.arange(90) + 0.5) * 4))
    for degrees, first in ((20, 9), (40, 45), (60, 93)):
        angles = np.stack([0 * phi + degrees, 0 * phi, np.degrees(np.arccos(cosine)), phi], -1)
        np.savetxt("angles.csv", angles, delimiter=",", comments="", header="theta_i,phi_i,theta_o,phi_o")
        run(trainer, "query", "procedural:1:18", "--angles", "angles.csv", "--out", "values.csv")
        values = np.loadtxt("values.csv", delimiter=",", skiprows=1)[:, 4:] @ (0.2126, 0.7152, 0.0722)
        ours, theirs = (values * cosine).mean() * 2 * math.pi, (matrix[:, first] * projected).sum()
        print(f"reflectance at {degrees} degrees: {ours:.4f}, by Radiance {theirs:.4f}")
        assert abs(theirs / ours - 1) < 0.1, "Radiance finds another reflectance"
        # Klems' patches are numbered so that a mirror's matrix is diagonal; half around is where the light came from.
        back = first + AROUND[patches[first][0]] // 2
        assert matrix[first, first] > 1.2 * matrix[back, first], "Radiance finds the highlight elsewhere"


def main():
    trainer = Path(next((word for word in sys.argv[1:] if word != "--inside"), ROOT / "target/release/trainer")).resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        assert loss(run(trainer, "convert", "procedural:1:3", "made.binary")) < 0.005
        assert loss(run(trainer, "convert", "procedural:1:3", "made_rgb.bsdf")) < 0.001
        assert loss(run(trainer, "convert", "made.binary", "made", "--format", "nbrdf")) < 0.02
        run(trainer, "convert", "procedural:1:3", "made", "--format", "pab")
        programs_of_the_document(trainer)
        compare_picture_errors(trainer)
        read_by_radiance(trainer)
        compare_with_mitsuba(trainer, "made_rgb.bsdf")
        run(trainer, "convert", "made_fc1.npy", "network_rgb.bsdf")
        compare_with_mitsuba(trainer, "network_rgb.bsdf")
        for material in ("made_rgb.bsdf", "network_rgb.bsdf"):
            compare_spheres(trainer, material)
    print("all agree")


if __name__ == "__main__":
    main() if "--inside" in sys.argv else enter_environment()
