"""The clock of the benchmark: processor time of this process [s].

On an idle machine it runs with the wall clock, since nothing here sleeps or uses a second thread. On a shared one it
leaves out what other processes take, though not what they do to the caches: hence turns, medians and ratios.
"""

from time import process_time as now

__all__ = ["now"]
