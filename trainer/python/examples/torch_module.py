"""A fit of the model neural as a `torch.nn.Module`: differentiable in its weights and in the directions.

    brdf = NeuralBrdf(recipe.fit(readings))
    brdf(directions)                    # (..., 2, 3) to (..., 3): the BRDF in linear RGB, sr^-1, not times the cosine

As a script it fits a material, compares the module with the fit and its gradient with differences, and descends from the
fit of one material to another one.
"""

import torch

import glimpse_brdf as glimpse


def half_difference(directions):
    """Half vector (x, 0, z) and difference vector, (..., 6), of pairs of unit directions, (..., 2, 3)."""
    incoming, outgoing = directions.unbind(-2)
    hx, hy, hz = torch.nn.functional.normalize(incoming + outgoing, dim=-1).unbind(-1)
    # At the normal, the half vector has no azimuth: the azimuth of the light replaces it, so that phi_d is 0.
    is_normal = (torch.hypot(hx, hy) < 3e-4).unsqueeze(-1)
    azimuth = torch.where(is_normal, incoming[..., :2], torch.stack([hx, hy], -1))
    cosine, sine = torch.nn.functional.normalize(azimuth, dim=-1).unbind(-1)
    hx = cosine * hx + sine * hy
    x, y, z = incoming.unbind(-1)
    turned = cosine * x + sine * y
    difference = [turned * hz - z * hx, cosine * y - sine * x, turned * hx + z * hz]
    return torch.stack([hx, torch.zeros_like(hx), hz, *difference], -1)


class NeuralBrdf(torch.nn.Module):
    """The network 6-21-21-3 of Sztrajman et al. (2021), with the weights of a fit."""

    def __init__(self, fitted):
        super().__init__()
        if fitted.model != "neural":
            raise ValueError(f"the fit has the model {fitted.model}: fit with a recipe of neural")
        sizes = [6, 21, 21, 3]
        self.layers = torch.nn.ModuleList(map(torch.nn.Linear, sizes[:-1], sizes[1:]))
        # Glimpse has inputs by outputs, torch outputs by inputs.
        lengths = [length for layer in self.layers for length in (layer.weight.numel(), layer.bias.numel())]
        lists = torch.tensor(fitted.parameters.tolist()).split(lengths)
        with torch.no_grad():
            for layer, weights, bias in zip(self.layers, lists[::2], lists[1::2]):
                layer.weight.copy_(weights.view(layer.in_features, layer.out_features).T)
                layer.bias.copy_(bias)

    def forward(self, directions):
        units = half_difference(directions)
        for layer in self.layers[:-1]:
            units = layer(units).relu()
        return self.layers[-1](units).expm1().relu()


def main():
    recipe = glimpse.Recipe.load("neural-n8")
    material, other = (glimpse.load_material(f"procedural:1:{seed}") for seed in (77, 78))
    fitted = recipe.fit(material(recipe.directions))
    brdf = NeuralBrdf(fitted)
    pairs = glimpse.directions()[::400]
    # Light and sensor at mirrored angles, and both at the normal.
    pairs[0], pairs[1] = glimpse.directions_from_degrees(30, 0, 30, 180), [[0, 0, 1], [0, 0, 1]]
    directions = torch.tensor(pairs.tolist(), requires_grad=True)

    error = (brdf(directions) - torch.tensor(fitted(pairs).tolist())).abs().max().item()
    print(f"largest difference of the module from the fit: {error:.1e} sr^-1")
    assert error < 1e-3

    # In double precision, where differences are accurate.
    brdf.double()
    exact = directions.detach().double()[:8].requires_grad_()
    assert torch.autograd.gradcheck(brdf, exact, eps=1e-7, atol=1e-3, rtol=1e-3)
    brdf.float()

    cosine = directions.detach()[:, 0, 2:]
    target = torch.log1p(torch.tensor(other(pairs).tolist()) * cosine)
    optimizer = torch.optim.Adam(brdf.parameters(), 3e-3)
    losses = []
    for _ in range(500):
        optimizer.zero_grad()
        loss = (torch.log1p(brdf(directions.detach()) * cosine) - target).abs().mean()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    print(f"loss on the other material: {losses[0]:.4f}, and {losses[-1]:.4f} after {len(losses)} steps")
    assert losses[-1] < 0.3 * losses[0]


if __name__ == "__main__":
    main()
