"""The other end of `worker`: a plain Python that runs one tool with a QGIS without a window.

    python worker_process.py FOLDER

reads FOLDER/order.json and writes its progress and its answer as lines of JSON, each under the
key "platwright". When its input ends, it cancels the tool. Here the packages are loaded before
QGIS, so that neither gets in the way of the other.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import sys
import threading
from pathlib import Path
from typing import Any


def tell(**message: Any) -> None:
    """Write one message."""
    print(json.dumps({"platwright": message}), flush=True)


def import_package(name: str, root: Path) -> None:
    """Import the package of the plugin under the name that it has in QGIS.

    Its folder lies among other plugins, which are not to be found here, so that `sys.path`
    stays as it is.
    """
    spec = importlib.util.spec_from_file_location(
        name, root / "__init__.py", submodule_search_locations=[str(root)]
    )
    if spec is None or spec.loader is None:
        msg = f"{root} is no package"
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


def load_packages(order: dict[str, Any]) -> None:
    """Import the Python packages, before anything of QGIS."""
    for folder in reversed(order["folders"]):
        sys.path.insert(0, folder)
    path = Path(order["root"]) / "plugin" / "guard.py"
    spec = importlib.util.spec_from_file_location("platwright_guard", path)
    if spec is None or spec.loader is None:
        msg = f"{path} is no module"
        raise ImportError(msg)
    guard = importlib.util.module_from_spec(spec)
    # Its classes look for their module there.
    sys.modules["platwright_guard"] = guard
    spec.loader.exec_module(guard)
    for name in (n for n in guard.PACKAGES if n in order["needs"]):
        guard.import_package(name)


def make_feedback() -> Any:
    """Return a feedback of Processing that writes messages and is cancelled by the input's end."""
    from qgis.core import QgsProcessingFeedback

    class Feedback(QgsProcessingFeedback):
        """Writes what it is told."""

        def __init__(self) -> None:
            super().__init__(False)
            self.errors: list[str] = []
            self.progressChanged.connect(lambda percent: tell(fraction=percent / 100))

        def setProgressText(self, text: str) -> None:
            tell(stage=text, fraction=self.progress() / 100)

        def pushInfo(self, info: str) -> None:
            tell(info=info)

        def pushWarning(self, warning: str) -> None:
            tell(warning=warning)

        def reportError(self, error: str, fatalError: bool = False) -> None:  # noqa: ARG002
            self.errors.append(error)

    feedback = Feedback()

    def wait() -> None:
        sys.stdin.read()
        feedback.cancel()

    threading.Thread(target=wait, daemon=True).start()
    return feedback


def parameters_of(order: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters as Processing wants them."""
    from qgis.core import QgsProperty

    made = {
        key: QgsProperty.fromExpression(value["expression"]) if isinstance(value, dict) else value
        for key, value in order["parameters"].items()
    }
    return {**made, **order["outputs"]}


def run_tool(order: dict[str, Any]) -> dict[str, Any]:
    """Run the tool and return the answer."""
    from qgis.core import QgsProcessingContext

    package = order["package"]
    import_package(package, Path(order["root"]))
    tools = importlib.import_module(f"{package}.plugin.tools").TOOLS
    (kind,) = [tool for tool in tools if tool.about.name == order["tool"]]
    tool = kind().create()
    parameters = parameters_of(order)
    context = QgsProcessingContext()
    feedback = make_feedback()
    good, text = tool.checkParameterValues(parameters, context)
    if not good:
        return {"error": text}
    results, good = tool.run(parameters, context, feedback)
    if not good:
        return {"error": "\n".join(feedback.errors) or "The tool stopped without a reason."}
    plain = (str, int, float, bool, type(None))
    return {"results": {key: v for key, v in results.items() if isinstance(v, plain)}}


def main() -> None:
    """Do what the order says."""
    here = Path(__file__).resolve().parent
    sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    order = json.loads((Path(sys.argv[1]) / "order.json").read_text(encoding="utf-8"))
    sys.path += order["qgis"]
    try:
        load_packages(order)
        from qgis.core import QgsApplication

        QgsApplication.setPrefixPath(order["prefix"], True)
        application = QgsApplication([], False)
        application.initQgis()
        answer = run_tool(order)
    except Exception as error:
        answer = {"error": f"In a process of its own: {type(error).__name__}: {error}"}
    tell(**answer)
    sys.stdout.flush()
    # QGIS crashes when objects outlive it, and Python's end is no place to sort them.
    os._exit(0)


if __name__ == "__main__":
    main()
