"""The whole chain, from a dataset to both tables, as one run that goes on where it was cut short."""
