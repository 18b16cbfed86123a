"""How long something took, as people read it."""


def duration(seconds: float) -> str:
    """Return minutes and seconds, such as ``2:05``, from an hour on with the hours: ``1:02:05``."""
    whole = int(seconds)
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
