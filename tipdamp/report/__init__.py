"""report.html, inspect.html and summary.json: results as figures and tables."""
