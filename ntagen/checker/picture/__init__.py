"""Pictures of templates: what they show, where its parts are placed, and the drawing."""
