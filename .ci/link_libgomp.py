"""Give Pinocchio an OpenMP runtime on systems that have none: run by `make setup`, with the environment's Python.

Pinocchio's wheel needs the system's libgomp.so.1 (Debian: libgomp1), which a minimal system lacks and which cannot be
installed without root. CasADi's wheel carries a copy under another name; a link to it, in the folder where Pinocchio
looks first, does as well. Nothing happens where the system has the library.
"""

import ctypes
import sysconfig
from pathlib import Path


def main() -> None:
    """Link the copy, if it is needed."""
    try:
        ctypes.CDLL("libgomp.so.1")
    except OSError:
        packages = Path(sysconfig.get_paths()["platlib"])
        link = packages / "cmeel.prefix" / "lib" / "libgomp.so.1"
        copies = sorted((packages / "casadi").glob("libgomp-*.so*"))
        if not copies:
            raise SystemExit("Pinocchio needs libgomp.so.1: on Debian, apt-get install libgomp1") from None
        link.unlink(missing_ok=True)
        link.symlink_to(Path("..", "..", "casadi", copies[0].name))
        print(f"no libgomp.so.1 on this system: {link.name} of the environment is CasADi's copy")


if __name__ == "__main__":
    main()
