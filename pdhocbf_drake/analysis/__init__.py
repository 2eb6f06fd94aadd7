"""From a run's log to numbers, figures, a replay and a report; nothing here simulates."""
