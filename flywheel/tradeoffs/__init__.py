"""What accuracy costs on one scene: every method that can answer it, run here, with its true error and its time."""
