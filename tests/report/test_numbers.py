"""Numbers and units as pages and tables write them."""

from __future__ import annotations

import pytest

from testbed.formats.intervals import rounded, unit_name
from testbed.report.page import significant


@pytest.mark.parametrize(
    ("value", "digits", "expected"),
    [
        (10000.0, 4, "10000"),
        (9810.4, 4, "9810"),
        (0.12345, 3, "0.123"),
        (6.861e-05, 4, "6.861e-05"),
    ],
)
def test_a_large_number_is_written_without_a_power_of_ten(
    value: float, digits: int, expected: str
) -> None:
    assert significant(value, digits) == expected


@pytest.mark.parametrize(
    ("unit", "expected"), [("1", ""), ("m2", "m²"), ("m3/(s Pa)", "m³/(s Pa)"), ("N s/m", "N s/m")]
)
def test_units_have_their_powers_raised_and_pure_numbers_have_none(
    unit: str, expected: str
) -> None:
    assert unit_name(unit) == expected


@pytest.mark.parametrize(
    ("value", "interval", "expected"),
    [
        (0.32537, (-0.0013525, 0.7222), ("0.33", "0.00", "0.72")),
        (409.01, (248.45, 586.13), ("409", "248", "586")),
        (0.144563, (0.1109, 0.18074), ("0.145", "0.111", "0.181")),
        (1.234e-12, (1.1e-12, 1.3e-12), ("1.23e-12", "1.1e-12", "1.3e-12")),
    ],
)
def test_a_number_is_written_to_the_second_digit_of_half_its_interval(
    value: float, interval: tuple[float, float], expected: tuple[str, str, str]
) -> None:
    assert rounded(value, interval) == expected
