"""Install relit's plug-in for GIMP 3 or Krita: ``python install.py gimp`` or ``python install.py krita``.

It copies files into the editor's folder for plug-ins, and notes where the ``relit`` command is. Nothing else
is changed. Run it again after relit was updated or has moved.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
SHARED = HERE / "relit_command.py"
#: What is left to do, by editor.
NEXT = {
    "gimp": "Start GIMP anew. The entry is in the menu Filters, Light and Shadow: Relight Face...",
    "krita": "Start Krita anew; in Settings, Configure Krita, Python Plugin Manager, tick relit, and start "
    "it once more. The entry is in the menu Tools, Scripts: Relight Face...",
}


class InstallError(Exception):
    """Why nothing was installed, in one line."""


def configuration() -> Path:
    """Return the folder in which this system's programs keep a user's settings."""
    if sys.platform == "win32":
        return Path(os.environ["APPDATA"])
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support"
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")


def data() -> Path:
    """Return the folder in which this system's programs keep a user's files."""
    if sys.platform.startswith("linux"):
        return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    return configuration()


def gimp_folder() -> Path:
    """Return GIMP's newest folder for plug-ins.

    Raises
    ------
    InstallError
        If GIMP 3 has not made one yet.
    """
    versions = [folder for folder in (configuration() / "GIMP").glob("3.*") if folder.is_dir()]
    if not versions:
        raise InstallError(
            "GIMP 3 keeps no settings here yet: start it once, or name its folder with --folder."
        )
    newest = max(
        versions, key=lambda folder: [int(part) for part in folder.name.split(".") if part.isdigit()]
    )
    return newest / "plug-ins"


def krita_folder() -> Path:
    """Return Krita's folder for plug-ins."""
    return data() / "krita" / "pykrita"


def install(editor: str, folder: Path, command: str) -> list[Path]:
    """Copy a plug-in into a folder, and return the files.

    Raises
    ------
    InstallError
        If there is something else by its name.
    """
    plugin, source = folder / "relit", HERE / editor
    if plugin.exists() and not (plugin / SHARED.name).is_file():
        raise InstallError(
            f"{plugin} is there already, and is not relit's; move it, or choose another --folder."
        )
    files = {SHARED: plugin / SHARED.name}
    if editor == "gimp":
        files[source / "relit.py"] = plugin / "relit.py"
    else:
        files[source / "relit.desktop"] = folder / "relit.desktop"
        files.update({file: plugin / file.name for file in (source / "relit").glob("*.*")})
    plugin.mkdir(parents=True, exist_ok=True)
    for origin, copy in files.items():
        shutil.copyfile(origin, copy)
    if editor == "gimp":
        (plugin / "relit.py").chmod(0o755)  # or GIMP does not start it
    noted = plugin / "command.txt"
    noted.write_text(command, "utf-8")
    return [*files.values(), noted]


def command_beside_python() -> str:
    """Return the ``relit`` command of the Python that runs this, or the one on the path.

    Raises
    ------
    InstallError
        If there is none.
    """
    found = shutil.which("relit", path=str(Path(sys.executable).parent)) or shutil.which("relit")
    if not found:
        raise InstallError("The relit command was not found: install relit first, or name it with --command.")
    return str(Path(found).absolute())


def main(words: list[str] | None = None) -> int:
    """Install, tell what to do next, and return the exit code."""
    parser = argparse.ArgumentParser(description="Install relit's plug-in for an editor.")
    parser.add_argument("editor", choices=("gimp", "krita"))
    parser.add_argument("--folder", type=Path, help="the editor's folder for plug-ins")
    parser.add_argument("--command", help="the relit command; by default, that of this Python")
    given = parser.parse_args(words)
    try:
        folder = given.folder or (gimp_folder() if given.editor == "gimp" else krita_folder())
        command = given.command or command_beside_python()
        for file in install(given.editor, folder, command):
            print(file)
    except (InstallError, OSError) as error:
        print(f"install.py: {error}", file=sys.stderr)
        return 1
    print(NEXT[given.editor])
    return 0


if __name__ == "__main__":
    sys.exit(main())
