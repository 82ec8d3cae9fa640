"""Generators of the meshes that the studies use."""

if __name__ != "tipdamp.meshes":  # a second copy of its classes would be unlike the first
    raise ImportError(f"{__name__} is a part of tipdamp: import tipdamp.meshes")
