"""What the mouse does in slices, scene and panes, as data: the views do it, the shortcut sheet shows it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Gesture:
    """Something done with the mouse: where, how, and what follows."""

    place: str
    gesture: str
    effect: str


GESTURES: tuple[Gesture, ...] = (
    Gesture(
        "Slices", "Click or drag (navigating)", "Move the crosshair; on a keypoint: make it the active one"
    ),
    Gesture("Slices", "Click (placing)", "Place the active keypoint, or the base and then the tip of a box"),
    Gesture("Slices", "Drag a keypoint (placing)", "Move it; Esc takes the drag back"),
    Gesture("Slices", "Click another box (placing)", "Make its link the active one"),
    Gesture("Slices", "Drag a handle or a box (placing)", "Move, turn or resize the box; Esc takes it back"),
    Gesture(
        "Slices", "Drag a handle or the tool (posing)", "Move, turn or bend the whole tool; Esc takes it back"
    ),
    Gesture("Slices", "Click or drag beside the tool (posing)", "Move the crosshair"),
    Gesture("Slices", "Wheel", "One plane on or back; with Shift ten"),
    Gesture("Slices", "Ctrl+wheel", "Zoom at the cursor, in all three slices"),
    Gesture("Slices", "Middle drag, or Shift+left drag", "Pan"),
    Gesture("Slices", "Right drag", "Window (sideways) and level (up and down)"),
    Gesture("Scene", "Drag", "Rotate"),
    Gesture("Scene", "Middle drag, or Shift+left drag", "Pan"),
    Gesture("Scene", "Wheel, or right drag", "Zoom"),
    Gesture("Scene", "Ctrl+drag", "Window and level"),
    Gesture("Scene", "Click a keypoint (navigating)", "Make it the active one, and go to it"),
    Gesture("Scene", "Double click (navigating)", "Bring the slices to the surface under the cursor"),
    Gesture(
        "Scene",
        "Click (placing)",
        "Propose a position on the surface; the slices go there. Return keeps it, a second click "
        "from another angle settles its depth, Esc drops it",
    ),
    Gesture(
        "Scene",
        "Click again from the same angle (placing a box)",
        "Keep the end that is proposed, half the link's height beneath the surface, and propose the next: "
        "the tip, or after it the base of the next box",
    ),
    Gesture("Scene", "Click another box (placing)", "Make its link the active one"),
    Gesture("Scene", "Drag a handle (placing)", "Move, turn or resize the active box; Esc takes it back"),
    Gesture(
        "Scene", "Drag a handle or the tool (posing)", "Move, turn or bend the whole tool; Esc takes it back"
    ),
    Gesture("Panes", "Double click on a header", "Let the pane fill the window, or show all four again"),
)
