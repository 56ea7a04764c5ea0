"""The pictures of this paper, in the order of the report."""
