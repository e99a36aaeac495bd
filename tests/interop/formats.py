"""Checks the files that `trainer convert` writes and reads with other programs.

    python3 tests/interop/formats.py [TRAINER]

Mitsuba 3, NumPy, scikit-image and Radiance's programs are installed from PyPI into an environment in target/.

- The trainer reads files of every format that NumPy writes by trainer/docs/formats.md.
- Mitsuba and the trainer agree on values, at grazing angles too.
- Mitsuba's importance sampling agrees with a sum over all directions.
- scikit-image computes the same picture errors.
- Radiance converts PAB-Opto's text to a BSDF with the same reflectance.
"""
import csv, json, math, os, struct, subprocess, sys, tempfile
from pathlib import Path

from environment import ROOT, enter_environment, run

PACKAGES = ["mitsuba==3.9.1", "numpy", "pyradiance==1.3.1", "scikit-image"]


def printed_loss(output):
    return float(output.split()[-1])


def write_by_hand():
    """Writes a MERL table and a network of a matt material, an RGL file whose M is 1 and D cos(theta_m) / pi, and pab files of
    a matt gray of albedo 0.5, by the formats of trainer/docs/formats.md."""
    import numpy as np

    table = np.empty((3, 90, 90, 180))
    scale = np.array([1, 1.15, 1.66]) / 1500
    albedo = np.array([0.8, 0.4, 0.2])        # a matt material: BRDF albedo / pi
    table[:] = (albedo / np.pi / scale)[:, None, None, None]
    with open("matt.binary", "wb") as file:
        np.array([90, 90, 180], "<i4").tofile(file)
        table.astype("<f8").tofile(file)

    weights = {"fc1": np.zeros((6, 21)), "b1": np.zeros(21), "fc2": np.zeros((21, 21)),
               "b2": np.zeros(21), "fc3": np.zeros((21, 3))}
    weights["b3"] = np.log(1 + np.array([0.8, 0.4, 0.2]) / np.pi)    # a matt material
    for name, array in weights.items():
        np.save(f"matt_{name}.npy", array.astype("<f4"))

    f, u = np.float32, np.linspace(0, 1, 64)
    fields = {"description": np.frombuffer(b"by hand", "u1"), "phi_i": f([0]), "theta_i": f([0, 1.5]),
              "ndf": f([np.cos(np.pi / 2 * u**2) / np.pi] * 2), "sigma": np.ones((2, 2), f), "vndf": np.ones((1, 2, 2, 2), f),
              "luminance": np.ones((1, 2, 2, 2), f), "rgb": np.ones((1, 2, 3, 2, 2), f), "jacobian": np.ones(1, "u1")}
    begin = 18 + sum(13 + len(name) + 8 * a.ndim for name, a in fields.items())
    header = b"tensor_file\0\1\0" + struct.pack("<I", len(fields))
    for name, a in fields.items():
        header += struct.pack("<H", len(name)) + name.encode() + struct.pack("<HBQ", a.ndim, 10 if a.dtype == f else 1, begin)
        header, begin = header + struct.pack(f"<{a.ndim}Q", *a.shape), begin + a.nbytes
    Path("hand_rgb.bsdf").write_bytes(header + b"".join(a.tobytes() for a in fields.values()))

    theta, phi = (grid.ravel() for grid in np.meshgrid(np.arange(0, 90, 3.0), np.arange(0, 360, 5.0)))
    for theta_i in (0, 30, 60, 80):
        with open(f"card_{theta_i}.dat", "w") as file:
            file.write('#sample_name "card"\n#colorimetry: CIE-Y\n#format: theta phi BRDF\n')
            file.write(f"#intheta {theta_i}\n#inphi 0\n#upphi 0\n")
            np.savetxt(file, np.stack([theta, phi, 0.5 / np.pi + 0 * theta], -1), fmt="%.4g")


def read_files_by_hand(trainer):
    """Reads these files with the trainer."""
    write_by_hand()
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
    """Compares the values of a file in the trainer and in Mitsuba."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant("scalar_rgb")
    random = np.random.default_rng(1)
    theta = np.arccos(random.uniform(0, 1, (2, count)))
    phi = random.uniform(0, 2 * np.pi, (2, count))
    # A third of the directions are near the mirror direction. Half of the others have a grazing theta_i or theta_o.
    phi[1, ::3] = phi[0, ::3] + np.pi + random.normal(0, 0.1, len(phi[0, ::3]))
    theta[1, ::3] = np.clip(theta[0, ::3] + random.normal(0, 0.03, len(phi[0, ::3])), 0, 1.569)
    theta[0, 1::6] = np.radians(random.uniform(80, 89.9, len(theta[0, 1::6])))
    theta[1, 4::6] = np.radians(random.uniform(80, 89.9, len(theta[1, 4::6])))
    angles = np.degrees(np.stack([theta[0], phi[0], theta[1], phi[1]], -1))
    np.savetxt("angles.csv", angles, delimiter=",", comments="", header="theta_i,phi_i,theta_o,phi_o", fmt="%.9g")
    run(trainer, "query", name, "--angles", "angles.csv", "--out", "values.csv", "--force")
    ours = np.loadtxt("values.csv", delimiter=",", skiprows=1)[:, 4:] * np.cos(theta[1])[:, None]

    vector = lambda t, p: mi.Vector3f(math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t))
    bsdf = mi.load_dict({"type": "measured", "filename": name})
    at, context, theirs = mi.SurfaceInteraction3f(), mi.BSDFContext(), np.empty_like(ours)
    for k in range(count):
        at.wi = vector(theta[0, k], phi[0, k])
        theirs[k] = bsdf.eval(context, at, vector(theta[1, k], phi[1, k]))
    # Mitsuba does not clamp interpolated values below 0.
    theirs = np.maximum(theirs, 0)
    compared = theirs > 1e-4
    error = np.abs(ours / np.where(compared, theirs, 1) - 1)[compared]
    absolute = np.abs(ours - theirs).max()
    print(f"{name}: {compared.sum()} values of BRDF times cosine; relative errors: median {np.median(error):.1e}, "
          f"largest {error.max():.1e}; largest absolute error {absolute:.1e}, largest value {theirs.max():.3g}")
    assert error.max() < 0.01, "the trainer and Mitsuba differ by 1 % or more"

    # The mean of the samples' weights is the integral, for any sampling density.
    for degrees in (0, 45, 80):
        at.wi = vector(math.radians(degrees), 0)
        mean = np.mean([
            bsdf.sample(context, at, 0.5, mi.Point2f((k + 0.5) / 4096, (k * 0.6180339887) % 1))[1] for k in range(4096)
        ], 0)
        expected = integral(lambda wo: bsdf.eval(context, at, wo), mi, at.wi)
        print(f"{name}: reflectance {expected} at {degrees} degrees, {mean} from samples")
        assert np.allclose(mean, expected, rtol=0.05), "the samples' mean is not the integral"


def compare_picture_errors(trainer):
    """Compares picture errors by scikit-image with those of the trainer, for spheres in a PNG file."""
    import numpy as np
    from skimage.color import deltaE_ciede2000, rgb2lab
    from skimage.io import imread
    from skimage.metrics import mean_squared_error, peak_signal_noise_ratio, structural_similarity

    materials, side = "procedural:3:9", 128
    compared = json.loads(run(trainer, "compare", "procedural:1:9", materials, "--json"))["materials"]
    run(trainer, "render", "sphere", materials, "--size", side, "--columns", 1, "--out", "spheres.png")
    sheet = imread("spheres.png")[..., :3]
    spheres = [sheet[top:top + side, :side] for top in range(0, 3 * side, side + 4)]
    centers = np.arange(side) + 0.5 - side / 2
    disc = np.hypot(*np.meshgrid(centers, centers)) <= 0.48 * side
    # The first material is the reference.
    for sphere, material in zip(spheres[1:], compared[1:], strict=True):
        expected = (
            (1 - structural_similarity(spheres[0], sphere, channel_axis=2)) / 2,
            mean_squared_error(spheres[0] / 255, sphere / 255),
            peak_signal_noise_ratio(spheres[0], sphere),
            deltaE_ciede2000(rgb2lab(spheres[0]), rgb2lab(sphere))[disc].mean(),
        )
        print(f"{material['material']}: DSSIM, L2, PSNR, delta E {np.round(expected, 5)}")
        reported = [material[name] for name in ("dssim", "l2", "psnr", "delta_e")]
        assert np.allclose(reported, expected, rtol=0, atol=(1e-9, 1e-9, 1e-6, 1e-4)), (reported, expected)


def integral(of_outgoing, mi, wi, steps=200):
    """Integrates over all directions w_o, with half vectors at theta_m = pi/2 u^2 for equidistant u."""
    import numpy as np

    total = np.zeros(3)
    for u in (np.arange(steps) + 0.5) / steps:
        theta = math.pi / 2 * u * u
        for v in (np.arange(steps) + 0.5) / steps:
            phi = 2 * math.pi * v
            m = mi.Vector3f(math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
            cosine = m.x * wi.x + m.y * wi.y + m.z * wi.z
            if cosine > 0:
                solid_angle = 4 * cosine * 2 * math.pi**2 * u * math.sin(theta)
                total += np.array(of_outgoing(2 * cosine * m - wi)) * solid_angle
    return total / steps**2


# Klems patches: boundaries of theta in degrees, and the number of patches in each ring.
BOUNDARIES = (0, 5, 15, 25, 35, 45, 55, 65, 75, 90)
PATCHES = (1, 8, 16, 20, 24, 24, 24, 16, 12)


def compare_with_radiance(trainer):
    """Compares the reflectance and the mirror direction with those of the BSDF that Radiance makes of the text."""
    import numpy as np
    import pyradiance

    programs = Path(pyradiance.__file__).parent / "bin"
    run(trainer, "convert", "procedural:1:18", "radiance", "--format", "pab")
    with open("radiance.sir", "wb") as file:
        subprocess.run([programs / "pabopto2bsdf", *sorted(Path().glob("radiance_in*.txt"))], check=True, stdout=file)
    # Replaces the program that packs matrices as XML, because the package lacks its template: it prints their text.
    Path("replacement").mkdir()
    replacement = Path("replacement/wrapBSDF")
    replacement.write_text('#!/bin/sh\nfor file in "$@"; do [ -f "$file" ] && echo "MATRIX" && cat "$file"; done; true\n')
    replacement.chmod(0o755)
    path = {**os.environ, "PATH": f"{replacement.parent.resolve()}:{os.environ['PATH']}"}
    text = subprocess.run([programs / "bsdf2klems", "-n", "500", "radiance.sir"], check=True, text=True, env=path,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    luminance = [float(word) for word in text.split("MATRIX")[1].split() if word[0] in "-.0123456789"]
    matrix = np.array(luminance).reshape(145, 145)
    patches = [(k, phi) for k, count in enumerate(PATCHES) for phi in range(count)]
    sines = np.sin(np.radians(BOUNDARIES)) ** 2
    projected = np.array([math.pi * (sines[k + 1] - sines[k]) / PATCHES[k] for k, _ in patches])

    cosine, phi = (grid.ravel() for grid in np.meshgrid((np.arange(90) + 0.5) / 90, (np.arange(90) + 0.5) * 4))
    for degrees, first in ((20, 9), (40, 45), (60, 93)):
        angles = np.stack([0 * phi + degrees, 0 * phi, np.degrees(np.arccos(cosine)), phi], -1)
        np.savetxt("angles.csv", angles, delimiter=",", comments="", header="theta_i,phi_i,theta_o,phi_o")
        run(trainer, "query", "procedural:1:18", "--angles", "angles.csv", "--out", "values.csv", "--force")
        values = np.loadtxt("values.csv", delimiter=",", skiprows=1)[:, 4:] @ (0.2126, 0.7152, 0.0722)
        ours, theirs = (values * cosine).mean() * 2 * math.pi, (matrix[:, first] * projected).sum()
        print(f"reflectance at {degrees} degrees: {ours:.4f}, {theirs:.4f} in Radiance")
        assert abs(theirs / ours - 1) < 0.1, "Radiance computes another reflectance"
        # The numbers of Klems patches make a mirror's matrix diagonal. Half a ring further is the light's direction.
        back = first + PATCHES[patches[first][0]] // 2
        assert matrix[first, first] > 1.2 * matrix[back, first], "Radiance has the highlight in another direction"


def main():
    enter_environment(PACKAGES)
    trainer = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/trainer").resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        assert printed_loss(run(trainer, "convert", "procedural:1:5", "material.binary")) < 0.005
        assert printed_loss(run(trainer, "convert", "procedural:1:5", "material_rgb.bsdf")) < 0.001
        assert printed_loss(run(trainer, "convert", "material.binary", "material", "--format", "nbrdf")) < 0.02
        read_files_by_hand(trainer)
        compare_picture_errors(trainer)
        compare_with_radiance(trainer)
        compare_with_mitsuba(trainer, "material_rgb.bsdf")
        run(trainer, "convert", "material_fc1.npy", "network_rgb.bsdf")
        compare_with_mitsuba(trainer, "network_rgb.bsdf")
    print("all programs agree with the trainer")


main()
