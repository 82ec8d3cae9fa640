"""The assembled, unreduced bodies: the second route to preload and stuck modes."""
