"""Pictures of linkages, before anything is drawn: which figures there are, where they stand, where their names go."""
