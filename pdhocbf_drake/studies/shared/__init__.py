"""The studies' shared modules: cases, events, measures, endings, pushed walks, processes, result folders."""
