"""What plans of the next seconds are worth: numpy in, numbers out."""
