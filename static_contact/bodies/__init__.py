"""The two bodies behind the contact, condensed or sparse, and their rigid motions."""
