"""Fields over the meshes: surfaces, pressure of contact points, files for ParaView."""
