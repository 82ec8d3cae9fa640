"""The figures and tables of the report, by subject; contents.py says which stand where."""
