"""Pictures and the pages of the viewer."""
