"""The live page of a scene: a server on this machine alone, and the scripts that draw its answers."""
