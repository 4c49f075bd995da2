"""The columns of the hydraulic arrays: one name a number, so that kernels and worlds speak of the same thing."""

from __future__ import annotations

# --- parameters of an axis (columns of the 12 x AXIS_PARAMETERS array) -------------------------------------
(
    AREA_A, AREA_B, STROKE, DEAD_A, DEAD_B, BULK, AIR, LEAK_I, LEAK_O, HOSE_CAP, HOSE_TIME,
    K_PA, K_AT, K_PB, K_BT, DEADBAND, HYSTERESIS, SPOOL_WN, SPOOL_ZETA, AMP_TAU, EDGE_LEAK, LOCKED,
    FC_POS, FS_POS, CS_POS, VISC_POS, FC_NEG, FS_NEG, CS_NEG, VISC_NEG,
    BRISTLE_K, BRISTLE_D, FR_POSITION, FR_PRESSURE, FR_LOAD, FR_SIDE, DWELL_GAIN, DWELL_TIME,
    CUSHION_LENGTH, CUSHION_D, STOP_K, STOP_D,
    SPRING_K, SPRING_REST, PERIODIC_N, PERIODIC_W, XCUSHION_K, XCUSHION_START,
    LINE_WN, LINE_ZETA, TRANSDUCER_TAU, EXTRA_VISC_RATE, HOSE_CAP_B, EDGE_LEAK_P,
    AXIS_PARAMETERS,
) = range(55)  # fmt: skip

# --- state of an axis (columns of the 12 x AXIS_STATES array) ----------------------------------------------
(
    OIL_A, OIL_B, P_A, P_B, SPOOL, SPOOL_RATE, AMPLIFIER, PLAY, BRISTLE, DWELL, HOSE_P,
    LINE_P, LINE_RATE, SENSED_A, SENSED_B, FORCE, FRICTION, WARM, HOSE_P_B, END_FORCE,
    AXIS_STATES,
) = range(21)  # fmt: skip

# --- parameters of the power unit ---------------------------------------------------------------------------
(
    PUMP_FLOW, PUMP_SET, PUMP_BAND, PUMP_TAU, PUMP_POWER, PUMP_LEAK, RELIEF_SET, RELIEF_SLOPE,
    ACC_VOLUME, ACC_PRECHARGE, LINE_VOLUME, TANK_P, SUPPLY_BULK, SUPPLY_AIR,
    HEAT_CAPACITY, COOLING, AMBIENT, VISC_RATE, VISC_REFERENCE, DROOP, DROOP_TIME, PUMP_ON,
    SUPPLY_PARAMETERS,
) = range(23)  # fmt: skip

# --- state of the power unit --------------------------------------------------------------------------------
(
    OIL_SUPPLY, P_SUPPLY, PUMP_STROKE, OIL_TANK, TEMPERATURE, RELIEF_FLOW, PUMP_WORK, LOSS, TIME, THROUGHPUT, DROOP_P,
    TRACTION_FLOW, TRACTION_WORK, PUMP_POWER_NOW,
    SUPPLY_STATES,
) = range(15)  # fmt: skip
