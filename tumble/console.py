"""The terminal as every verb writes to it: what stands in names and messages is text, never markup of Rich's or an emoji."""

from rich import console


class Console(console.Console):
    """Rich's console with ``[red]`` and ``:smile:`` printed as they are, in sentences and in the cells of tables."""

    def __init__(self, *, stderr: bool = False, width: int | None = None) -> None:
        super().__init__(stderr=stderr, markup=False, emoji=False, highlight=False, width=width)
