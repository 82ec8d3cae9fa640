"""Pages of the public names of tipdamp, from their docstrings."""

import inspect
import re
from pathlib import Path

import tipdamp

NAMED = re.compile(r"^([A-Za-z_][\w, ]*?) : ")
MOST = 20  # parameters
MARKUP = re.compile(r"([\\*_<>\[\]|{}#$])")


def write_api(folder: Path) -> None:
    """A page for each name, and one that lists them with their first sentence."""
    folder.mkdir()
    listed = ["# Names of a script", "", "All of these are imported from `tipdamp`.", ""]
    listed += ["| name | what it is |", "|---|---|"]
    for name in tipdamp.__all__:
        thing = getattr(tipdamp, name)
        (folder / f"{name}.md").write_text(_page(name, thing), encoding="utf-8")
        listed.append(f"| [{name}]({name}.md) | {_first(thing)} |")
    listed += ["", "```{toctree}", ":hidden:", "", *tipdamp.__all__, "```", ""]
    (folder / "index.md").write_text("\n".join(listed), encoding="utf-8")


def _first(thing):
    return _plain(" ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split()))


def _page(name, thing):
    lines = [f"# {name}", "", f"`from {thing.__module__} import {name}`, or from `tipdamp`", ""]
    lines += [*_signature(name, thing), *as_markdown(inspect.getdoc(thing) or "")]
    if inspect.isclass(thing):
        for member, what in _members(thing):
            lines += ["", f"## {member}", ""]
            if callable(what):
                lines += _signature(member, what)
            lines += as_markdown(inspect.getdoc(what) or "")
    return "\n".join(lines) + "\n"


def _members(thing):
    """(name, function or property) of the class itself and its bases of this project, with a
    docstring."""
    for name in sorted(dir(thing)):
        what = inspect.getattr_static(thing, name)
        if isinstance(what, classmethod | staticmethod):
            what = what.__func__
        ours = inspect.isfunction(what) or isinstance(what, property)
        if not name.startswith("_") and ours and inspect.getdoc(what):
            yield name, what


def _signature(name, thing):
    try:
        given = inspect.signature(thing)
    except (TypeError, ValueError):  # of a Protocol or a Literal
        return []
    parts = [str(one) for one in given.parameters.values()]
    if len(parts) > MOST:  # of a result, which nobody calls; its fields are explained below
        return []
    text = f"{name}({', '.join(parts)})"
    if len(text) > 80:
        text = "\n".join([f"{name}(", *(f"    {part}," for part in parts), ")"])
    return ["```text", text.replace("tipdamp.hbm.", "").replace("tipdamp.", ""), "```", ""]


def as_markdown(doc: str) -> list[str]:
    """Paragraphs of a docstring; lines 'name : meaning' become a list, statements after >>> a block
    of code, indented lines a block of text."""
    lines: list[str] = []
    for block in doc.split("\n\n"):
        begin = block.lstrip()
        if begin.startswith(">>>"):
            lines += ["```pycon", *block.splitlines(), "```", ""]
        elif block.startswith("    "):
            lines += ["```text", *block.splitlines(), "```", ""]
        else:
            lines += [*_paragraph(block), ""]
    return lines


def _paragraph(block):
    lines: list[str] = []
    for line in block.splitlines():
        named = NAMED.match(line)
        if named:
            lines.append(f"- **{_plain(named[1])}** : {_plain(line[named.end() :])}")
        elif lines and lines[-1].startswith(("- ", "  ")) and not line[:1].isupper():
            lines.append(f"  {_plain(line.strip())}")
        elif lines and lines[-1].startswith(("- ", "  ")):
            lines += ["", _plain(line)]
        else:
            lines.append(_plain(line))
    return lines


def _plain(text):
    """Text that Markdown shows as it stands; what is between backquotes already is code."""
    parts = text.split("`")
    parts[::2] = [MARKUP.sub(r"\\\1", part) for part in parts[::2]]
    return "`".join(parts)
