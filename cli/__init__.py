"""The `ogmkit` command."""
