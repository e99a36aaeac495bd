"""Plans of scans, and proposals of directions, which `Recipe` returns."""

from typing import Literal, Optional, TypedDict, final

import numpy as np
import numpy.typing as npt

from ._arrays import directions_from_degrees

_Float64Array = npt.NDArray[np.float64]


class _LossScale(TypedDict):
    black: float
    good: float
    just_visible: float


@final
class Plan:
    """A planned scan: the positions and times of all visits to samples."""

    __module__ = "glimpse_brdf"

    def __init__(
        self,
        order: Literal["travel", "progressive"],
        indices: npt.NDArray[np.int64],
        angles_degrees: _Float64Array,
        seconds: _Float64Array,
        total_seconds: float,
        moving_seconds: float,
        csv: str,
        blank_csv: str,
    ) -> None:
        self._order: Literal["travel", "progressive"] = order
        self._indices = indices
        self._angles_degrees = angles_degrees
        self._seconds = seconds
        self._total_seconds = total_seconds
        self._moving_seconds = moving_seconds
        self._csv = csv
        self._blank_csv = blank_csv

    @property
    def order(self) -> Literal["travel", "progressive"]:
        """The order of visits: "travel" or "progressive"."""
        return self._order

    @property
    def indices(self) -> npt.NDArray[np.int64]:
        """The sample of each visit, its row in the recipe's directions: int64 of shape (n,)."""
        return self._indices.copy()

    @property
    def angles_degrees(self) -> _Float64Array:
        """The positions of the axes theta_i, phi_i, theta_o, phi_o at each visit, degrees, float64 of shape (n, 4)."""
        return self._angles_degrees.copy()

    @property
    def directions(self) -> _Float64Array:
        """The positions as unit vectors, incoming and outgoing, float64 of shape (n, 2, 3)."""
        return directions_from_degrees(*self._angles_degrees.T)

    @property
    def seconds(self) -> _Float64Array:
        """The time at which each sample is measured, seconds after the start, float64 of shape (n,)."""
        return self._seconds.copy()

    @property
    def total_seconds(self) -> float:
        """The time until the last sample is measured, seconds."""
        return self._total_seconds

    @property
    def moving_seconds(self) -> float:
        """The total time during which arms move, seconds."""
        return self._moving_seconds

    def to_csv(self) -> str:
        """Returns the plan in the CSV format of `trainer plan --out`."""
        return self._csv

    def to_blank_csv(self) -> str:
        """Returns a blank table of measurements, in the CSV format of `trainer plan --blank`."""
        return self._blank_csv

    def __len__(self) -> int:
        return len(self._indices)

    def __repr__(self) -> str:
        return f"<glimpse_brdf.Plan of {len(self)} samples in {self.total_seconds:.1f} seconds, order {self.order}>"


@final
class Proposals:
    """Directions to read next, in order, and the losses to expect after each of them."""

    __module__ = "glimpse_brdf"

    def __init__(
        self,
        directions: _Float64Array,
        expected_losses: _Float64Array,
        loss_bounds: _Float64Array,
        expected_loss_so_far: float,
        loss_scale: _LossScale,
        seconds: Optional[_Float64Array],
    ) -> None:
        self._directions = directions
        self._expected_losses = expected_losses
        self._loss_bounds = loss_bounds
        self._expected_loss_so_far = expected_loss_so_far
        self._loss_scale = loss_scale
        self._seconds = seconds

    @property
    def directions(self) -> _Float64Array:
        """The pairs of directions, incoming then outgoing, unit vectors: float64 of shape (k, 2, 3)."""
        return self._directions.copy()

    @property
    def expected_losses(self) -> _Float64Array:
        """The expected loss after each proposed reading and the earlier ones, shape (k,)."""
        return self._expected_losses.copy()

    @property
    def loss_bounds(self) -> _Float64Array:
        """The upper bounds of these losses, which hold for 90 % of materials, shape (k,)."""
        return self._loss_bounds.copy()

    @property
    def expected_loss_so_far(self) -> float:
        """The expected loss of a fit of the readings so far."""
        return self._expected_loss_so_far

    @property
    def loss_scale(self) -> _LossScale:
        """Losses to compare with: a dict of that of the material in `black`, of a `good` fit, and of one that is
        `just_visible`.
        """
        return self._loss_scale.copy()

    @property
    def seconds(self) -> Optional[_Float64Array]:
        """The time to move to each direction and to read there, in seconds, shape (k,). None without a speed."""
        return None if self._seconds is None else self._seconds.copy()

    def __len__(self) -> int:
        return len(self._directions)

    def __repr__(self) -> str:
        return f"<glimpse_brdf.Proposals of {len(self)} directions>"
