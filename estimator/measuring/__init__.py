"""One sequence from its pictures to its estimate: as a free flight, with impacts, or of two particles."""
