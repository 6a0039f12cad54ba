"""The whole chain, from a dataset to both tables, as one run that resumes where it was cut short."""
