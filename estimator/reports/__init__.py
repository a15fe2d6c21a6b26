"""From a fit to an estimate: numbers, statuses and the sentences beside them."""
