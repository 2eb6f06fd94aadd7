"""The studies' shared modules: tables, cases, events, measures, endings, pushed walks, processes, result folders."""
