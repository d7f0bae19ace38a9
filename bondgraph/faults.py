"""What can be wrong with a graph, as one kind of error."""


class GraphError(ValueError):
    """A graph that is not well formed, or that cannot be treated as asked; says which elements and bonds are concerned."""
