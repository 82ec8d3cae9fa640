"""The tables of the report, one file each; contents.py says which stand where."""
