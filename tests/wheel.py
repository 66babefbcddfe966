"""Does the newest wheel in a folder work where there is no Rust and nothing else of this project?

``make wheel`` runs this file: it makes an empty environment, installs the wheel and what it depends
on, and runs there what the README shows, in a folder that holds the example objects alone.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def main(folder: str) -> None:
    wheel = max(Path(folder).glob("*.whl"), key=lambda path: path.stat().st_mtime)
    assert "-cp310-abi3-" in wheel.name, f"{wheel.name} is for one version of Python only"
    if sys.platform == "linux":
        assert "manylinux" in wheel.name, f"{wheel.name} is for this machine only"
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        subprocess.run([sys.executable, "-m", "venv", place / "empty"], check=True)
        scripts = place / "empty" / ("Scripts" if os.name == "nt" else "bin")
        # No cargo, no compiler, no other Python: nothing but the environment and the system.
        kept = [scripts, *(Path(p) for p in ("/usr/bin", "/bin") if os.name != "nt")]
        path = os.pathsep.join(map(str, kept))
        assert os.name == "nt" or shutil.which("cargo", path=path) is None
        # How pip reaches the network, and what Windows cannot do without.
        kept_names = re.compile("PIP_.*|SSL_.*|.*_PROXY|SYSTEMROOT|TEMP|TMP", re.IGNORECASE)
        environment = {k: v for k, v in os.environ.items() if kept_names.fullmatch(k)}
        environment |= {"PATH": path, "HOME": temporary, "MPLBACKEND": "agg"}
        shutil.copytree(ROOT / "examples" / "objects", place / "examples" / "objects")

        def run(*command: str | Path) -> str:
            result = subprocess.run(
                command, cwd=place, env=environment, capture_output=True, text=True, check=False
            )
            if result.returncode:
                sys.exit(f"{command[0]} failed in the empty environment:\n{result.stderr}")
            return result.stdout

        python = scripts / ("python.exe" if os.name == "nt" else "python")
        pip = (python, "-m", "pip", "--disable-pip-version-check", "--quiet")
        run(*pip, "install", "--retries", "10", "--only-binary", ":all:", wheel.resolve())
        run(*pip, "check")
        where = run(python, "-c", "import graspmoduli; print(graspmoduli.__file__)")
        assert str(place) in where, f"graspmoduli was imported from {where}"
        readme = (ROOT / "README.md").read_text()
        blocks = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
        assert blocks, "the README shows no Python"
        run(python, "-c", "\n".join(blocks))
        command = scripts / "graspmoduli"
        bottle = Path("examples", "objects", "yogurt_bottle.ply")
        run(command, "grasp", bottle, "--json", "grasps.json", "--picture", "grasps.png")
        assert (place / "grasps.json").stat().st_size > 1000
        assert (place / "grasps.png").stat().st_size > 10_000
    size = wheel.stat().st_size / 2**20
    print(f"{wheel.name} ({size:.1f} MB) runs what the README shows, without Rust")


if __name__ == "__main__":
    main(sys.argv[1])
