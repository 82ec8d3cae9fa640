"""What a shell completes: verbs, their options, keys of a study, study files.

eval "$(tipdamp completion)" in ~/.bashrc or ~/.zshrc.
"""

import re
from argparse import ArgumentParser
from collections.abc import Mapping

SCRIPT = """\
[ -z "$ZSH_VERSION" ] || { autoload -Uz +X bashcompinit && bashcompinit; }
_tipdamp() {
    local word=${COMP_WORDS[COMP_CWORD]} options=""
    if [ "$COMP_CWORD" = 1 ]; then
        COMPREPLY=($(compgen -W "%(verbs)s" -- "$word"))
        return
    fi
    case ${COMP_WORDS[1]} in
%(cases)s
    esac
    case $word in
        -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
        *)
            if [ "${COMP_WORDS[1]}" = explain ]; then
                COMPREPLY=($(compgen -W "%(keys)s" -- "$word"))
            else
                COMPREPLY=($(compgen -f -X '!*.@(%(files)s)' -- "$word") $(compgen -d -- "$word"))
            fi ;;
    esac
}
shopt -s extglob 2>/dev/null || true
complete -o filenames -F _tipdamp tipdamp
"""
FILES = ("toml", "msh", "inp", "cdb", "bdf", "nas")


def script(verbs: Mapping[str, ArgumentParser], keys: list[str]) -> str:
    """For bash and zsh, of the parsers by verb and the keys of a study file."""
    cases = [
        f'        {name}) options="{" ".join(_options(parser))}" ;;'
        for name, parser in verbs.items()
    ]
    return SCRIPT % {
        "verbs": " ".join(verbs),
        "cases": "\n".join(cases),
        "keys": " ".join(keys),
        "files": "|".join(FILES),
    }


def _options(parser: "ArgumentParser") -> list[str]:
    return sorted(set(re.findall(r"(?<!\S)\[?(--[a-z-]+)", parser.format_help())))
