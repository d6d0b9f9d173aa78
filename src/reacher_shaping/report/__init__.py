"""Tables in, words and pages out. No statistic is computed here."""
