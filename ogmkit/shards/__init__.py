"""HDF5 shards: one schema, from which writer, reader, checker and documentation come."""
