"""How joints and their angles are written, the same in every panel and dialog."""

_MINUS = "\N{MINUS SIGN}"


def angle_title(name: str) -> str:
    """Write ``theta1`` as θ1; other names stay."""
    return f"θ{name.removeprefix('theta')}" if name.startswith("theta") else name


def signed_text(value_deg: float, decimals: int) -> str:
    """Write an angle with its sign; what rounds to zero has none."""
    rounded = round(value_deg, decimals)
    return f"{rounded:+.{decimals}f}°".replace("-", _MINUS) if rounded else f"{0:.{decimals}f}°"
