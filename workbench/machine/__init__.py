"""What the machine gives and takes: time, processes, threads, signals, files, the terminal."""
