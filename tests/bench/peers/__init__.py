"""The ring on a foundation for other codes: decks, runs, energies."""
