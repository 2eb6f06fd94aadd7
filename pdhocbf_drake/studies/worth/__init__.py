"""What a barrier is worth when something goes wrong: `pdhocbf worth`."""
