"""Study files: schema, values, checks."""
