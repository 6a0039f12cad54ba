"""Whole jobs over an executor: resumable, interruptible, bounded in memory."""
