"""What is wrong with a study, for the user."""

from __future__ import annotations


class StudyError(Exception):
    """A study that cannot be made or resumed; the text says why and what to do."""
