"""The code blocks of README and book, read and run as a reader would."""
