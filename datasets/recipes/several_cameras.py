"""A recipe as each of its high-speed cameras films it."""

from dataclasses import fields, replace

from datasets.recipes.recipe import HsvRecipe, Recipe


def filmed_by(recipe: Recipe, camera: int) -> Recipe:
    """The recipe with the optics of a camera as ``[hsv]``; camera 0 is that of ``[hsv]``, 1 the first of ``[[further_hsv]]``."""
    if camera == 0:
        return recipe
    further = recipe.further_hsv[camera - 1]
    own = {each.name: getattr(further, each.name, None) for each in fields(HsvRecipe)}
    return replace(recipe, hsv=replace(recipe.hsv, **{key: value for key, value in own.items() if value is not None}))
