"""The same question put to several methods."""
