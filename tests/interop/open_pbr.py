"""The BRDF of MaterialX's node `open_pbr_surface`, from its node graph and MaterialX's formulas of its BSDF nodes.

Each node's value is a number or color; that of a BSDF is the pair of its response, times the light's cosine, and of the share of
light that it passes on. Nodes of an opaque surface without fuzz are evaluated, all others are absent."""
import MaterialX as mx
import numpy as np

ABSENT = (0.0, 1.0)
ALBEDO = np.array([  # a rational fit of the directional albedo: rows of 1, x, y, xy, x2, y2, x2y, xy2, x2y2
    [0.1003, 0.9345, 1.0, 1.0], [-0.6303, -2.323, -1.765, 0.2281], [9.748, 2.229, 8.263, 15.94], [-2.038, -3.748, 11.53, -55.83],
    [29.34, 1.424, 28.96, 13.08], [-8.245, -0.7684, -7.507, 41.26], [-26.44, 1.436, -36.11, 54.9], [19.99, 0.2913, 15.86, 300.2],
    [-5.448, 0.6286, 33.37, -285.1]])
MATH = {
    "power": lambda i: i["in1"] ** i["in2"], "multiply": lambda i: i["in1"] * i["in2"], "add": lambda i: i["in1"] + i["in2"],
    "min": lambda i: np.minimum(i["in1"], i["in2"]), "max": lambda i: np.maximum(i["in1"], i["in2"]),
    "subtract": lambda i: i["in1"] - i["in2"], "divide": lambda i: i["in1"] / i["in2"], "sqrt": lambda i: np.sqrt(i["in"]),
    "sign": lambda i: np.sign(i["in"]), "convert": lambda i: i["in"], "clamp": lambda i: np.clip(i["in"], i["low"], i["high"]),
    "mix": lambda i: i["bg"] + i["mix"] * (i["fg"] - i["bg"]),
    "ifgreater": lambda i: i["in1"] if i["value1"] > i["value2"] else i["in2"],
    "open_pbr_anisotropy": lambda i: i["roughness"] ** 2,
}


def microfacets(at, alpha, fresnel, f0, tint, weight):
    """A layer of microfacets, with the light that is reflected several times. `at` has the cosines of light, sensor, normal and
    half vector, and of light and half vector."""
    light, sensor, half, _ = at
    d = alpha**2 / (np.pi * (half**2 * (alpha**2 - 1) + 1) ** 2)
    smith = [np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2) for cosine in (light, sensor)]
    g = 2 * light * sensor / (smith[0] * sensor + smith[1] * light)
    x, y = sensor, alpha
    r = np.array([1, x, y, x * y, x**2, y**2, x**2 * y, x * y**2, x**2 * y**2]) @ ALBEDO
    a, b = np.clip(r[:2] / r[2:], 0, 1)
    compensation = 1 + fresnel * (1 - a - b) / (a + b)
    return d * fresnel * g * compensation * tint * weight / (4 * sensor), 1 - np.mean((f0 * a + b) * compensation) * weight


def bsdf(kind, i, at):
    light, sensor, _, difference = at
    if kind == "oren_nayar_diffuse_bsdf":
        assert i["roughness"] == 0
        return i["color"] * light / np.pi, 0.0
    if kind == "dielectric_bsdf" and i.get("scatter_mode") == "R" and "thinfilm_thickness" not in i:
        ior, c = i["ior"], difference
        g = np.sqrt(ior**2 + c**2 - 1)
        fresnel = 0.5 * ((g - c) / (g + c)) ** 2 * (1 + (((g + c) * c - 1) / ((g - c) * c + 1)) ** 2)
        return microfacets(at, i["roughness"], fresnel, ((ior - 1) / (ior + 1)) ** 2, i.get("tint", 1.0), i.get("weight", 1.0))
    if kind == "generalized_schlick_bsdf" and "thinfilm_thickness" not in i:
        f0, x, edge = i["color0"], difference, 1 / 7
        lack = (f0 + (1 - f0) * (1 - edge) ** 5) * (1 - i["color82"]) / (edge * (1 - edge) ** 6)
        return microfacets(at, i["roughness"], f0 + (1 - f0) * (1 - x) ** 5 - lack * x * (1 - x) ** 6, f0, 1.0, i["weight"])
    if kind == "layer" and "base" in i:
        (top, passed), (base, _) = i["top"], i["base"]
        return top + passed * base, 0.0
    if kind == "multiply":
        return i["in1"][0] * i["in2"], 0.0
    if kind == "mix":
        return tuple(b + i["mix"] * (f - b) for f, b in zip(i["fg"], i["bg"]))
    return ABSENT


def brdf(document, library, at):
    """The BRDF of the only shader of a document, sr^-1."""
    (shader,) = [node for node in document.getNodes() if node.getCategory() == "open_pbr_surface"]
    definition = library.getNodeDef("ND_open_pbr_surface_surfaceshader")
    graph, known = library.getNodeGraph("NG_open_pbr_surface_surfaceshader"), {}
    number = lambda value: np.array(value.asTuple()) if hasattr(value, "asTuple") else value

    def argument(given):
        if name := given.getNodeName():
            return evaluate(name)
        name = given.getInterfaceName()
        if not name:
            return number(given.getValue())
        own = shader.getInput(name)
        return number((own or definition.getInput(name)).getValue())

    def evaluate(name):
        if name not in known:
            node = graph.getNode(name)
            inputs = {i.getName(): argument(i) for i in node.getInputs() if i.getType() not in ("VDF", "EDF")}
            is_bsdf = node.getType() == "BSDF"
            known[name] = bsdf(node.getCategory(), inputs, at) if is_bsdf else MATH[node.getCategory()](inputs)
        return known[name]

    return evaluate("fuzz_layer")[0] / at[0]
