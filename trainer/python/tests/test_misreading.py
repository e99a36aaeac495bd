"""Files that mean something else than they seem to are read, asked about or refused."""

import glimpse_brdf as glimpse
import numpy as np
from misreading import INSTRUMENTS, confusion

# The largest share of files that are silently wrong, over all instruments.
SILENT = {
    "a row for each channel": 0,
    "decimal commas, minus signs": 0,
    "flags of wrong rows": 0,
    "rows of transmission": 0,
    "two samples": 0,
    "a column of gains": 0,
    "radians": 0,
    "mirror on the other side": 0.1,
    "azimuths in radians": 0.1,
    "percent": 0.05,
    "times cos(theta_o)": 0.2,
    "times both cosines": 0.2,
}


def test_files_are_read_or_refused_or_asked_about():
    shares = confusion(glimpse.Recipe.load("linear-any"), glimpse.load_materials("procedural:12:3"))
    mean = {name: np.mean([shares[instrument, name] for instrument in INSTRUMENTS], 0) for name in ["right", *SILENT]}
    for name, most in SILENT.items():
        assert mean[name][3] <= most, (name, mean[name])
    # Two of twelve materials reflect most light back to the lamp.
    assert mean["right"][2] <= 0.1 and mean["right"][4] <= 0.05, mean["right"]
