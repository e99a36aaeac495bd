"""What the checks share: an environment with other programs, and running commands."""
import os, subprocess, sys, venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "target" / "interop"


def enter_environment(packages):
    """Restarts the script in the environment, unless it runs there. Installs the packages from PyPI."""
    if "--inside" in sys.argv:
        sys.argv.remove("--inside")
        return
    python = ENVIRONMENT / "bin" / "python"
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *packages], check=True)
    os.execv(python, [str(python), *sys.argv, "--inside"])


def run(*command):
    """Runs a command and returns its output. The check fails if the command fails."""
    print("==", *command, flush=True)
    return subprocess.run([str(word) for word in command], check=True, text=True, stdout=subprocess.PIPE).stdout
