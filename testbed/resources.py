"""Where the files that travel with the testbed are: from a checkout and from an installed wheel
alike.
"""

from __future__ import annotations

from pathlib import Path

from testbed.errors import InputError, did_you_mean

_PACKAGE = Path(__file__).resolve().parent


def folder(name: str) -> Path:
    """Folder `name` (`urdf` or `scenarios`) of the wheel, or of the checkout."""
    for candidate in (_PACKAGE / "data" / name, _PACKAGE.parent / name):
        if candidate.is_dir():
            return candidate
    raise InputError(
        f"the installation has no folder {name!r}", allowed="a complete wheel or checkout"
    )


def urdf(name: str = "roboclimber") -> Path:
    """Path of a shipped URDF."""
    return folder("urdf") / f"{name}.urdf"


def scenario(name: str | Path) -> Path:
    """Path of a scenario: a file as given, or a shipped one by its bare name.

    Raises InputError if there is neither.
    """
    given = Path(name)
    if given.is_file():
        return given
    if given.suffix in ("", ".yaml", ".yml"):
        shipped = folder("scenarios") / f"{given.stem}.yaml"
        if shipped.is_file() and str(given.parent) in (".", "scenarios"):
            return shipped
    raise _none_of("scenario", name, folder("scenarios"))


def sweep(name: str | Path) -> Path:
    """Path of a sweep: a file as given, or a shipped one by its bare name. Raises InputError if
    there is neither.
    """
    given = Path(name)
    if given.is_file():
        return given
    shipped = folder("scenarios") / "sweeps"
    if given.suffix in ("", ".yaml", ".yml") and str(given.parent) == ".":
        found = shipped / f"{given.stem}.yaml"
        if found.is_file():
            return found
    raise _none_of("sweep", name, shipped, ", or a scenario with --vary")


def _none_of(kind: str, name: str | Path, shipped: Path, more: str = "") -> InputError:
    """What is said of a name that is neither a file nor one of those shipped in a folder."""
    names = sorted(path.stem for path in shipped.glob("*.yaml"))
    hint = did_you_mean(Path(name).stem, names)
    allowed = f"a file, or one of {', '.join(names)}{more}"
    return InputError(f"no such {kind}{hint}", file=str(name), allowed=allowed)
