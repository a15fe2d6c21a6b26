"""`tumble check`: what can be said of recordings before any fit, as findings, a table and a page."""
