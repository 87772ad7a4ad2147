"""Models as the texts of their files, edited in place: the rest stays as it was."""
