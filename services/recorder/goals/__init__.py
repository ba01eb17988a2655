"""Goals that people have named: kept as files, listed, deleted."""
