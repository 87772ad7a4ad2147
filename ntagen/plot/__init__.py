"""Pictures of scenes, plans and runs."""
