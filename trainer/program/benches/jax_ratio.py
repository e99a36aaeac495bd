"""Times the outer steps of `trainer bench --model neural` against the same work in jitted JAX.

    python3 trainer/program/benches/jax_ratio.py [TRAINER]

Needs `pip install jax`. Both compute the loss after 20 steps of the inner loop, and its gradient with respect to the initial
parameters and step sizes (fresh samples in each step), or to the readings and inputs of a pattern. Runs five pairs in turn, and prints
a table with the medians in milliseconds and the median of the pairs' ratios.
"""
import json, statistics, subprocess, sys, time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

STEPS, PAIRS, SECONDS = 20, 5, 1.0
SHAPES = [(6, 21), (21,), (21, 21), (21,), (21, 3), (3,)]
# The end of the name that `trainer bench` prints, the samples of a step, the samples of the loss.
WORKS = [("512 fresh samples, outer 512", 512, 512), ("a pattern of 8, outer 512", 8, 512),
         ("a pattern of 8, outer 25,000", 8, 25_000)]


def brdf(parameters, inputs):
    first, first_bias, second, second_bias, last, last_bias = parameters
    hidden = jax.nn.relu(inputs @ first + first_bias)
    hidden = jax.nn.relu(hidden @ second + second_bias)
    return jax.nn.relu(jnp.exp(hidden @ last + last_bias) - 1)


def loss(parameters, inputs, values, cosines):
    return jnp.abs(jnp.log1p(values * cosines) - jnp.log1p(brdf(parameters, inputs) * cosines)).mean()


def descend(parameters, step_sizes, samples):
    gradient = jax.grad(loss)(parameters, *samples)
    return jax.tree.map(lambda value, size, slope: value - size * slope, parameters, step_sizes, gradient)


def loss_after_fresh_samples(learned, samples, outer):
    parameters, step_sizes = learned
    parameters, _ = jax.lax.scan(lambda now, step: (descend(now, step_sizes, step), None), parameters, samples)
    return loss(parameters, *outer)


def loss_after_pattern(pattern, learned, outer):
    parameters, step_sizes = learned
    step = lambda now, _: (descend(now, step_sizes, pattern), None)
    parameters, _ = jax.lax.scan(step, parameters, None, length=STEPS)
    return loss(parameters, *outer)


def outer_step(samples, outer_samples):
    """Returns a function that computes a gradient and waits for it."""
    random = np.random.default_rng(0)
    array = lambda *shape: jnp.asarray(random.uniform(size=shape), jnp.float32)
    draw = lambda *shape: (array(*shape, 6), array(*shape, 3), array(*shape, 1))
    parameters = tuple(0.6 * array(*shape) - 0.3 for shape in SHAPES)
    learned = (parameters, jax.tree.map(lambda value: jnp.full_like(value, 1e-3), parameters))
    if samples == 8:
        function, arguments = loss_after_pattern, (draw(8), learned, draw(outer_samples))
    else:
        function, arguments = loss_after_fresh_samples, (learned, draw(STEPS, samples), draw(outer_samples))
    gradient = jax.jit(jax.value_and_grad(function))
    return lambda: jax.block_until_ready(gradient(*arguments))


def milliseconds(step):
    times, begin = [], time.perf_counter()
    while time.perf_counter() - begin < SECONDS:
        start = time.perf_counter()
        step()
        times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times)


def main(trainer="target/release/trainer"):
    command = [Path(trainer), "bench", "--model", "neural", "--seconds", str(SECONDS), "--json"]
    steps = [outer_step(*counts) for _, *counts in WORKS]
    for step in steps:
        step()
    pairs = [[] for _ in WORKS]
    for _ in range(PAIRS):
        rows = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        for (name, *_), step, found in zip(WORKS, steps, pairs):
            (row,) = (row for row in rows if row["name"].endswith(name))
            found.append((row["median_ms"], milliseconds(step), row["share_of_peak"]))
    print("| Outer step | trainer, ms | JAX, ms | ratio | share of the peak |\n|---|---:|---:|---:|---:|")
    for (name, *_), found in zip(WORKS, pairs):
        ours, jax_time, share = map(statistics.median, zip(*found))
        ratio = statistics.median(other / own for own, other, _ in found)
        print(f"| {name} | {ours:.3f} | {jax_time:.2f} | {ratio:.1f} | {share:.0%} |")
    print(f"\nMedians of {PAIRS} pairs; JAX {jax.__version__} on {jax.devices()[0].platform}; {rows[0]['name']}.")


if __name__ == "__main__":
    main(*sys.argv[1:])
