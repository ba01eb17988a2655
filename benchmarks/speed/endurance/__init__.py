"""Hours of operation, to see whether memory, files, threads and step times grow."""
