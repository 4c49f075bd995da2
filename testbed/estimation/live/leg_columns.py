"""Where each of a leg's believed numbers stands in its packed array: friction[8] of (5), then believed.SCALARS."""

from __future__ import annotations

AREA_A, AREA_B, MASS, EXTRA_MASS, STROKE, GAIN_A, GAIN_B, ZERO_A, ZERO_B, DRIFT_A = range(8, 18)
SLOPE, PRESSURE_COEFFICIENT, LOAD_COEFFICIENT, RATE, REFERENCE = range(18, 23)
SPRING, SPRING_REST, CUSHION, CUSHION_START, OFFSET = range(23, 28)
DEAD_A, DEAD_B, BULK, SEAL, DEADBAND = range(28, 33)
