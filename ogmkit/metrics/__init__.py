"""What predictions are worth: arrays in, numbers out."""
