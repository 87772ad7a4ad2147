"""Pictures of templates: their contents, the layout, and the drawing."""
