"""Tables in, pictures out. No statistic is computed here."""
