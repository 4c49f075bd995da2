"""A URDF of unknown origin: entities, references to other files and endless elements are refused in
one line.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from testbed import resources
from testbed.errors import InputError
from testbed.machine.urdf_check import MOST_BYTES, read_urdf

LAUGHS = (
    '<!DOCTYPE robot [<!ENTITY a "lol">'
    + "".join(
        f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    + "]>"
)
FILE = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
HIDDEN = f"<?a <!-- ?>{FILE}<?a --> ?>"
MESH = '<visual><geometry><mesh filename="../../secret.stl"/></geometry></visual>'
TEXTURE = '<visual><material name="x"><texture filename="/etc/passwd"/></material></visual>'


@pytest.fixture(scope="module")
def shipped() -> str:
    return resources.urdf().read_text()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda text: text.replace("<robot", LAUGHS + "<robot", 1), "document type or entities"),
        (lambda text: text.replace("<robot", FILE + "<robot", 1), "document type or entities"),
        (lambda text: text.replace("<robot", HIDDEN + "<robot", 1), "document type or entities"),
        (lambda text: text.replace("</link>", MESH + "</link>", 1), "refers to another file"),
        (lambda text: text.replace("</link>", TEXTURE + "</link>", 1), "refers to another file"),
        (lambda text: text.replace("</robot>", "<a/>" * 20_000 + "</robot>"), "20000 elements"),
        (lambda text: text + "<!--" + " " * MOST_BYTES + "-->", "is too large"),
        (lambda text: text[: len(text) // 2], "is not XML"),
    ],
    ids=["laughs", "file", "hidden", "mesh", "texture", "elements", "size", "half"],
)
def test_it_is_refused(tmp_path: Path, shipped: str, change: object, told: str) -> None:
    assert callable(change)
    (tmp_path / "robot.urdf").write_text(change(shipped))
    with pytest.raises(InputError, match=r"robot\.urdf: ") as error:
        read_urdf(tmp_path / "robot.urdf")
    assert told in str(error.value) and "\n" not in str(error.value)


def test_a_comment_may_say_what_it_likes(tmp_path: Path, shipped: str) -> None:
    (tmp_path / "robot.urdf").write_text(shipped.replace("</robot>", "<!-- <!ENTITY --></robot>"))
    assert read_urdf(tmp_path / "robot.urdf")
