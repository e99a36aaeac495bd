"""Type stubs of the module. help() prints the documentation of a class or function, as in help(glimpse_brdf.train)."""

import os
from typing import Any, Callable, Iterable, Literal, Optional, Sequence, TypedDict, Union, final

import numpy as np
import numpy.typing as npt
from typing import type_check_only
from typing_extensions import Self, Unpack, disjoint_base

from ._results import Plan as Plan, Proposals as Proposals, _LossScale
from .progress import Progress as Progress

__version__: str

_Model = Literal["phong", "cook-torrance", "linear", "neural"]
_Format = Literal[
    "merl", "nbrdf", "rgl", "rgl-spectral", "pab", "openmaterial", "ssdd", "principled", "gltf", "openpbr"
]
_Path = Union[str, os.PathLike[str]]
_Float64Array = npt.NDArray[np.float64]
_Float32Array = npt.NDArray[np.float32]
_Source = Union[_Path, "Material"]
_Materials = Union[_Source, Iterable[_Source]]

__all__ = [
    "FittedMaterial",
    "GlimpseError",
    "ImplausibleError",
    "Machine",
    "Material",
    "Plan",
    "Progress",
    "Proposals",
    "Recipe",
    "__version__",
    "bundled_recipes",
    "compare",
    "directions",
    "directions_from_degrees",
    "evaluate",
    "load_material",
    "load_materials",
    "loss",
    "photo",
    "table_directions",
    "train",
]

class GlimpseError(ValueError): ...
class ImplausibleError(GlimpseError):
    fit: FittedMaterial

@type_check_only
class _Sample(TypedDict):
    sample: int
    status: Literal["used", "missing", "saturated", "outlier"]

@type_check_only
class _Outlier(_Sample):
    kind: Literal["single", "neighbors", "obstructed", "no-light", "clipped"]
    place: Optional[str]
    z: float
    threshold: float
    reading: list[float]
    expected: list[float]

@type_check_only
class _Readings(TypedDict):
    used: int
    unused: list[_Sample]
    saturated: list[int]
    no_light: list[int]
    repeated: int
    largest_spread: Optional[float]
    most_spread: Optional[int]
    outliers: list[_Outlier]

@type_check_only
class _ExpectedLoss(TypedDict):
    loss: float
    bound: Optional[float]
    unlike_training: Optional[bool]

@type_check_only
class _Noise(TypedDict):
    source: Literal["stated", "repeated", "default"]
    largest: float

@type_check_only
class _GlossGap(TypedDict):
    nearest: float
    read: list[float]

@type_check_only
class _NextReading(TypedDict):
    theta_i: float
    phi_i: float
    theta_o: float
    phi_o: float
    seconds: Optional[float]
    expected_loss: float
    bound: float

@type_check_only
class _Gaps(TypedDict):
    gloss: Optional[_GlossGap]
    extrapolated_from: Optional[float]
    is_monochrome: bool
    next: Optional[_NextReading]

@type_check_only
class _FitReport(TypedDict):
    trainer: str
    recipe: dict[str, Any]
    measured: dict[str, Any]
    readings: _Readings
    noise: Optional[_Noise]
    gaps: _Gaps
    residual: dict[str, Any]
    expected_loss: Optional[_ExpectedLoss]
    loss_scale: _LossScale
    spectrum: Optional[dict[str, Any]]

@type_check_only
class _MaterialReport(TypedDict):
    name: str
    loss: float
    dssim: float
    l2: float
    psnr: float
    delta_e: float
    predicted_loss: Optional[float]
    loss_bound: Optional[float]
    unlike_training: Optional[bool]

@type_check_only
class _Report(TypedDict):
    method: str
    model: str
    samples: int
    loss: float
    dssim: float
    l2: float
    psnr: float
    delta_e: float
    loss_standard_error: Optional[float]
    seeds: int
    loss_spread: float
    materials: list[_MaterialReport]
    trained_on: Optional[list[str]]
    namesakes_trained_on: Optional[list[str]]

@disjoint_base
class Material:
    @staticmethod
    def from_function(
        function: Callable[[_Float64Array, _Float64Array], npt.ArrayLike], name: str
    ) -> Material: ...
    @staticmethod
    def from_table(brdf: npt.ArrayLike, name: str) -> Material: ...
    @property
    def name(self) -> str: ...
    def __call__(self, incoming: npt.ArrayLike, outgoing: Optional[npt.ArrayLike] = None) -> _Float32Array: ...
    def albedo(self, theta_i_degrees: npt.ArrayLike) -> _Float32Array: ...
    def render(self, size: int = 256) -> npt.NDArray[np.uint8]: ...
    def save(
        self,
        path: _Path,
        format: Optional[_Format] = None,
        *,
        seed: int = 0,
        overwrite: bool = False,
        as_fitted: bool = False,
    ) -> None: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any, /) -> Self: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class FittedMaterial(Material):
    @property
    def model(self) -> _Model: ...
    @property
    def parameters(self) -> _Float32Array: ...
    @property
    def report(self) -> _FitReport: ...
    @property
    def directions(self) -> _Float64Array: ...
    @property
    def readings(self) -> _Float32Array: ...
    def deviation(self, incoming: npt.ArrayLike, outgoing: Optional[npt.ArrayLike] = None) -> _Float32Array: ...
    @property
    def wavelengths(self) -> Optional[_Float32Array]: ...
    def spectrum(self, incoming: npt.ArrayLike, outgoing: Optional[npt.ArrayLike] = None) -> _Float32Array: ...

@final
class Recipe:
    def __new__(cls, data: bytes, basis: Optional[bytes] = None) -> Recipe: ...
    @staticmethod
    def load(path: _Path) -> Recipe: ...
    def save(self, path: _Path, *, overwrite: bool = False) -> None: ...
    def to_bytes(self) -> bytes: ...
    def basis_bytes(self) -> Optional[bytes]: ...
    @property
    def model(self) -> _Model: ...
    @property
    def samples(self) -> int: ...
    @property
    def checksum(self) -> str: ...
    @property
    def tolerates_missing(self) -> bool: ...
    @property
    def directions(self) -> _Float64Array: ...
    @property
    def angles_degrees(self) -> _Float64Array: ...
    @property
    def half_difference_radians(self) -> _Float64Array: ...
    @property
    def expected_loss(self) -> Optional[float]: ...
    @property
    def metadata(self) -> dict[str, Any]: ...
    def plan(
        self,
        order: Optional[Literal["travel", "progressive"]] = None,
        machine: Optional[Machine] = None,
        *,
        full_turns: bool = True,
        seed: int = 0,
    ) -> Plan: ...
    def next(
        self,
        directions: Optional[npt.ArrayLike] = None,
        readings: Optional[npt.ArrayLike] = None,
        count: int = 1,
        machine: Optional[Machine] = None,
        *,
        accept_implausible: bool = False,
    ) -> Proposals: ...
    def fit(
        self,
        readings: Union[npt.ArrayLike, _Path],
        directions: Optional[npt.ArrayLike] = None,
        *,
        quantity: Optional[
            Literal[
                "brdf",
                "brdf-cos-i",
                "brdf-cos-o",
                "brdf-cos-i-o",
                "reflectance-factor",
                "reflectance-percent",
                "srgb",
            ]
        ] = None,
        name: str = "fitted",
        saturated: Optional[npt.ArrayLike] = None,
        noise: Optional[npt.ArrayLike] = None,
        wavelengths: Optional[npt.ArrayLike] = None,
        instrument: Optional[list[Optional[str]]] = None,
        white: Optional[npt.ArrayLike] = None,
        white_directions: Optional[npt.ArrayLike] = None,
        footprint: Optional[Literal["light", "sensor"]] = None,
        dark: Optional[npt.ArrayLike] = None,
        white_reflectance: Optional[npt.ArrayLike] = None,
        saturation: Optional[float] = None,
        convention: Optional[list[str]] = None,
        unit: Optional[Literal["degrees", "radians"]] = None,
        azimuth_unit: Optional[Literal["degrees", "radians"]] = None,
        ignore: Optional[list[str]] = None,
        keep_all: bool = False,
    ) -> FittedMaterial: ...
    def at(self, directions: npt.ArrayLike) -> Recipe: ...
    def components(self, directions: npt.ArrayLike) -> list[_Float32Array]: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any, /) -> Self: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Machine:
    def __new__(
        cls,
        *,
        speed_degrees_per_second: Optional[npt.ArrayLike] = None,
        settle_seconds: Optional[float] = None,
        max_theta_i_degrees: Optional[float] = None,
        max_theta_o_degrees: Optional[float] = None,
        min_separation_degrees: Optional[float] = None,
        in_plane: bool = False,
    ) -> Self: ...
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...

@type_check_only
class _BundledLosses(TypedDict):
    procedural: float
    merl: float
    merl_color: float
    rgl: Optional[float]

@type_check_only
class _BundledRecipe(TypedDict):
    name: str
    model: _Model
    samples: int
    takes_missing: bool
    checksum: str
    bytes: int
    basis_bytes: Optional[int]
    seconds: Optional[float]
    loss: Optional[_BundledLosses]

def bundled_recipes() -> list[_BundledRecipe]: ...
def load_material(source: _Path) -> Material: ...
def load_materials(source: _Path) -> list[Material]: ...
def table_directions() -> _Float64Array: ...
def directions() -> _Float64Array: ...
def loss(reference: Union[Material, npt.ArrayLike], fitted: Union[Material, npt.ArrayLike]) -> float: ...
def directions_from_degrees(
    theta_i: npt.ArrayLike, phi_i: npt.ArrayLike, theta_o: npt.ArrayLike, phi_o: npt.ArrayLike
) -> _Float64Array: ...
class _Comparison(TypedDict):
    name: str
    loss: float
    dssim: float
    l2: float
    psnr: float
    delta_e: float

@type_check_only
class _PhotoReadings(TypedDict):
    directions: _Float64Array
    brdf: _Float64Array
    noise: _Float64Array
    pixels: npt.NDArray[np.int64]
    circle: tuple[float, float, float]

def photo(
    pictures: npt.ArrayLike,
    lights: npt.ArrayLike,
    *,
    intensities: Optional[npt.ArrayLike] = None,
    albedo: Optional[float] = None,
    circle: Optional[Sequence[float]] = None,
    field_of_view_degrees: Optional[float] = None,
) -> _PhotoReadings: ...
def compare(reference: Material, materials: _Materials) -> list[_Comparison]: ...
def evaluate(
    recipe: Recipe,
    materials: _Materials,
    *,
    first: Optional[int] = None,
    lose: int = 0,
    noise: float = 0.0,
    additive: float = 0.0,
    levels: int = 0,
    seeds: int = 5,
    seed: int = 0,
    threads: Optional[int] = None,
) -> _Report: ...
@type_check_only
class _TrainingOptions(TypedDict, total=False):
    samples: Union[int, Literal["any"]]
    schedule: Literal["prior", "paper"]
    effort: Literal["brief", "quick", "standard", "long"]
    seed: int
    share: Sequence[float]
    missing: float
    noise: float
    additive: float
    levels: int
    procedural: float
    scan_seconds: float
    bases: int
    eta: float

def train(
    model: _Model,
    materials: Optional[_Materials] = None,
    *,
    machine: Optional[Machine] = None,
    pattern: Optional[npt.ArrayLike] = None,
    checkpoint: Optional[_Path] = None,
    resume: bool = False,
    progress: Union[Callable[[Progress], object], Literal[False], None] = None,
    threads: Optional[int] = None,
    **options: Unpack[_TrainingOptions],
) -> Recipe: ...
