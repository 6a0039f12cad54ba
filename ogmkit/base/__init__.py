"""What every room uses: names in messages, settings from plain values, files that are whole or absent."""
