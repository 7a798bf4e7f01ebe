"""Where model and recording differ: locate, name, model, prove; or say what cannot be known."""
