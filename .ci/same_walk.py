"""Ends with an error unless the metrics of two runs agree to 1e-6 of their magnitude: python .ci/same_walk.py RUN RUN.

It needs benchmarks/ on the path.
"""

import sys
from fnmatch import fnmatchcase
from pathlib import Path

from compare import TIMES, difference, metrics

TOLERANCE = 1e-6

old, new = (metrics(Path(folder)) for folder in sys.argv[1:])
names = [name for name in sorted({*old, *new}) if not any(fnmatchcase(name, pattern) for pattern in TIMES)]
apart = {name: difference(old.get(name), new.get(name)) for name in names}
worst = max(apart, key=lambda name: apart[name])
print(f"two Drakes, one walk: {len(names)} metrics, which differ by {apart[worst]:.1e} at most ({worst})")
sys.exit(apart[worst] > TOLERANCE)
