"""Pages of the public names of tipdamp, from their docstrings."""

import inspect
import re
from pathlib import Path

from numpy.typing import ArrayLike

import tipdamp

NAMED = re.compile(r"^([A-Za-z_][\w, ]*?) : ")
MOST = 20  # parameters
MODULE = re.compile(r"\b[a-z_]\w*(\.\w+)*\.(?=\w)")
ARRAY_LIKE = str(ArrayLike).replace("typing.", "")
LINKED = {name for name in tipdamp.__all__ if re.match("[A-Z][a-z]+[A-Z0-9]", name)}  # no words
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
    lines = [f"# {name}", "", f"`from tipdamp import {name}`, out of `{thing.__module__}`", ""]
    lines += [*_signature(name, thing), *as_markdown(inspect.getdoc(thing) or "")]
    if inspect.isclass(thing):
        for member, what in _members(thing):
            lines += ["", f"## {member}", ""]
            if callable(what):
                lines += _signature(member, what)
            lines += as_markdown(inspect.getdoc(what) or "")
    return "\n".join(lines).replace(_link(name), name) + "\n"  # no link of a page to itself


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
    text = signature(name, thing)
    return ["```text", text, "```", ""] if text else []


def signature(name: str, thing: object) -> str:
    """How it is called, as Python; empty of what nobody calls."""
    try:
        given = inspect.signature(thing)
    except (TypeError, ValueError):  # of a Protocol or a Literal
        return ""
    parts = list(_arguments(given.parameters.values()))
    if len(parts) > MOST and inspect.isclass(thing):  # a result; its fields are explained below
        return ""
    result = given.return_annotation
    end = "" if result is given.empty or inspect.isclass(thing) else f" -> {_type(result)}"
    text = f"{name}({', '.join(parts)}){end}"
    if len(text) > 80:
        text = "\n".join([f"{name}(", *(f"    {part}," for part in parts), f"){end}"])
    return text


def _arguments(parameters):
    starred = False
    for one in parameters:
        if one.name in ("self", "cls"):
            continue
        if one.kind is one.KEYWORD_ONLY and not starred:
            yield "*"
        starred |= one.kind in (one.KEYWORD_ONLY, one.VAR_POSITIONAL)
        stars = {one.VAR_POSITIONAL: "*", one.VAR_KEYWORD: "**"}.get(one.kind, "")
        typed = "" if one.annotation is one.empty else f": {_type(one.annotation)}"
        default = "" if one.default is one.empty else f" = {one.default!r}"
        yield f"{stars}{one.name}{typed}" + re.sub("^ = <.*", " = ...", default)


def _type(annotation):
    """As it is written: without modules, and numpy's ArrayLike by its name."""
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    text = text.replace("typing.", "").replace(ARRAY_LIKE, "ArrayLike")
    return MODULE.sub("", text.replace("'", '"') if "Literal" in text else text.replace("'", ""))


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
    """Text that Markdown shows as it stands, with links to the pages of other names; what is
    between backquotes already is code."""
    parts = text.split("`")
    parts[::2] = [
        re.sub(r"\w+", lambda found: _link(found[0]), MARKUP.sub(r"\\\1", part))
        for part in parts[::2]
    ]
    return "`".join(parts)


def _link(name):
    return f"[{name}]({name}.md)" if name in LINKED else name
