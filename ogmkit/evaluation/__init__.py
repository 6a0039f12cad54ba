"""What predictions are worth: numpy in, numbers out."""
