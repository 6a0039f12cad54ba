"""What files of predictions call themselves; needs no torch."""

FORMAT = "ogmkit-predictions"
FORMAT_VERSION = 1
