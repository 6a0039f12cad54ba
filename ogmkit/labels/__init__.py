"""The field's labels by name: what each repository draws, as a record, and one engine for all."""
