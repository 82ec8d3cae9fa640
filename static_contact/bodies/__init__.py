"""The two bodies behind the contact, condensed or sparse, and the rigid motions that they are free
to make."""
