"""Draws the pictures of the README: `python docs/pictures.py` writes the diagram beside this file (needs graphviz).

It is Drake's own Graphviz string of the diagram, less the log, which the signals go to, and less the
ports that nothing uses, not even a log.
"""

from __future__ import annotations

import re
import subprocess
from itertools import zip_longest
from pathlib import Path

import pydot
from pydrake.systems.framework import Diagram

from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.systems.unbundled import leaf_of

HERE = Path(__file__).parent


def main() -> None:
    """Writes diagram.svg."""
    source = HERE / "diagram.dot"
    source.write_text(picture().to_string(), encoding="utf-8")
    subprocess.run(["dot", "-Tsvg", "-o", HERE / "diagram.svg", source], check=True)
    source.unlink()


def picture() -> pydot.Dot:
    """The diagram of `walking` as a graph."""
    logged = make_diagram(load_scenario("walking"))
    text = logged.diagram.GetGraphvizString(max_depth=1)
    (graph,) = pydot.graph_from_dot_data(text)
    parts = [graph]
    for part in parts:  # grows while it is read: subgraphs of subgraphs
        parts += part.get_subgraphs()
    nodes = {node.get_name(): node for part in parts for node in part.get_nodes()}
    edges = [(part, edge) for part in parts for edge in part.get_edges()]
    gone = {name for name, node in nodes.items() if re.search(r"name=(log|signals)\n", str(node.get_label()))}
    used = set()
    for part, edge in edges:
        ends = [str(end) for end in (edge.get_source(), edge.get_destination())]
        if any(end.split(":")[0] in gone for end in ends):
            part.del_edge(*ends)
        used |= {tuple(end.split(":")[:2]) for end in ends if ":" in end}
    for part in parts:
        for name in gone:
            part.del_node(name)
    classes = unbundled_classes(logged.diagram)
    for name, node in nodes.items():
        if label := str(node.get_label() or ""):
            system = re.search(r"name=(\w+)", label)
            if system is not None and system[1] in classes:
                label = label.replace("<B>Diagram</B>", f"<B>{classes[system[1]]}</B>")
            node.set_label(slim(label, {port for block, port in used if block == name}))
    graph.set_rankdir("LR")
    return graph


def unbundled_classes(diagram: Diagram) -> dict[str, str]:
    """The class of each block whose outputs are apart, by the name of its diagram, which Drake draws in its place."""
    inside = [system for system in diagram.GetSystems() if isinstance(system, Diagram)]
    return {d.get_name(): type(leaf_of(d)).__name__ for d in inside if d.HasSubsystemNamed("leaf")}


def slim(label: str, used: set[str]) -> str:
    """Takes ports without an arrow out of a block, and the package out of its class name."""
    label = re.sub(r"<B>[\w.]*\.(\w+)</B>", r"<B>\1</B>", label)
    cells = re.findall(r'<TD PORT="(\w+)"[^>]*>(.*?)</TD>', label)
    ins = [(port, text) for port, text in cells if port in used and port.startswith("u")]
    outs = [(port, text) for port, text in cells if port in used and port.startswith("y")]
    if not ins and not outs:
        return label
    rows = []
    for left, right in zip_longest(ins, outs, fillvalue=("", "")):
        rows.append("<TR>" + "".join(_cell(*side) for side in (left, right)) + "</TR>")
    head = label[: label.index("</TR>") + len("</TR>")]
    return head + "\n".join(rows) + "</TABLE>>"


def _cell(port: str, text: str) -> str:
    return f'<TD PORT="{port}" BORDER="1">{text}</TD>' if port else '<TD BORDER="0"></TD>'


if __name__ == "__main__":
    main()
