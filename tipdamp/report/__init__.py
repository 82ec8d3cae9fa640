"""The report of a study: summary.json, the figures as PNG, and one HTML page that needs no network."""
