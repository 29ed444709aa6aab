"""What every method of the reduction gives and proves."""
