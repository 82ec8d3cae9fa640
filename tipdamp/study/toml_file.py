"""The text of a study file as plain tables, unchecked."""

import re
import tomllib
from pathlib import Path

from tipdamp.hbm.errors import InputError

LARGEST = 1_000_000  # bytes of a study file
# a dotted key, for which tomllib takes long
DEEP = re.compile(r"""(?<![\w"'-])(?:[\w"'-]+\s*\.\s*){16}""")


def read_toml(path: Path) -> dict:
    """Content of a study file, unchecked; InputError where it is absent or no TOML."""
    if not path.is_file():
        raise InputError(f"study file not found: {path} (looked for it as {path.absolute()})")
    text = _text(path)
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"{path}: not a valid TOML file: {error}{_decimal_comma(path, str(error))}"
        ) from None
    except ValueError:
        raise InputError(
            f"{path}: not a valid TOML file: a whole number has thousands of digits"
        ) from None
    except RecursionError:
        raise InputError(
            f"{path}: its lists or tables lie in one another too deeply; no key of a study needs "
            "more than two lists"
        ) from None
    return raw


def _text(path: Path) -> str:
    """Text of a study file of sensible size."""
    size = path.stat().st_size
    if size > LARGEST:
        raise InputError(
            f"{path}: has {size} bytes, at most {LARGEST} are read: is it a study file?"
        )
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(
            f"{path}: line {line}: the byte 0x{data[error.start]:02x} is not UTF-8, which TOML "
            f"needs; save the file as UTF-8 (from Latin-1: iconv -f latin1 -t utf-8 {path.name})"
        ) from None
    if deep := DEEP.search(text):
        raise InputError(
            f"{path}: line {text[: deep.start()].count(chr(10)) + 1}: a key of 16 parts or more; "
            "keys of a study have at most two, as in [contact.left]"
        )
    return text.replace("\r\n", "\n")


def _decimal_comma(path: Path, error: str) -> str:
    """The remedy where the line that the error names has a number such as 0,3."""
    found = re.search(r"line (\d+)", error)
    line = _text(path).splitlines()[int(found[1]) - 1] if found else ""
    comma = re.search(r"=\s*([+-]?\d+),(\d+)", line)
    return f": numbers take a decimal point, {comma[1]}.{comma[2]}" if comma else ""
