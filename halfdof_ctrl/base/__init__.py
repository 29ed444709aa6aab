"""What every room needs: errors, arrays, names, numbers, threads."""
