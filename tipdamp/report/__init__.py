"""report.html and inspect.html: the results as figures and tables with numbers and captions, and
summary.json."""
