"""THE PARAMETERS: from one recording to an answer with its uncertainty."""
