"""Static output feedback: gains of one matrix, tuned for the largest gain or the variance of a channel."""
