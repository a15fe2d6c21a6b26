"""How studies look: figures, tables, numbers and shares in words."""
