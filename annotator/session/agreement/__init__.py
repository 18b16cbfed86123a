"""Several annotators of one volume: what may be compared, how far they lie apart, and the consensus."""
