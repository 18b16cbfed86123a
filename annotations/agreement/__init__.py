"""Several annotators' documents of the same volumes → deviations, statistics, consensus, report."""
