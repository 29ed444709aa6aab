"""The oracle: what M, C, K say without the reduction, with which it shares no code."""
