"""`python -m tipdamp`: the same as the command `tipdamp`."""

from tipdamp.cli import command

command()
