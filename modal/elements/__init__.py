"""Finite elements: data sheets of the cells, element matrices in numpy and in dolfinx."""
