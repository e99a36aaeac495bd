"""A program for the strict type checker. It is never run."""

from pathlib import Path
from typing import Optional

import glimpse_brdf as glimpse
import numpy as np
import numpy.typing as npt
from glimpse_brdf import plot


def report(progress: glimpse.Progress) -> None:
    best: Optional[float] = progress.best
    print(progress.phase, progress.done / progress.total, best)


def gray(incoming: npt.NDArray[np.float64], outgoing: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.full((len(incoming), 3), 0.1)


def scan(path: Path) -> float:
    material = glimpse.Material.from_function(gray, "gray")
    recipe: glimpse.Recipe = glimpse.train("neural", [material, "procedural:9"], progress=report, effort="quick")
    plan: glimpse.Plan = recipe.plan("travel", glimpse.Machine(speed_degrees_per_second=[20, 10, 20, 10]))
    readings: npt.NDArray[np.float32] = material(plan.directions)
    fitted: glimpse.FittedMaterial = recipe.fit(readings, plan.directions, quantity="brdf")
    for outlier in fitted.report["readings"]["outliers"]:
        print(outlier["sample"], outlier["z"], outlier["reading"], outlier["expected"], outlier["status"])
    fitted.save(path, "rgl", overwrite=True)
    evaluation = glimpse.evaluate(recipe, "procedural:3:1")
    directions: npt.NDArray[np.float64] = glimpse.directions()
    rows = glimpse.compare(material, [fitted, "procedural:2"])
    print(rows[0]["name"], plot.lobes([material, fitted], 30.0), plot.plan(plan))
    readings_of_ball = glimpse.photo(np.ones((1, 99, 99, 3)), [[0, 0, 1]], albedo=0.5, circle=(49, 49, 40))
    print(readings_of_ball["directions"].shape, readings_of_ball["circle"][2])
    loss: float = glimpse.loss(gray(directions[:, 0], directions[:, 1]), fitted)
    expected = fitted.report["expected_loss"]
    return loss + evaluation["loss"] + evaluation["materials"][0]["delta_e"] + (expected["loss"] if expected else 0.0)
