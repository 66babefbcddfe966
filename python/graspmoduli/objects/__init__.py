"""Real objects: things in the world, as meshes or clouds of points."""
