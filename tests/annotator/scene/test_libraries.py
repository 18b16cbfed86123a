"""VTK's libraries are there before it is imported."""

import subprocess
import sys

import pytest

CODE = """
import sys
from pathlib import Path
from annotator.scene.libraries import load_libraries
load_libraries()
assert not [name for name in sys.modules if name.startswith("vtk")]
print("libvtkRenderingCore" in Path("/proc/self/maps").read_text())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="nobody else tells what is loaded")
def test_the_libraries_are_loaded_without_an_import() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"
