"""The complementarity problem of the normal forces."""
