"""The error whose text is a sentence for a person."""


class UserError(ValueError):
    """What somebody asked for cannot be done; the text says what and why."""
