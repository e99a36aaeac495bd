"""Checks the parameters of shading models that `trainer convert` writes, and spectral files, with other programs.

    python3 tests/interop/renderers.py [TRAINER]

`tests/run programs` builds the trainer and tests/examples/shading.rs. Mitsuba 3 and MaterialX are installed from PyPI, and Khronos's
validator of glTF from npm, into an environment in target/.

- Mitsuba's `principled` has the BRDF that the trainer computes from the same parameters.
- MaterialX's node graph of OpenPBR has the BRDF that the trainer computes.
- The validators of glTF and MaterialX accept the files.
- In Mitsuba's spectral variant, a spectral file reflects the same light as the RGB file in the other variant.
- In Mitsuba's spectral variant, a material that was fitted in bands has the readings.
- Mitsuba's samples of `measured` have the values and densities that it evaluates at their directions.
"""
import json, math, os, sys, tempfile
from pathlib import Path

from environment import ENVIRONMENT, ROOT, enter_environment, run

PACKAGES = ["mitsuba==3.9.1", "MaterialX==1.39.5", "numpy"]
MATERIALS = ["procedural:1:5", "procedural:1:12", "procedural:1:18"]
VALIDATE = """
const validator = require(process.argv[1]);
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[2]));
validator.validateBytes(bytes).then(report => console.log(JSON.stringify(report.issues)));
"""


def random_pairs(count, seed=1):
    """Pairs of directions in degrees, a third of them near the mirror direction."""
    import numpy as np

    random = np.random.default_rng(seed)
    theta = np.arccos(random.uniform(0.05, 1, (2, count)))
    phi = random.uniform(0, 2 * np.pi, (2, count))
    phi[1, ::3] = phi[0, ::3] + np.pi + random.normal(0, 0.1, len(phi[0, ::3]))
    theta[1, ::3] = np.clip(theta[0, ::3] + random.normal(0, 0.1, len(phi[0, ::3])), 0, 1.5)
    return theta, phi


def vector(mi, theta, phi):
    return mi.Vector3f(math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))


def evaluate(mi, bsdf, theta, phi):
    import numpy as np

    at, context, values = mi.SurfaceInteraction3f(), mi.BSDFContext(), []
    for k in range(theta.shape[1]):
        at.wi = vector(mi, theta[0, k], phi[0, k])
        values.append(list(bsdf.eval(context, at, vector(mi, theta[1, k], phi[1, k]))))
    return np.array(values)


def compare_principled(example, material):
    """Compares Mitsuba's BSDF with the trainer's own, at 1,000 pairs of directions."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant("scalar_rgb")
    theta, phi = random_pairs(1000)
    angles = np.degrees(np.stack([theta[0], phi[0], theta[1], phi[1]], -1))
    np.savetxt("angles.csv", angles, delimiter=",", fmt="%.9g")
    for share in ("fitted", 0.2, 0.4, 0.9):
        parameters = json.loads(run(example, "principled", material, "angles.csv", "ours.csv", *([] if share == "fitted" else [share])))
        ours = np.loadtxt("ours.csv", delimiter=",") * np.cos(theta[1])[:, None]
        theirs = evaluate(mi, mi.load_dict(parameters), theta, phi)
        error = np.abs(ours / theirs - 1)
        print(f"principled of {material}, parameters {share}: relative errors: median {np.median(error):.1e}, "
              f"largest {error.max():.1e}")
        assert np.median(error) < 1e-3 and error.max() < 0.01, "the trainer and Mitsuba differ"


def validate_gltf(trainer, material):
    run(trainer, "convert", material, "material.gltf", "--force")
    prefix = ENVIRONMENT / "npm"
    if not (prefix / "node_modules/gltf-validator").exists():
        run("npm", "install", "--silent", "--prefix", prefix, "gltf-validator@2.0.0-dev.3.10")
    issues = json.loads(run("node", "-e", VALIDATE, prefix / "node_modules/gltf-validator", "material.gltf"))
    print(f"glTF of {material}: {issues['numErrors']} errors, {issues['numWarnings']} warnings")
    assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"]


def validate_materialx(trainer, material):
    import MaterialX as mx

    run(trainer, "convert", material, "material.mtlx", "--force")
    document, library = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(document, "material.mtlx")
    document.setDataLibrary(library)
    valid, message = document.validate()
    assert valid, message
    (node,) = document.getMaterialNodes()
    (shader,) = mx.getShaderNodes(node)
    assert shader.getNodeDef().getName() == "ND_open_pbr_surface_surfaceshader", shader.getNodeDef()
    print(f"MaterialX of {material}: valid, {len(shader.getInputs())} inputs")


def compare_open_pbr(example, material):
    """Compares MaterialX's node graph with the trainer's own BRDF, at 300 pairs of directions."""
    import MaterialX as mx
    import numpy as np
    from open_pbr import brdf

    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    theta, phi = random_pairs(300)
    angles = np.degrees(np.stack([theta[0], phi[0], theta[1], phi[1]], -1))
    np.savetxt("angles.csv", angles, delimiter=",", fmt="%.9g")
    light, sensor = np.moveaxis(np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1), 0, 0)
    half = (light + sensor) / np.linalg.norm(light + sensor, axis=1, keepdims=True)
    at = np.stack([light[:, 2], sensor[:, 2], half[:, 2], (light * half).sum(1)], -1)
    for share in ("fitted", 0.2, 0.4, 0.9):
        document = mx.createDocument()
        text = run(example, "openpbr", material, "angles.csv", "ours.csv", *([] if share == "fitted" else [share]))
        mx.readFromXmlString(document, text)
        ours = np.loadtxt("ours.csv", delimiter=",")
        theirs = np.array([brdf(document, library, cosines) for cosines in at])
        error = np.abs(ours / theirs - 1)
        print(f"OpenPBR of {material}, parameters {share}: relative errors: median {np.median(error):.1e}, "
              f"largest {error.max():.1e}")
        # Both approximate the albedo of microfacets.
        assert np.median(error) < 0.01 and error.max() < 0.05, "the trainer and MaterialX differ"


def compare_spectra(trainer, material):
    """Compares the spectral file, under D65, with the RGB file."""
    import mitsuba as mi
    import numpy as np

    for name in ("m_rgb.bsdf", "m_spec.bsdf"):
        run(trainer, "convert", material, name, "--force")
    loss = float(run(trainer, "convert", "m_spec.bsdf", "again.binary", "--force").split()[-1])
    theta, phi = random_pairs(100)
    mi.set_variant("scalar_rgb")
    rgb = evaluate(mi, mi.load_dict({"type": "measured", "filename": "m_rgb.bsdf"}), theta, phi)
    mi.set_variant("scalar_spectral")
    bsdf, light = mi.load_dict({"type": "measured", "filename": "m_spec.bsdf"}), mi.load_dict({"type": "d65"})
    at, context = mi.SurfaceInteraction3f(), mi.BSDFContext()
    wavelengths = np.arange(360, 831, 5.0)
    sums, white = np.zeros((theta.shape[1], 3)), 0.0
    for first in range(0, len(wavelengths), 4):
        some = np.resize(wavelengths[first:first + 4], 4)
        weight = np.where(np.arange(4) < len(wavelengths) - first, 1.0, 0.0)
        at.wavelengths = type(at.wavelengths)(*some)
        power = np.array(list(light.eval(at))) * weight
        matching = np.array([list(mi.cie1931_xyz(float(nm))) for nm in some])
        white += power @ matching[:, 1]
        for k in range(theta.shape[1]):
            at.wi = vector(mi, theta[0, k], phi[0, k])
            spectrum = np.array(list(bsdf.eval(context, at, vector(mi, theta[1, k], phi[1, k]))))
            sums[k] += (power * spectrum) @ matching
    to_rgb = np.array([[3.240970, -1.537383, -0.498611], [-0.969244, 1.875968, 0.041555], [0.055630, -0.203977, 1.056972]])
    error = np.abs(sums / white @ to_rgb.T - rgb).max(1) / rgb.max(1)
    print(f"spectra of {material}: relative errors: median {np.median(error):.1e}, largest {error.max():.1e}; "
          f"loss {loss} after MERL's table")
    assert loss < 0.005 and np.median(error) < 0.01 and error.max() < 0.05, "the spectral file has other colors"


def compare_bands(trainer, material):
    """Fits a material's reflectance factors in 31 bands at six aspecular angles. Mitsuba's spectral variant has them."""
    import mitsuba as mi
    import numpy as np

    angles = np.array([[45, 60], [45, 30], [45, 20], [45, 0], [45, -30], [45, -65]])
    np.savetxt("angles.csv", angles, delimiter=",", comments="", header="theta_i,theta_o")
    run(trainer, "query", material, "--angles", "angles.csv", "--out", "values.csv", "--force")
    rgb = np.loadtxt("values.csv", delimiter=",", skiprows=1)[:, -3:]
    wavelengths = np.arange(400, 701, 10.0)
    mix = np.exp(-(((wavelengths - np.array([620, 540, 450])[:, None]) / 60) ** 2))
    readings = rgb @ (mix / mix.sum(0))
    header = "theta_i,theta_o," + ",".join(f"{nm:g}nm" for nm in wavelengths)
    np.savetxt("bands.csv", np.hstack([angles, 100 * np.pi * readings]), delimiter=",", comments="", header=header)
    report = json.loads(run(trainer, "fit", "--measurements", "bands.csv", "--quantity", "reflectance-percent", "--format",
                            "rgl-spectral", "--out", "bands", "--json"))
    mi.set_variant("scalar_spectral")
    bsdf, at = mi.load_dict({"type": "measured", "filename": "bands/formats/bands_spec.bsdf"}), mi.SurfaceInteraction3f()
    errors = np.empty_like(readings)
    for row, (theta_i, theta_o) in enumerate(np.radians(angles)):
        at.wi, wo = vector(mi, theta_i, math.pi), vector(mi, theta_o, 0)
        for band, nm in enumerate(wavelengths):
            at.wavelengths = type(at.wavelengths)(nm)
            value = bsdf.eval(mi.BSDFContext(), at, wo)[0] / math.cos(theta_o)
            errors[row, band] = value / readings[row, band] - 1
    delta_e = [reading["delta_e"] for reading in report[0]["spectrum"]["readings"]]
    print(f"{material} in 31 bands: errors in Mitsuba: mean {np.abs(errors).mean():.3f}, largest {np.abs(errors).max():.3f}; "
          f"CIEDE2000 of the fit {max(delta_e):.2f}")
    assert np.abs(errors).mean() < 0.02 and np.abs(errors).max() < 0.1 and max(delta_e) < 1, "other spectra"


def check_samples(trainer, material, count=10_000):
    """Weight times density is the value at the sampled direction, or at that direction turned by 180 degrees: Mitsuba
    does not initialize a member that flips x and y of samples of isotropic files (mitsuba3, pull request 1850)."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant("scalar_rgb")
    run(trainer, "convert", material, "m_rgb.bsdf", "--force")
    bsdf = mi.load_dict({"type": "measured", "filename": "m_rgb.bsdf"})
    random, at, context = np.random.default_rng(2), mi.SurfaceInteraction3f(), mi.BSDFContext()
    errors = {1: [], -1: []}
    for _ in range(count):
        at.wi = vector(mi, math.acos(random.uniform(0.1, 1)), random.uniform(0, 2 * math.pi))
        sample, weight = bsdf.sample(context, at, random.random(), mi.Point2f(*random.random(2)))
        if sample.pdf <= 0:
            continue
        value = np.array(list(weight)) * sample.pdf
        for sign, list_of_errors in errors.items():
            wo = mi.Vector3f(sign * sample.wo.x, sign * sample.wo.y, sample.wo.z)
            difference = np.abs(np.array(list(bsdf.eval(context, at, wo))) - value).max() / max(value.max(), 1e-6)
            list_of_errors.append(max(difference, abs(bsdf.pdf(context, at, wo) / sample.pdf - 1)))
    quantiles = {sign: np.quantile(list_of_errors, 0.99) for sign, list_of_errors in errors.items()}
    print(f"samples of {material}: {len(errors[1])} of {count}, 99 % of errors below {min(quantiles.values()):.1e}")
    assert len(errors[1]) > 0.9 * count and min(quantiles.values()) < 1e-3, quantiles


def main():
    enter_environment(PACKAGES)
    trainer = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/trainer").resolve()
    example = trainer.parent / "examples/shading"
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for material in MATERIALS:
            compare_principled(example, material)
            validate_gltf(trainer, material)
            validate_materialx(trainer, material)
            compare_open_pbr(example, material)
            check_samples(trainer, material)
        compare_spectra(trainer, MATERIALS[2])
        compare_bands(trainer, MATERIALS[1])


main()
