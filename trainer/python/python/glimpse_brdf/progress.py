"""Progress of a training run, and a progress bar for a terminal or a notebook."""

import math
import sys
from typing import Any, Callable, NamedTuple, Optional


class Progress(NamedTuple):
    """Progress of a training run. `phase` names the part being trained, and `samples` is the size of its pattern. `done` of
    `total` outer steps are complete. `loss` is smoothed over about 50 steps. `best` is the smallest loss yet, on
    validation materials or over an epoch, or None.
    """

    phase: str
    samples: int
    done: int
    total: int
    loss: float
    best: Optional[float]


def bar() -> Optional[Callable[[Progress], None]]:
    """Returns a function that draws `Progress`; None if nobody watches it.

    A notebook or a terminal watches. In a terminal, the bar is that of tqdm, if it is installed.
    """
    if _in_notebook():
        return _in_one_output()
    if sys.stderr is None or not sys.stderr.isatty():
        return None
    try:
        from tqdm import tqdm  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        return _line
    bars: list[Any] = []

    def draw(progress: Progress) -> None:
        if not bars:
            bars.append(tqdm(total=progress.total))
        shown = bars[0]
        shown.total = progress.total
        shown.set_description(_text(progress), refresh=False)
        shown.update(progress.done - shown.n)
        if 0 < progress.total <= progress.done:
            shown.close()

    return draw


def _in_notebook() -> bool:
    ipython: Any = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


def _in_one_output() -> Callable[[Progress], None]:
    """Returns a function that replaces one output of a notebook's cell: a saved notebook has the last line only."""
    from IPython.display import display  # type: ignore[import-not-found, unused-ignore]

    shown: list[Any] = []

    def draw(progress: Progress) -> None:
        text = {"text/plain": _text(progress) + _steps(progress)}
        if shown:
            shown[0].update(text, raw=True)
        else:
            shown.append(display(text, raw=True, display_id=True))

    return draw


def _text(progress: Progress) -> str:
    loss = f", loss {progress.loss:.4f}" if math.isfinite(progress.loss) else ""
    return progress.phase + loss


def _steps(progress: Progress) -> str:
    return f": {progress.done} of {progress.total}" if progress.total else ""


def _line(progress: Progress) -> None:
    end = "\n" if 0 < progress.total <= progress.done else ""
    sys.stderr.write(f"\r{_text(progress)}{_steps(progress)}\x1b[K{end}")
    sys.stderr.flush()
