"""The arrays that everything is handed in; a docstring says shape, unit and frame."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Columns = Mapping[str, Array]
"""A table's columns, (n,) each, by name."""
