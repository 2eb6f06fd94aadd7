"""What the studies share: cases, events, measures, endings, pushed walks, processes and result folders."""
