"""What came of each study, in words and pictures: pages see a study's result and nothing else."""
