"""Plain data of figures, scenes, mode shapes and tables, and what draws them."""
