"""Contact between unlike meshes: surfaces, their overlap, and the contact points on it."""
