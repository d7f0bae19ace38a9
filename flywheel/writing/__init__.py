"""What a user reads: tables as text, JSON and CSV."""
