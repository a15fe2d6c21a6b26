"""What a sequence means: vocabulary, file formats, recipes, scoring and the regression gate."""
