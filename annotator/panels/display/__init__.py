"""How the volume is shown: window and level, opacity, cropping."""
