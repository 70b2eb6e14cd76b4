"""The other end of `local`: a plain Python that does one piece of work after the other.

    python process.py CONFIGURATION

reads orders, one a line, and writes messages, one a line of JSON. It ends with its input: at the
latest when whoever started it is no more.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import queue
import sys
import threading
from pathlib import Path
from typing import Any, BinaryIO

#: The name of the library here, whatever it is where the work comes from.
NAME = "platwright"


def open_line() -> BinaryIO:
    """Return where messages are written, and send all else that is written there elsewhere.

    Solvers write what they like to the standard output.
    """
    line = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return line


def import_library(root: str) -> None:
    """Import the library from its folder under the name `NAME`."""
    spec = importlib.util.spec_from_file_location(
        NAME, str(Path(root) / "__init__.py"), submodule_search_locations=[root]
    )
    if spec is None or spec.loader is None:
        msg = f"{root} is no package"
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules[NAME] = module
    spec.loader.exec_module(module)


def read_orders(orders: queue.SimpleQueue[str]) -> None:
    """Pass on each line of the input; end with it."""
    for line in sys.stdin.buffer:
        orders.put(line.decode("utf-8"))
    os._exit(0)


def main() -> None:
    """Do the work until the input ends."""
    line = open_line()

    def tell(**message: Any) -> None:
        line.write(json.dumps(message).encode() + b"\n")
        line.flush()

    orders: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=read_orders, args=(orders,), daemon=True).start()
    configuration = json.loads(sys.argv[1])
    # Not the folder of this program, whose modules could be taken for others.
    here = Path(__file__).resolve().parent
    rest = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    sys.path[:] = list(dict.fromkeys([*configuration["folders"], *rest]))
    try:
        import_library(configuration["root"])
        job = importlib.import_module(f"{NAME}.tasks.job")
    except ImportError as error:
        tell(unable=f"{type(error).__name__}: {error}")
        return
    tell(ready=True)
    teller = job.Teller(lambda said: tell(said=said), lambda: False)
    while True:
        tell(answer=job.answer(orders.get(), teller))


if __name__ == "__main__":
    main()
