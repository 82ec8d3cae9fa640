"""The front door: study files, stages, report and command line."""

__version__ = "0.2.0"
