"""On which code the figures of a page were measured, and whether that is the code as it is now."""

import re

from tests.benchmarks.record import PACKAGES, fingerprint

OTHER, UNKNOWN = "other code", "code not recorded"
MEANING = {"hbm": "the harmonic balance", "statics": "with statics and reduction", "study": "with the studies"}


def now() -> dict:
    """{key of PACKAGES: fingerprint of the code as it is}."""
    return {key: fingerprint(key) for key in PACKAGES}


def sentence(codes) -> str:
    """For the front page; `on_page` reads it back."""
    each = ", ".join(f"{key} `{codes[key]}` ({MEANING[key]})" for key in PACKAGES)
    return f"This page was made for the code {each}."


def on_page(text) -> dict:
    """{key: fingerprint} that a front page was made for."""
    return dict(re.findall(r"(\w+) `([0-9a-f]{16})` \(", text))


def described(run: dict | None) -> str:
    """Date, versions, machine and code of the figures that a benchmark recorded."""
    if not run:
        return "never"
    found = [run.get("date", "on a day not noted"), run.get("versions", "versions not noted"), run.get("processor")]
    return "; ".join([*filter(None, found), f"code {run['code']}" if "code" in run else UNKNOWN])


def mark(when: str, key: str, codes: dict) -> str:
    """What a reader must know of figures made `when`: nothing where their code is that of `codes`."""
    if not when or when == "never":
        return ""
    code = re.search(r"; code ([0-9a-f]{16})", when)
    if code and code.group(1) == codes[key]:
        return ""
    day = re.match(r"\d{4}-\d\d-\d\d", when)
    return f"{OTHER if code else UNKNOWN}{f', {day.group()}' if day else ''}"


def warning(when, key, codes) -> list[str]:
    """Lines of a page: a warning where its figures are not those of the code as it is."""
    found = mark(when, key, codes)
    return [f"**Measured on {OTHER}** than {codes[key]}, that of {key} now." if found.startswith(OTHER) else
            f"**The {UNKNOWN}**; now {codes[key]}, that of {key}.", ""] if found else []
