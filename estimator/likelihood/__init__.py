"""How probable errors are: noise, what repeats in it, and the weights that follow."""
