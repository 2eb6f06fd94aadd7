"""What Drake leaves out of a model is left out of its copy, so that no later reading of it warns of that."""

from __future__ import annotations

import logging
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager

_TAG = re.compile(r"The tag '([\w.-]+)' found as a child of '([\w.-]+)' is currently unsupported")
_ATTRIBUTE = re.compile(r"The attribute '([\w.-]+)' found in an? '([\w.-]+)' tag is currently unsupported")
_SDF = re.compile(r"Ignoring unsupported SDFormat element in ([\w.-]+): ([\w.-]+)")


class LeftOut:
    """Tags and attributes that Drake leaves out.

    Attributes:
        tags, attributes: with the tag that holds them.
    """

    def __init__(self) -> None:
        self.tags: set[tuple[str, str]] = set()
        self.attributes: set[tuple[str, str]] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Notes what a warning of Drake says is left out; whether it says something else."""
        message = record.getMessage()
        if found := _TAG.search(message):
            self.tags.add((found[1], found[2]))
        elif found := _ATTRIBUTE.search(message):
            self.attributes.add((found[1], found[2]))
        elif found := _SDF.search(message):
            self.tags.add((found[2], found[1]))
        return not found

    def remove_from(self, root: ET.Element) -> list[str]:
        """Removes them from the tree of a model; returns the change in a sentence, if there is one."""
        for parent in list(root.iter()):
            parent[:] = [child for child in parent if (child.tag, parent.tag) not in self.tags]
            for name, tag in self.attributes:
                if parent.tag == tag:
                    parent.attrib.pop(name, None)
        names = sorted(f"{name} of {tag}" for name, tag in self.tags | self.attributes)
        return [f"what Drake does not have left out: {', '.join(names)}"] if names else []


@contextmanager
def noting_what_drake_leaves_out() -> Iterator[LeftOut]:
    """Collects inside what Drake's warnings say is left out; other warnings are logged."""
    left_out, logger = LeftOut(), logging.getLogger("drake")
    logger.addFilter(left_out)
    try:
        yield left_out
    finally:
        logger.removeFilter(left_out)
