"""Effects that the vocabulary names, one per file, by the stage of the measurement that they touch."""
